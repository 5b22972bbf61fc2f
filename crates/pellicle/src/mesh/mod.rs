//! Triangles at rest.
//!
//! A mesh is an `f64` origin plus `f32` offsets, so that far from the world's origin nothing collapses: the position of
//! vertex `i` is `origin + vertices[i]`. Triangles wind counter-clockwise seen from outside. Vertex indices are `u32`.

mod check;
mod distance;
mod labelled;
mod normals;
mod quality;
pub(crate) mod stars;

pub use check::Report;
pub use distance::{Comparison, Deviation};
pub use labelled::LabelMesh;
pub(crate) use normals::face_normals;
pub use quality::{Quality, Summary, VALENCE_END};

/// A values-per-vertex channel, such as a velocity.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct VertexAttribute {
    /// Name as in the particle data (`velocity`, `density`, …).
    pub name: String,
    /// Numbers per vertex: 1 for a scalar, 3 for a vector.
    pub components: usize,
    /// `components` values per vertex, vertex after vertex.
    pub values: Vec<f32>,
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

impl Mesh {
    /// World position of one vertex.
    ///
    /// # Panics
    /// If `vertex` is not below the number of vertices.
    pub fn position(&self, vertex: usize) -> [f64; 3] {
        let v = self.vertices[vertex];
        std::array::from_fn(|a| self.origin[a] + f64::from(v[a]))
    }
}
