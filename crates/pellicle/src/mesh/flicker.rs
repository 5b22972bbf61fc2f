//! Flicker: the change of a surface from one frame to the next that the particles' motion does not explain.
//!
//! The surface of a frame is carried along: each vertex moves as the particles around it do until the next frame, by the mean of
//! their displacements, weighted as for any attribute. What is left between the carried surface and that of the next frame is
//! flicker: a vertex's distance to the other surface, either way, so that what appears counts like what vanishes.
//!
//! Lengths are in whatever unit one divides by; the spacing of the particles is the natural one. The root mean square tells of all;
//! median and the value that one in twenty exceeds stay what they are where droplets merge or tear, which is a change of topology
//! and no flicker. A surface that is carried by the true motion of its points has none, but for the lattice's: its vertices lie on
//! edges that stay in place, which shrinks with the cell.
//!
//! Source: this project.

use rayon::prelude::*;

use super::{Mesh, Summary};
use crate::math::tree::Tree;

/// Vertices measured by one task.
const CHUNK: usize = 1 << 10;

/// Distances between a surface that was carried to the next frame and that frame's own, in world units.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Flicker {
    /// Root of their mean square.
    pub rms: f64,
    /// All else of their distribution.
    pub distances: Summary,
}

impl Flicker {
    /// Between a surface that was [`carried`](Mesh::carried) and the next frame's, from the vertices of either. 0 where one of them has
    /// no triangle.
    ///
    /// ```
    /// # use pellicle::{Attribute, Control, Params, Reconstructor, mesh::Flicker};
    /// let params = Params::new(0.05);
    /// let block = |shift: f32| -> Vec<[f32; 3]> {
    ///     (0..125).map(|i| [i % 5, i / 5 % 5, i / 25].map(|v| v as f32 * 0.1 + shift)).collect()
    /// };
    /// let (before, after) = (block(0.0), block(0.01));
    /// let displacements = vec![0.01; 3 * before.len()];
    /// let attributes = [Attribute::new("displacement", 3, &displacements)];
    /// let mesh = Reconstructor::new()
    ///     .extract((&before).into(), &attributes, &params, &Control::default())?
    ///     .to_mesh()?;
    /// let next = pellicle::reconstruct(&after, &params)?;
    /// let carried = mesh.carried(&mesh.attributes[0].values);
    /// // In spacings: a hundredth of one is what the lattice makes of it.
    /// assert!(Flicker::between(&carried, &next).rms / 0.1 < 0.02);
    /// # Ok::<(), pellicle::Error>(())
    /// ```
    pub fn between(carried: &Mesh, next: &Mesh) -> Self {
        let mut all = distances(carried, next);
        all.extend(distances(next, carried));
        let squares: Vec<f64> = all.par_chunks(CHUNK).map(|part| part.iter().map(|d| d * d).sum()).collect();
        let rms = (squares.iter().sum::<f64>() / all.len().max(1) as f64).sqrt();
        Self { rms, distances: Summary::of(all) }
    }
}

impl Mesh {
    /// The same triangles, each vertex moved by its displacement: three numbers a vertex, in world units. Normals and attributes
    /// are left behind.
    ///
    /// # Panics
    /// If there are fewer displacements than vertices.
    pub fn carried(&self, displacements: &[f32]) -> Mesh {
        let moved = |(i, v): (usize, &[f32; 3])| [0, 1, 2].map(|a| v[a] + displacements[3 * i + a]);
        let vertices = self.vertices.par_iter().enumerate().map(moved).collect();
        Mesh { origin: self.origin, vertices, triangles: self.triangles.clone(), ..Mesh::default() }
    }
}

/// Distance of each vertex to the nearest point of another surface; none where that has no triangle.
fn distances(from: &Mesh, to: &Mesh) -> Vec<f64> {
    let tree = Tree::of(to.world_triangles());
    let of = |first: usize| {
        let (tree, mut last) = (&tree, 0);
        let end = (first + CHUNK).min(from.vertices.len());
        (first..end).map(|v| tree.distance(from.position(v), &mut last)).collect::<Vec<_>>()
    };
    let parts: Vec<Vec<f64>> = (0..from.vertices.len()).into_par_iter().step_by(CHUNK).map(of).collect();
    parts.into_iter().flatten().filter(|d| d.is_finite()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Params, ScalarField, reconstruct};

    /// A ball of particles, jittered, moved by `shift`.
    fn ball(shift: [f64; 3]) -> Vec<[f64; 3]> {
        let jitter = |i: i32| f64::from(i.wrapping_mul(1_103_515_245).wrapping_add(12_345) >> 8 & 0xffff) / 65536.0;
        let places = (0..11i32.pow(3)).map(|i| [i % 11 - 5, i / 11 % 11 - 5, i / 121 - 5]);
        let inside = places.enumerate().filter(|(_, p)| p.iter().map(|v| v * v).sum::<i32>() < 24);
        inside
            .map(|(i, p)| [0, 1, 2].map(|a| 0.1 * (f64::from(p[a]) + 0.2 * jitter(3 * i as i32 + a as i32)) + shift[a]))
            .collect()
    }

    /// Flicker in spacings of a ball that moves as a whole.
    fn of_translation(field: ScalarField, cell_size: f64, shift: [f64; 3]) -> Flicker {
        let params = Params { cell_size, ..Params::with_field(0.05, field) };
        let mesh = |shift| reconstruct(&ball(shift), &params).unwrap();
        let before = mesh([0.0; 3]);
        let displacements: Vec<f32> = before.vertices.iter().flat_map(|_| shift.map(|v| v as f32)).collect();
        let carried = before.carried(&displacements);
        let flicker = Flicker::between(&carried, &mesh(shift));
        Flicker { rms: flicker.rms / 0.1, ..flicker }
    }

    #[test]
    fn what_moves_as_a_whole_flickers_by_the_lattice_alone() {
        for name in ["sph", "solenthaler", "anisotropic"] {
            let field = ScalarField::from_name(name).unwrap();
            // Not a multiple of any cell; the second is, of both.
            let [coarse, fine] = [1.0, 0.5].map(|cell| of_translation(field, cell, [0.0137, -0.0291, 0.0223]).rms);
            assert!(coarse > 1e-4 && coarse < 0.05, "{name}: {coarse}");
            assert!(fine < 0.6 * coarse, "{name}: {fine} of {coarse}");
            for cell in [1.0, 0.5] {
                let whole = of_translation(field, cell, [0.1, -0.05, 0.0]).rms;
                assert!(whole < 1e-3, "{name}: {whole}");
            }
        }
    }

    #[test]
    fn what_moves_unexplained_counts_and_what_vanishes_does_too() {
        let params = Params::new(0.05);
        let still = reconstruct(&ball([0.0; 3]), &params).unwrap();
        let moved = reconstruct(&ball([0.05, 0.0, 0.0]), &params).unwrap();
        let flicker = Flicker::between(&still, &moved);
        // Half a spacing along x: the mean of its part along the normal of a sphere is 1/√3 of that.
        assert!((flicker.rms / (0.05 / 3f64.sqrt()) - 1.0).abs() < 0.1, "{flicker:?}");
        let mut two = ball([0.0; 3]);
        two.push([3.0, 0.0, 0.0]);
        let with_drop = reconstruct(&two, &params).unwrap();
        for flicker in [Flicker::between(&still, &with_drop), Flicker::between(&with_drop, &still)] {
            assert!(flicker.distances.max > 2.0 && flicker.distances.p95 < 1e-6, "{flicker:?}");
        }
        assert_eq!(Flicker::between(&still, &Mesh::default()), Flicker::default());
    }
}
