//! A judge of meshes: is this one closed, oriented and 2-manifold, and what is its topology?
//!
//! It takes the indices as they are, never welds and never repairs: a mesh that is closed only after welding vertices
//! by position is reported as open. It knows nothing of how the mesh was made, so that it can judge every extractor.
//!
//! Everything about edges and fans is read from the *star* of a vertex, its corners as (next, previous) vertex pairs.
//! Stars are laid out one after another by a counting sort, so that vertices are judged in parallel without a global
//! sort or a hash map. The same mesh gives the same report, to the last bit of the measures, for any thread count.

use rayon::prelude::*;

use super::{Mesh, stars::Stars};
use crate::math::{
    union_find::join,
    vector::{cross, dot, subtract},
};

/// Triangles summed by one task. Fixed, so that sums do not depend on the number of threads.
const CHUNK: usize = 1 << 13;

/// What is known of one indexed mesh. Counts are of defects unless said otherwise: 0 is good.
///
/// When [`out_of_range_triangles`](Self::out_of_range_triangles) is not 0 there is no topology to speak of: every later
/// count and measure is 0.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Report {
    /// Vertices, used or not. Not a defect.
    pub vertices: usize,
    /// Triangles. Not a defect.
    pub triangles: usize,
    /// Vertices with a coordinate that is NaN or infinite.
    pub nan_vertices: usize,
    /// Triangles with an index that names no vertex.
    pub out_of_range_triangles: usize,
    /// Vertices that no triangle names.
    pub unused_vertices: usize,
    /// Triangles that name a vertex twice.
    pub repeated_index_triangles: usize,
    /// Directed edges along which two or more triangles run: a flipped or doubled triangle.
    pub duplicate_half_edges: usize,
    /// Directed edges along which a triangle runs and no triangle runs back: a hole, or a flipped triangle.
    pub boundary_half_edges: usize,
    /// Edges with more than two triangle sides.
    pub non_manifold_edges: usize,
    /// Vertices whose triangles form more than one fan.
    pub non_manifold_vertices: usize,
    /// Pieces connected through shared vertices, unused vertices left out. Not a defect.
    pub components: usize,
    /// Used vertices − edges + triangles. Not a defect.
    pub euler_characteristic: i64,
    /// Triangles whose area is exactly 0.
    pub zero_area_triangles: usize,
    /// Sum of the triangles' areas, in world units squared. NaN when a named vertex is.
    pub area: f64,
    /// Volume within, in world units cubed: positive when triangles wind counter-clockwise seen from outside. A sum of
    /// tetrahedra from the mesh's origin, which means something for closed meshes only. NaN when a named vertex is.
    pub signed_volume: f64,
}

impl Report {
    /// Judges a mesh.
    pub fn of(mesh: &Mesh) -> Self {
        let mut report = Self {
            vertices: mesh.vertices.len(),
            triangles: mesh.triangles.len(),
            nan_vertices: mesh.vertices.par_iter().filter(|v| !v.iter().all(|x| x.is_finite())).count(),
            out_of_range_triangles: count_out_of_range(mesh),
            ..Self::default()
        };
        if report.out_of_range_triangles > 0 {
            return report;
        }
        let tally = tally(&Stars::of(&mesh.triangles, mesh.vertices.len()));
        report.unused_vertices = tally.unused;
        report.repeated_index_triangles =
            mesh.triangles.par_iter().filter(|[a, b, c]| a == b || b == c || c == a).count();
        report.duplicate_half_edges = tally.duplicate_half_edges;
        report.boundary_half_edges = tally.boundary_half_edges;
        report.non_manifold_edges = tally.non_manifold_edges;
        report.non_manifold_vertices = tally.non_manifold_vertices;
        let used = mesh.vertices.len() - tally.unused;
        report.components = used - count_joins(mesh);
        report.euler_characteristic = used as i64 - tally.edges as i64 + mesh.triangles.len() as i64;
        let measures = Measures::of(mesh);
        report.zero_area_triangles = measures.zero_area;
        report.area = measures.area;
        report.signed_volume = measures.volume;
        report
    }

    /// Whether the mesh is a closed, consistently oriented 2-manifold. The empty mesh is. Positions play no part, so
    /// this says nothing of [`nan_vertices`](Self::nan_vertices), nor of which side is out: see
    /// [`signed_volume`](Self::signed_volume).
    pub fn closed_manifold(&self) -> bool {
        self.out_of_range_triangles == 0
            && self.repeated_index_triangles == 0
            && self.duplicate_half_edges == 0
            && self.boundary_half_edges == 0
            && self.non_manifold_edges == 0
            && self.non_manifold_vertices == 0
    }

    /// Handles of all components together: components − Euler characteristic / 2. A whole number for a closed manifold.
    pub fn genus(&self) -> f64 {
        self.components as f64 - self.euler_characteristic as f64 / 2.0
    }
}

fn count_out_of_range(mesh: &Mesh) -> usize {
    let n = mesh.vertices.len();
    mesh.triangles.par_iter().filter(|t| t.iter().any(|&v| v as usize >= n)).count()
}

