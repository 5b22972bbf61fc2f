//! How good are the triangles of a mesh? Shape, size, angles, valence, in numbers that papers and other tools use.
//!
//! [`Report`](super::Report) says whether a mesh is sound; this says whether it is pleasant: for a finite element solver,
//! for smooth shading, for a decimator. The same mesh gives the same numbers, to the last bit, for any thread count.
//!
//! Triangles with an index that names no vertex, or with a corner that is not finite, have no shape: they are left out of
//! everything and counted in [`Quality::skipped_triangles`]. A triangle whose area is exactly 0 has radius ratio 0 and an infinite aspect
//! ratio, and is counted in [`Quality::degenerate_triangles`].
//!
//! Source: Pébay & Baker, Analysis of triangle quality measures, 2003: radius ratio (there inverted) and aspect ratio.

use rayon::prelude::*;

use super::Mesh;
use crate::math::vector::{cross, dot, length, subtract};

/// Triangles handled by one task. Fixed, so that sums do not depend on the number of threads.
const CHUNK: usize = 1 << 13;

/// A distribution in a few numbers. All are 0 when there is nothing to describe.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Summary {
    /// Smallest.
    pub min: f64,
    /// One in a hundred is below.
    pub p1: f64,
    /// One in twenty is below.
    pub p5: f64,
    /// Half are below.
    pub median: f64,
    /// Arithmetic mean; infinite when a value is.
    pub mean: f64,
    /// One in twenty is above.
    pub p95: f64,
    /// One in a hundred is above.
    pub p99: f64,
    /// Largest.
    pub max: f64,
}

impl Summary {
    /// Of any numbers that are not NaN; their order plays no part but in the last bits of the mean.
    pub fn of(mut values: Vec<f64>) -> Self {
        if values.is_empty() {
            return Self::default();
        }
        let sums: Vec<f64> = values.par_chunks(CHUNK).map(|chunk| chunk.iter().sum()).collect();
        let mean = sums.iter().sum::<f64>() / values.len() as f64;
        values.par_sort_unstable_by(f64::total_cmp);
        let last = values.len() - 1;
        let at = |part: f64| values[(part * last as f64).round() as usize];
        Self {
            min: values[0],
            p1: at(0.01),
            p5: at(0.05),
            median: at(0.5),
            mean,
            p95: at(0.95),
            p99: at(0.99),
            max: values[last],
        }
    }
}

/// Valences counted one by one; from here on they are counted together.
pub const VALENCE_END: usize = 32;

/// Shapes of the triangles of one mesh.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Quality {
    /// Triangles that were measured.
    pub triangles: usize,
    /// Triangles with an index that names no vertex or a corner that is not finite: not measured.
    pub skipped_triangles: usize,
    /// Triangles whose area is exactly 0.
    pub degenerate_triangles: usize,
    /// Twice the radius of the inscribed circle over that of the circumscribed one: 1 for an equilateral triangle, 0 for
    /// a degenerate one.
    pub radius_ratio: Summary,
    /// Longest side over the altitude on it, times √3/2: 1 for an equilateral triangle, infinite for a degenerate one.
    pub aspect_ratio: Summary,
    /// Smallest angle of each triangle, in degrees; at best 60.
    pub min_angle: Summary,
    /// Largest angle of each triangle, in degrees; at best 60.
    pub max_angle: Summary,
    /// Lengths of all sides of triangles in world units; an edge between two triangles counts twice.
    pub edge_length: Summary,
    /// `valence[n]` vertices have n triangles, the last entry stands for [`VALENCE_END`] and more. 6 is the best inside a
    /// surface.
    pub valence: Vec<usize>,
    /// Sum of areas, in world units squared.
    pub area: f64,
    /// Volume within, in world units cubed, positive for triangles that wind counter-clockwise seen from outside; of
    /// closed meshes only it means something.
    pub volume: f64,
}

/// What one triangle says.
#[derive(Clone, Copy)]
struct Shape {
    sides: [f64; 3],
    radius_ratio: f64,
    aspect_ratio: f64,
    min_angle: f64,
    max_angle: f64,
    area: f64,
    volume: f64,
}

impl Shape {
    fn of([a, b, c]: [[f64; 3]; 3]) -> Self {
        let edges = [subtract(b, a), subtract(c, b), subtract(a, c)];
        let sides = edges.map(length);
        let normal = cross(edges[0], subtract(c, a));
        let twice_area = length(normal);
        let longest = sides.into_iter().fold(0.0, f64::max);
        let product = (sides[0] + sides[1] + sides[2]) * sides[0] * sides[1] * sides[2];
        // Angle at the corner where side i ends and the next begins.
        let angles: [f64; 3] = std::array::from_fn(|i| {
            let (before, after) = (edges[i], edges[(i + 1) % 3]);
            length(cross(before, after)).atan2(-dot(before, after)).to_degrees()
        });
        let is_flat = twice_area == 0.0;
        Self {
            sides,
            radius_ratio: if is_flat { 0.0 } else { (4.0 * twice_area * twice_area / product).min(1.0) },
            aspect_ratio: if is_flat { f64::INFINITY } else { longest * longest / twice_area * 0.75f64.sqrt() },
            min_angle: if is_flat { 0.0 } else { angles.into_iter().fold(180.0, f64::min) },
            max_angle: if is_flat { 180.0 } else { angles.into_iter().fold(0.0, f64::max) },
            area: 0.5 * twice_area,
            volume: dot(a, cross(b, c)) / 6.0,
        }
    }
}

