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
//! directions; Ericson, Real-time collision detection, 2005, section 5.1.5, for the closest point by regions.

use rayon::prelude::*;

use super::{Mesh, quality::corners};
use crate::math::vector::{add_scaled, cross, dot, length, subtract};

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
        let tree = Tree::of(reference);
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

/// A box of triangles: a leaf holds them, another node is followed by its lower half.
struct Node {
    low: [f64; 3],
    high: [f64; 3],
    /// Of a leaf: first triangle. Else the node of the upper half.
    next: u32,
    /// Triangles of a leaf, 0 for other nodes.
    len: u32,
}

/// Triangles in a tree of boxes, halved at the median of the longest side.
struct Tree {
    nodes: Vec<Node>,
    triangles: Vec<[[f64; 3]; 3]>,
}

/// Most triangles of a leaf.
const LEAF: usize = 4;

impl Tree {
    fn of(mesh: &Mesh) -> Self {
        let world = |offset| add_scaled(mesh.origin, offset, 1.0);
        let triangles = mesh.triangles.par_iter().filter_map(|&t| corners(mesh, t)).map(|t| t.map(world)).collect();
        let mut tree = Self { nodes: Vec::new(), triangles };
        let mut triangles = std::mem::take(&mut tree.triangles);
        if !triangles.is_empty() {
            tree.build(&mut triangles, 0);
        }
        tree.triangles = triangles;
        tree
    }

    fn build(&mut self, triangles: &mut [[[f64; 3]; 3]], first: usize) {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for corner in triangles.iter().flatten() {
            for a in 0..3 {
                low[a] = low[a].min(corner[a]);
                high[a] = high[a].max(corner[a]);
            }
        }
        let node = self.nodes.len();
        self.nodes.push(Node { low, high, next: first as u32, len: triangles.len() as u32 });
        if triangles.len() <= LEAF {
            return;
        }
        let side = subtract(high, low);
        let axis = (1..3).fold(0, |best, a| if side[a] > side[best] { a } else { best });
        let middle = |t: &[[f64; 3]; 3]| t[0][axis] + t[1][axis] + t[2][axis];
        let half = triangles.len() / 2;
        triangles.select_nth_unstable_by(half, |a, b| middle(a).total_cmp(&middle(b)));
        let (lower, upper) = triangles.split_at_mut(half);
        self.build(lower, first);
        (self.nodes[node].next, self.nodes[node].len) = (self.nodes.len() as u32, 0);
        self.build(upper, first + half);
    }

    /// Distance to the nearest triangle, whose number `last` becomes. Infinite without triangles.
    fn distance(&self, from: [f64; 3], last: &mut usize) -> f64 {
        let Some(triangle) = self.triangles.get(*last) else { return f64::INFINITY };
        let mut best = distance_sq(from, *triangle);
        // The tree is balanced, so its depth is at most 32 halvings of 2³² triangles.
        let mut stack = [(0u32, 0.0f64); 64];
        let mut len = 1;
        stack[0] = (0, self.box_distance_sq(0, from));
        while len > 0 {
            len -= 1;
            let (index, bound) = stack[len];
            if bound >= best {
                continue;
            }
            let node = &self.nodes[index as usize];
            if node.len > 0 {
                for i in node.next as usize..(node.next + node.len) as usize {
                    let distance = distance_sq(from, self.triangles[i]);
                    if distance < best {
                        (best, *last) = (distance, i);
                    }
                }
                continue;
            }
            let mut halves = [index + 1, node.next].map(|half| (half, self.box_distance_sq(half as usize, from)));
            if halves[0].1 < halves[1].1 {
                halves.swap(0, 1);
            }
            stack[len..len + 2].copy_from_slice(&halves);
            len += 2;
        }
        best.sqrt()
    }

    fn box_distance_sq(&self, node: usize, from: [f64; 3]) -> f64 {
        let Node { low, high, .. } = &self.nodes[node];
        (0..3).map(|a| (low[a] - from[a]).max(from[a] - high[a]).max(0.0).powi(2)).sum()
    }
}

/// Squared distance from a point to a triangle, by the region of its plane that the point is over.
fn distance_sq(p: [f64; 3], [a, b, c]: [[f64; 3]; 3]) -> f64 {
    let to = |q: [f64; 3]| {
        let d = subtract(p, q);
        dot(d, d)
    };
    let (ab, ac, ap) = (subtract(b, a), subtract(c, a), subtract(p, a));
    let normal = cross(ab, ac);
    let size = dot(normal, normal);
    if size > 0.0 {
        // Barycentric coordinates of the projection to the plane.
        let v = dot(cross(ap, ac), normal) / size;
        let w = dot(cross(ab, ap), normal) / size;
        if v >= 0.0 && w >= 0.0 && v + w <= 1.0 {
            return dot(ap, normal).powi(2) / size;
        }
    }
    let on_side = |q: [f64; 3], r: [f64; 3]| {
        let (side, from) = (subtract(r, q), subtract(p, q));
        let size = dot(side, side);
        let t = if size > 0.0 { (dot(from, side) / size).clamp(0.0, 1.0) } else { 0.0 };
        to(add_scaled(q, side, t))
    };
    on_side(a, b).min(on_side(b, c)).min(on_side(c, a))
}

#[cfg(test)]
mod tests;
