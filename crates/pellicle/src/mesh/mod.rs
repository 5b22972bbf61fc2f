//! Triangles at rest.
//!
//! A mesh is an `f64` origin plus `f32` offsets, so that far from the world's origin nothing collapses: the position of
//! vertex `i` is `origin + vertices[i]`. Triangles wind counter-clockwise seen from outside. Vertex indices are `u32`.

mod check;
mod distance;
mod flicker;
mod labelled;
mod normals;
mod quality;
pub(crate) mod rings;
pub(crate) mod stars;

pub use check::Report;
pub use distance::{Comparison, Deviation};
pub use flicker::Flicker;
pub use labelled::LabelMesh;
pub(crate) use normals::face_normals;
pub use quality::{Quality, Summary, VALENCE_END};

use quality::corners;
use rayon::prelude::*;

use crate::{Carry, math::vector::add_scaled};

/// A values-per-vertex channel, such as a velocity.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct VertexAttribute {
    /// Name as in the particle data (`velocity`, `density`, …).
    pub name: String,
    /// Numbers per vertex: 1 for a scalar, 3 for a vector.
    pub components: usize,
    /// `components` values per vertex, vertex after vertex.
    pub values: Vec<f32>,
    /// How a vertex that is made from others gets its value: between theirs, or the nearest one's.
    pub carry: Carry,
}

impl VertexAttribute {
    /// A channel that is interpolated.
    pub fn new(name: impl Into<String>, components: usize, values: Vec<f32>) -> Self {
        Self { name: name.into(), components, values, carry: Carry::Mean }
    }
}

/// An indexed triangle mesh.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// World position that the offsets count from. (0, 0, 0) unless the data lies far from there.
    pub origin: [f64; 3],
    /// Offsets from `origin`, one per vertex.
    pub vertices: Vec<[f32; 3]>,
    /// Unit normals, outward; one per vertex, or empty.
    pub normals: Vec<[f32; 3]>,
    /// Vertex indices, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Further values per vertex.
    pub attributes: Vec<VertexAttribute>,
}

/// A mesh of quads and triangles.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct QuadMesh {
    /// Vertices with what they carry, and the triangles that are no part of a quad.
    pub mesh: Mesh,
    /// Vertex indices, counter-clockwise seen from outside. Along the diagonal from the first corner to the third a quad may
    /// be cut into triangles.
    pub quads: Vec<[u32; 4]>,
}

impl QuadMesh {
    /// Triangles alone: those of the quads first, each cut along its diagonal from the first corner.
    pub fn triangulated(&self) -> Mesh {
        let halves = self.quads.par_iter().flat_map_iter(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
        let triangles = halves.chain(self.mesh.triangles.par_iter().copied()).collect();
        let Mesh { origin, vertices, normals, attributes, .. } = &self.mesh;
        let (vertices, normals, attributes) = (vertices.clone(), normals.clone(), attributes.clone());
        Mesh { origin: *origin, vertices, normals, triangles, attributes }
    }
}

impl Mesh {
    /// World position of one vertex.
    ///
    /// # Panics
    /// If `vertex` is not below the number of vertices.
    pub fn position(&self, vertex: usize) -> [f64; 3] {
        let v = self.vertices[vertex];
        std::array::from_fn(|a| self.origin[a] + f64::from(v[a]))
    }

    /// Bytes of its vertices, normals, attributes and triangles.
    pub fn bytes(&self) -> u64 {
        let attributes: usize = self.attributes.iter().map(|attribute| size_of_val(&attribute.values[..])).sum();
        let places = size_of_val(&self.vertices[..]) + size_of_val(&self.normals[..]);
        (places + attributes + size_of_val(&self.triangles[..])) as u64
    }

    /// The corners of all triangles in the world, but those that are not finite or name no vertex.
    pub fn world_triangles(&self) -> Vec<[[f64; 3]; 3]> {
        let world = |offset| add_scaled(self.origin, offset, 1.0);
        self.triangles.par_iter().filter_map(|&t| corners(self, t)).map(|t| t.map(world)).collect()
    }
}
