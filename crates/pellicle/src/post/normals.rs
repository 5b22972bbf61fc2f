//! Vertex normals from the triangles, and smoother ones.
//!
//! A triangle counts by its area: normals are the normalised sum of the cross products around a vertex. They point
//! outward where triangles wind counter-clockwise seen from outside. Where the sum is 0 (no triangle, or all without area)
//! the normal is 0.
//!
//! Source: the weights are those of Gouraud-shading practice, see Max, Weights for Computing Vertex Normals from Facet
//! Normals, 1999; averaging them over the neighbors is Löschner et al. 2023, section 5.

use super::check;
use crate::{
    Control, Error, Mesh,
    math::{memory::filled, simd::Quad},
    mesh::rings::{Rings, Step, Values},
    mesh::stars::Stars,
};

/// Gives the mesh normals from its triangles, then lets every normal be the normalised mean of itself and its neighbors,
/// `iterations` times.
///
/// # Errors
/// [`Error::Count`] for an index that names no vertex, [`Error::Length`] for an attribute of the wrong length,
/// [`Error::Cancelled`].
pub fn from_triangles(mesh: &mut Mesh, iterations: usize, control: &Control<'_>) -> Result<(), Error> {
    mesh.normals.clear();
    check(mesh)?;
    let stars = Stars::of(&mesh.triangles, mesh.vertices.len());
    with_stars(mesh, &stars, &Rings::of(&stars), &mut Values::default(), iterations, control)
}

/// The same for a mesh whose stars are known, with memory for its normals.
pub(super) fn with_stars(
    mesh: &mut Mesh,
    stars: &Stars,
    rings: &Rings,
    values: &mut Values,
    iterations: usize,
    control: &Control<'_>,
) -> Result<(), Error> {
    let vertices = &mesh.vertices;
    let at = |v: u32| {
        let [x, y, z] = vertices[v as usize];
        Quad::load(&[x, y, z, 0.0])
    };
    let of_vertex = |v: usize| {
        let here = at(v as u32);
        let mut sum = Quad::splat(0.0);
        for corner in stars.corners(v) {
            let [p, q] = corner.map(at);
            sum = sum + (p - here).cross(q - here);
        }
        let [x, y, z, _] = sum.array();
        let [x, y, z] = unit([x, y, z]);
        [x, y, z, 0.0]
    };
    // A fourth place, so that a normal is one load of four lanes.
    values.set(rings, of_vertex);
    values.steps(rings, &[Mean], iterations, control)?;
    mesh.normals = filled([0.0; 3], vertices.len());
    values.take_back(rings, &mut mesh.normals);
    Ok(())
}

/// The direction of the sum of a vertex's normal and its neighbors'. They are of length 1, so `f32` has room.
struct Mean;

impl Step for Mean {
    #[inline(always)]
    fn of(&self, here: Quad, sum: Quad, _: f32) -> Quad {
        let sum = sum + here;
        let length = sum.dot(sum).sqrt();
        sum * Quad::splat(if length > 0.0 { 1.0 / length } else { 0.0 })
    }
}

/// In double precision, so that the tiny areas of a fine mesh do not vanish when squared.
fn unit(v: [f32; 3]) -> [f32; 3] {
    let wide = v.map(f64::from);
    let length = wide.iter().map(|x| x * x).sum::<f64>().sqrt();
    let per = if length > 0.0 { 1.0 / length } else { 0.0 };
    wide.map(|x| (x * per) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Params, reconstruct};

    #[test]
    fn point_outward_on_a_drop_and_become_smoother() {
        let mut mesh = reconstruct(&[[0.0f32; 3]], &Params { cell_size: 0.1, ..Params::new(0.025) }).unwrap();
        // Bumps of a hundredth of the radius, which normals see much larger.
        for (i, v) in mesh.vertices.iter_mut().enumerate() {
            *v = v.map(|x| x * (1.0 + (i * 37 % 11) as f32 * 1e-3));
        }
        let error = |mesh: &Mesh| {
            let cosines = mesh.vertices.iter().zip(&mesh.normals).map(|(v, n)| {
                let out = unit(*v);
                f64::from((0..3).map(|a| out[a] * n[a]).sum::<f32>()).min(1.0)
            });
            cosines.map(f64::acos).sum::<f64>() / mesh.vertices.len() as f64
        };
        from_triangles(&mut mesh, 0, &Control::default()).unwrap();
        let rough = error(&mesh);
        assert!(rough < 0.3, "{rough}");
        from_triangles(&mut mesh, 10, &Control::default()).unwrap();
        assert!(error(&mesh) < 0.7 * rough, "{} {rough}", error(&mesh));
    }

    #[test]
    fn tiny_triangles_have_normals_and_flat_ones_none() {
        let tiny = 1e-15f32;
        let vertices = vec![[0.0; 3], [tiny, 0.0, 0.0], [0.0, tiny, 0.0], [1.0; 3]];
        let mut mesh = Mesh { vertices, triangles: vec![[0, 1, 2]], ..Mesh::default() };
        from_triangles(&mut mesh, 1, &Control::default()).unwrap();
        assert_eq!(mesh.normals[0], [0.0, 0.0, 1.0]);
        assert_eq!(mesh.normals[3], [0.0; 3]);
    }
}
