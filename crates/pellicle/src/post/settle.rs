//! Vertices on walls, held there while a mesh is finished.
//!
//! Merging, smoothing and decimation know of no wall: they would round the rim of a contact and lift it off. So vertices on
//! walls get no weight for smoothing (a crowding of NaN, which is also that of what they are merged with), they are marked before ([`on_walls`]), the mark travels as an attribute does, and what still has half of it is put back
//! after ([`settle`]), as is all that went into a wall. Connectivity stays as it is.
//!
//! Source: this project.

use rayon::prelude::*;

use super::check;
use crate::{Error, Mesh, Walls};

/// 1 for each vertex that lies on a wall, else 0. `spacing` is the lattice's, in world units.
pub fn on_walls(mesh: &Mesh, walls: &Walls, spacing: f64) -> Vec<f32> {
    let is_on = |v: usize| f32::from(u8::from(walls.height(mesh.position(v), spacing).abs() <= Walls::ON * spacing));
    (0..mesh.vertices.len()).into_par_iter().map(is_on).collect()
}

/// Puts vertices on the walls: those whose mark is at least a half and that are less than a cell away, and those within.
/// Their normals, where there are any, are those of the wall, into it. Vertices that touch several walls go to all of them.
///
/// # Errors
/// [`Error::Length`] when there is not one mark a vertex, or an attribute of the wrong length.
pub fn settle(mesh: &mut Mesh, walls: &Walls, marks: &[f32], spacing: f64) -> Result<(), Error> {
    check(mesh)?;
    let n = mesh.vertices.len();
    if marks.len() != n {
        return Err(Error::Length { what: "marks".into(), found: marks.len(), expected: n });
    }
    let origin = mesh.origin;
    let place = |vertex: &[f32; 3]| [0, 1, 2].map(|a| origin[a] + f64::from(vertex[a]));
    mesh.vertices.par_iter_mut().zip(marks).for_each(|(vertex, &mark)| {
        let at = place(vertex);
        let height = walls.height(at, spacing);
        if height < 0.0 || (mark >= 0.5 && height < spacing) {
            // Only those walls whose mark this is, or that the vertex is in.
            let settled = walls.settled(at, if mark >= 0.5 { spacing } else { 0.0 });
            *vertex = [0, 1, 2].map(|a| (settled[a] - origin[a]) as f32);
        }
    });
    mesh.normals.par_iter_mut().zip(&mesh.vertices).for_each(|(normal, vertex)| {
        if let Some(into) = walls.touched(place(vertex), Walls::ON * spacing) {
            *normal = into.map(|n| n as f32);
        }
    });
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Control, Params, mesh::Report, post::Finish, post::snap::Nodes, reconstruct};

    #[test]
    fn a_flat_contact_stays_flat_while_all_around_is_smoothed() {
        let positions: Vec<[f32; 3]> =
            (0..512).map(|i| [i % 8, i / 8 % 8, i / 64].map(|v| v as f32 * 0.1 + 0.05)).collect();
        let params = Params::new(0.05);
        let walls = Walls::new().with_plane([0.0, 0.0, 1.0], 0.04).unwrap();
        let mut mesh = reconstruct(&positions, &params).unwrap();
        let floor = crate::post::cut::Plane { normal: [0.0, 0.0, -1.0], offset: -0.04 };
        crate::post::cut::cut(&mut mesh, &floor, &Control::default()).unwrap();
        let spacing = params.spacing();
        let marks = on_walls(&mesh, &walls, spacing);
        let count = marks.iter().filter(|m| **m == 1.0).count();
        assert!(count > 40 && count < mesh.vertices.len() / 2);
        let finished = |settles: bool| {
            let mut mesh = mesh.clone();
            mesh.attributes.push(crate::VertexAttribute::new("", 1, marks.clone()));
            let free: Vec<f32> = marks.iter().map(|mark| if *mark > 0.0 { f32::NAN } else { f32::MAX }).collect();
            let nodes = Nodes::cubic(spacing);
            Finish::good_looking().apply(&mut mesh, &nodes, Some(&free), &Control::default()).unwrap();
            let marks = mesh.attributes.pop().unwrap().values;
            if settles {
                settle(&mut mesh, &walls, &marks, spacing).unwrap();
            }
            let on: Vec<f32> = (0..marks.len()).filter(|&v| marks[v] >= 0.5).map(|v| mesh.vertices[v][2]).collect();
            assert!(Report::of(&mesh).closed_manifold());
            (on.iter().filter(|z| **z != 0.04).count(), mesh)
        };
        assert!(finished(false).0 > 0, "merging lifts some");
        let (off, mesh) = finished(true);
        assert_eq!(off, 0);
        assert!(mesh.vertices.iter().all(|v| v[2] >= 0.04));
        assert!(mesh.vertices.iter().zip(&mesh.normals).all(|(v, n)| v[2] > 0.0401 || *n == [0.0, 0.0, -1.0]));
        assert!(settle(&mut mesh.clone(), &walls, &[1.0], spacing).is_err());
    }
}