impl Quality {
    /// Measures a mesh.
    pub fn of(mesh: &Mesh) -> Self {
        let chunks: Vec<Vec<Shape>> = mesh
            .triangles
            .par_chunks(CHUNK)
            .map(|chunk| chunk.iter().filter_map(|&t| corners(mesh, t)).map(Shape::of).collect())
            .collect();
        let all = |what: fn(&Shape) -> f64| -> Vec<f64> { chunks.par_iter().flatten_iter().map(what).collect() };
        let sum =
            |what: fn(&Shape) -> f64| -> f64 { chunks.iter().map(|chunk| chunk.iter().map(what).sum::<f64>()).sum() };
        let triangles = chunks.iter().map(Vec::len).sum();
        Self {
            triangles,
            skipped_triangles: mesh.triangles.len() - triangles,
            degenerate_triangles: chunks.iter().flatten().filter(|shape| shape.area == 0.0).count(),
            radius_ratio: Summary::of(all(|shape| shape.radius_ratio)),
            aspect_ratio: Summary::of(all(|shape| shape.aspect_ratio)),
            min_angle: Summary::of(all(|shape| shape.min_angle)),
            max_angle: Summary::of(all(|shape| shape.max_angle)),
            edge_length: Summary::of(chunks.par_iter().flatten_iter().flat_map_iter(|shape| shape.sides).collect()),
            valence: valence(mesh),
            area: sum(|shape| shape.area),
            volume: sum(|shape| shape.volume),
        }
    }

    /// Whether every triangle could be measured and none is degenerate.
    pub fn all_proper(&self) -> bool {
        self.skipped_triangles == 0 && self.degenerate_triangles == 0
    }
}

/// Offsets of a triangle's corners from the mesh's origin, if it has all of them and they are finite.
pub(super) fn corners(mesh: &Mesh, triangle: [u32; 3]) -> Option<[[f64; 3]; 3]> {
    let mut to = [[0.0; 3]; 3];
    for (to, v) in to.iter_mut().zip(triangle) {
        *to = mesh.vertices.get(v as usize)?.map(f64::from);
        if !to.iter().all(|x| x.is_finite()) {
            return None;
        }
    }
    Some(to)
}

fn valence(mesh: &Mesh) -> Vec<usize> {
    let mut at = vec![0u32; mesh.vertices.len()];
    for &v in mesh.triangles.as_flattened() {
        if let Some(count) = at.get_mut(v as usize) {
            *count += 1;
        }
    }
    let mut histogram = vec![0; VALENCE_END + 1];
    for count in at {
        histogram[(count as usize).min(VALENCE_END)] += 1;
    }
    histogram
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(vertices: &[[f32; 3]], triangles: &[[u32; 3]]) -> Quality {
        Quality::of(&Mesh { vertices: vertices.to_vec(), triangles: triangles.to_vec(), ..Mesh::default() })
    }

    fn near(a: f64, b: f64) {
        assert!((a - b).abs() <= 1e-6 * b.abs().max(1.0), "{a} is not {b}");
    }

    #[test]
    fn an_equilateral_triangle_is_perfect_and_a_right_one_is_as_computed_by_hand() {
        // In the plane x + y + z = 1.
        let quality = of(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], &[[0, 1, 2]]);
        near(quality.radius_ratio.mean, 1.0);
        near(quality.aspect_ratio.max, 1.0);
        near(quality.min_angle.min, 60.0);
        near(quality.max_angle.max, 60.0);
        near(quality.edge_length.mean, 2f64.sqrt());
        near(quality.area, 0.75f64.sqrt());
        // Sides 3, 4, 5: inscribed radius 1, circumscribed 2.5, altitude on the longest side 2.4.
        let quality = of(&[[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 4.0, 0.0]], &[[0, 1, 2]]);
        near(quality.radius_ratio.min, 0.8);
        near(quality.aspect_ratio.min, 5.0 / 2.4 * 0.75f64.sqrt());
        near(quality.min_angle.min, 0.6f64.asin().to_degrees());
        near(quality.max_angle.min, 90.0);
        near(quality.area, 6.0);
        assert_eq!((quality.edge_length.min, quality.edge_length.median, quality.edge_length.max), (3.0, 4.0, 5.0));
    }

    #[test]
    fn what_has_no_shape_is_counted_and_left_out() {
        let vertices = [[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [f32::NAN; 3]];
        let quality = of(&vertices, &[[0, 1, 3], [0, 1, 2], [0, 1, 4], [0, 1, 9]]);
        assert_eq!((quality.triangles, quality.skipped_triangles, quality.degenerate_triangles), (2, 2, 1));
        assert_eq!((quality.radius_ratio.min, quality.aspect_ratio.max), (0.0, f64::INFINITY));
        assert!(!quality.all_proper());
        assert_eq!(of(&[], &[]), Quality { valence: vec![0; VALENCE_END + 1], ..Quality::default() });
    }

    #[test]
    fn valence_counts_triangles_at_vertices() {
        let vertices = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [5.0; 3]];
        let quality = of(&vertices, &[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]);
        assert_eq!((quality.valence[3], quality.valence[0]), (4, 1));
        near(quality.volume, 1.0 / 6.0);
    }

    #[test]
    fn percentiles_are_those_of_a_sorted_list() {
        let summary = Summary::of((0..=100).rev().map(f64::from).collect());
        let Summary { min, p1, p5, median, mean, p95, p99, max } = summary;
        assert_eq!([min, p1, p5, median, mean, p95, p99, max], [0.0, 1.0, 5.0, 50.0, 50.0, 95.0, 99.0, 100.0]);
    }
}