/// What one star, or all stars together, say. An edge is counted at its lower vertex, a half edge at its first.
#[derive(Clone, Copy, Default)]
struct Tally {
    unused: usize,
    edges: usize,
    duplicate_half_edges: usize,
    boundary_half_edges: usize,
    non_manifold_edges: usize,
    non_manifold_vertices: usize,
}

/// Reused from star to star, so that judging a star allocates nothing once they have grown.
#[derive(Default)]
struct Scratch {
    /// (neighbour, corner, whether the half edge comes in), sorted: one run for each neighbour.
    sides: Vec<(u32, u32, bool)>,
    /// Union-find over the corners of the star.
    parent: Vec<u32>,
}

/// Judges all stars.
fn tally(stars: &Stars) -> Tally {
    let vertices = stars.len();
    (0..vertices.div_ceil(CHUNK))
        .into_par_iter()
        .map_init(Scratch::default, |scratch, chunk| {
            let range = chunk * CHUNK..vertices.min((chunk + 1) * CHUNK);
            range.fold(Tally::default(), |sum, v| sum + judge_star(v as u32, stars.corners(v), scratch))
        })
        .reduce(Tally::default, std::ops::Add::add)
}

impl std::ops::Add for Tally {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            unused: self.unused + other.unused,
            edges: self.edges + other.edges,
            duplicate_half_edges: self.duplicate_half_edges + other.duplicate_half_edges,
            boundary_half_edges: self.boundary_half_edges + other.boundary_half_edges,
            non_manifold_edges: self.non_manifold_edges + other.non_manifold_edges,
            non_manifold_vertices: self.non_manifold_vertices + other.non_manifold_vertices,
        }
    }
}

/// Judges the edges that leave `vertex`, and counts its fans.
fn judge_star(vertex: u32, corners: &[[u32; 2]], scratch: &mut Scratch) -> Tally {
    let mut tally = Tally::default();
    if corners.is_empty() {
        tally.unused = 1;
        return tally;
    }
    let Scratch { sides, parent } = scratch;
    sides.clear();
    parent.clear();
    for (corner, &[next, previous]) in corners.iter().enumerate() {
        let corner = corner as u32;
        sides.extend([(next, corner, false), (previous, corner, true)]);
        parent.push(corner);
    }
    sides.sort_unstable();
    let mut fans = corners.len();
    for edge in sides.chunk_by(|a, b| a.0 == b.0) {
        let neighbour = edge[0].0;
        let ingoing = edge.iter().filter(|side| side.2).count();
        let outgoing = edge.len() - ingoing;
        tally.duplicate_half_edges += usize::from(outgoing > 1);
        tally.boundary_half_edges += usize::from(outgoing > 0 && ingoing == 0);
        if vertex <= neighbour {
            // A half edge from a vertex to itself stands in the star twice, as outgoing and as ingoing.
            let uses = if vertex == neighbour { outgoing } else { edge.len() };
            tally.edges += 1;
            tally.non_manifold_edges += usize::from(uses > 2);
        }
        for pair in edge.windows(2) {
            fans -= usize::from(join(parent, pair[0].1, pair[1].1));
        }
    }
    tally.non_manifold_vertices = usize::from(fans > 1);
    tally
}

/// How many triangle sides join two pieces of the vertex graph that were apart. All indices must be in range.
fn count_joins(mesh: &Mesh) -> usize {
    // Indices are u32, so no triangle names a vertex past the first 2³².
    let mut parent: Vec<u32> = (0..(mesh.vertices.len() as u64).min(1 << 32)).map(|v| v as u32).collect();
    let join_sides =
        |&[a, b, c]: &[u32; 3]| usize::from(join(&mut parent, a, b)) + usize::from(join(&mut parent, b, c));
    mesh.triangles.iter().map(join_sides).sum()
}

#[derive(Clone, Copy, Default)]
struct Measures {
    zero_area: usize,
    area: f64,
    volume: f64,
}

impl Measures {
    /// Summed in f64 by fixed chunks, chunks in order. All indices must be in range.
    fn of(mesh: &Mesh) -> Self {
        let chunks: Vec<Self> = mesh.triangles.par_chunks(CHUNK).map(|chunk| Self::of_chunk(mesh, chunk)).collect();
        chunks.iter().fold(Self::default(), |sum, chunk| Self {
            zero_area: sum.zero_area + chunk.zero_area,
            area: sum.area + chunk.area,
            volume: sum.volume + chunk.volume,
        })
    }

    fn of_chunk(mesh: &Mesh, triangles: &[[u32; 3]]) -> Self {
        let mut sum = Self::default();
        for triangle in triangles {
            let [a, b, c] = triangle.map(|v| mesh.vertices[v as usize].map(f64::from));
            let normal = cross(subtract(b, a), subtract(c, a));
            let area = 0.5 * dot(normal, normal).sqrt();
            sum.zero_area += usize::from(area == 0.0);
            sum.area += area;
            sum.volume += dot(a, cross(b, c)) / 6.0;
        }
        sum
    }
}

#[cfg(test)]
mod tests;
