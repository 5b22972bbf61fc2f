//! How far is a mesh from another, or from the surface of a field?
//!
//! A mesh is sampled: every triangle is cut into n² equal ones, as many as its part of the whole area asks for, and their
//! middles are samples that weigh as much as their area; every vertex is a sample without weight that only the maximum sees.
//! So mean and root mean square are integrals over the surface, whatever the triangulation, and the maximum is a Hausdorff
//! distance from below, which at vertices is exact.
//!
//! Distances to a mesh are exact, by a tree of boxes; distances to a field are |value − isovalue| / |gradient|, right to
//! first order near the surface. The same input gives the same numbers, to the last bit, for any thread count.
//!
//! Source: Cignoni, Rocchini, Scopigno, Metro: measuring error on simplified surfaces, 1998, for the sampling and both
//! directions.

use rayon::prelude::*;

use super::{Mesh, quality::corners};
use crate::math::{
    tree::Tree,
    vector::{add_scaled, cross, length, subtract},
};

/// Triangles sampled by one task. Fixed, so that sums do not depend on the number of threads.
const CHUNK: usize = 1 << 10;
/// Most cuts of a triangle's side.
const MOST_CUTS: usize = 64;

/// Distances of the samples of a mesh to something.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Deviation {
    /// Samples taken.
    pub samples: usize,
    /// Samples whose distance is not finite (a field without a gradient, say); left out of the others.
    pub skipped_samples: usize,
    /// Mean distance, weighted by area, in world units.
    pub mean: f64,
    /// Root of the mean square of the distance, weighted by area, in world units.
    pub rms: f64,
    /// Largest distance, in world units.
    pub max: f64,
}

/// Sums before they are divided.
#[derive(Clone, Copy, Default)]
struct Sums {
    samples: usize,
    skipped: usize,
    weight: f64,
    distance: f64,
    square: f64,
    max: f64,
}

impl Sums {
    fn add(&mut self, distance: f64, weight: f64) {
        self.samples += 1;
        if !distance.is_finite() {
            self.skipped += 1;
            return;
        }
        self.weight += weight;
        self.distance += weight * distance;
        self.square += weight * distance * distance;
        self.max = self.max.max(distance);
    }
}

impl Deviation {
    /// Distances of about `samples` samples of `mesh`, at least one a triangle, by a function of world position.
    pub fn by(mesh: &Mesh, samples: usize, distance: impl Fn([f64; 3]) -> f64 + Sync) -> Self {
        Self::with(mesh, samples, || (), |(), position| distance(position))
    }

    /// First-order distances to the surface where a field is `isovalue`: `field` gives value and gradient at a world
    /// position.
    pub fn from_field(
        mesh: &Mesh,
        samples: usize,
        isovalue: f64,
        field: impl Fn([f64; 3]) -> (f64, [f64; 3]) + Sync,
    ) -> Self {
        Self::by(mesh, samples, |position| {
            let (value, gradient) = field(position);
            (value - isovalue).abs() / length(gradient)
        })
    }

    /// Distances to the nearest point of `reference`. All are infinite, hence skipped, when that has no triangle.
    pub fn from_mesh(mesh: &Mesh, samples: usize, reference: &Mesh) -> Self {
        let tree = Tree::of(reference.world_triangles());
        // Samples come in runs of near ones: the last nearest triangle bounds the search for the next.
        Self::with(mesh, samples, || 0, |last, position| tree.distance(position, last))
    }

    fn with<S>(
        mesh: &Mesh,
        samples: usize,
        start: impl Fn() -> S + Sync,
        distance: impl Fn(&mut S, [f64; 3]) -> f64 + Sync,
    ) -> Self {
        let areas: Vec<f64> =
            mesh.triangles.par_chunks(CHUNK).map(|c| c.iter().map(|&t| area(mesh, t)).sum()).collect();
        let area_a_sample = areas.iter().sum::<f64>() / samples.max(1) as f64;
        let of_triangles = mesh.triangles.par_chunks(CHUNK).map(|chunk| {
            let (mut sums, mut state) = (Sums::default(), start());
            for &triangle in chunk {
                let Some(at) = corners(mesh, triangle) else { continue };
                for_each_sample(at, area_a_sample, |offset, weight| {
                    sums.add(distance(&mut state, add_scaled(mesh.origin, offset, 1.0)), weight);
                });
            }
            sums
        });
        let of_vertices = mesh.vertices.par_chunks(CHUNK).map(|chunk| {
            let (mut sums, mut state) = (Sums::default(), start());
            for vertex in chunk.iter().filter(|v| v.iter().all(|x| x.is_finite())) {
                sums.add(distance(&mut state, add_scaled(mesh.origin, vertex.map(f64::from), 1.0)), 0.0);
            }
            sums
        });
        let parts: Vec<Sums> = of_triangles.chain(of_vertices).collect();
        let sum = parts.iter().fold(Sums::default(), |sum, part| Sums {
            samples: sum.samples + part.samples,
            skipped: sum.skipped + part.skipped,
            weight: sum.weight + part.weight,
            distance: sum.distance + part.distance,
            square: sum.square + part.square,
            max: sum.max.max(part.max),
        });
        let weight = if sum.weight > 0.0 { sum.weight } else { 1.0 };
        Self {
            samples: sum.samples,
            skipped_samples: sum.skipped,
            mean: sum.distance / weight,
            rms: (sum.square / weight).sqrt(),
            max: sum.max,
        }
    }
}

/// Two meshes, each measured from the other.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Comparison {
    /// From samples of the mesh to the reference: what is there and should not be.
    pub to_reference: Deviation,
    /// From samples of the reference to the mesh: what should be there and is not.
    pub from_reference: Deviation,
}

impl Comparison {
    /// Compares two meshes by about `samples` samples of each.
    pub fn of(mesh: &Mesh, reference: &Mesh, samples: usize) -> Self {
        Self {
            to_reference: Deviation::from_mesh(mesh, samples, reference),
            from_reference: Deviation::from_mesh(reference, samples, mesh),
        }
    }

    /// The larger of the two maxima.
    pub fn hausdorff(&self) -> f64 {
        self.to_reference.max.max(self.from_reference.max)
    }
}

fn area(mesh: &Mesh, triangle: [u32; 3]) -> f64 {
    corners(mesh, triangle).map_or(0.0, area_of)
}

fn area_of([a, b, c]: [[f64; 3]; 3]) -> f64 {
    0.5 * length(cross(subtract(b, a), subtract(c, a)))
}

/// Cuts a triangle into equal ones of at most about `area_a_sample` and calls `visit` with the middle and the area of each.
fn for_each_sample(corners: [[f64; 3]; 3], area_a_sample: f64, mut visit: impl FnMut([f64; 3], f64)) {
    let area = area_of(corners);
    let cuts = (area / area_a_sample).sqrt().ceil();
    // Written so that a quotient that is not a number makes one cut.
    let n = if cuts > 1.0 { (cuts as usize).min(MOST_CUTS) } else { 1 };
    let [a, b, c] = corners;
    let (u, v) = (subtract(b, a), subtract(c, a));
    let at = |i: f64, j: f64| add_scaled(add_scaled(a, u, i / (3 * n) as f64), v, j / (3 * n) as f64);
    for i in 0..n {
        for j in 0..n - i {
            let (x, y) = ((3 * i) as f64, (3 * j) as f64);
            visit(at(x + 1.0, y + 1.0), area / (n * n) as f64);
            if i + j + 1 < n {
                visit(at(x + 2.0, y + 2.0), area / (n * n) as f64);
            }
        }
    }
}

#[cfg(test)]
mod tests;
