//! Where triangles go: a mesh, memory of the caller's, or nowhere but into counts.
//!
//! A surface comes in parts, in order: each part's vertices follow those before it, and its triangles refer to vertices
//! by their number in the whole, which may be those of earlier parts. A sink is told where the surface begins and ends.

mod buffers;
pub(crate) mod pool;
pub(crate) mod soup;

pub use buffers::{Buffers, Layout};

use crate::{Error, Mesh};

/// Consecutive vertices and triangles of a surface.
#[derive(Debug, Clone, Copy)]
pub struct Part<'a, V = ()> {
    /// Number of the first vertex.
    pub first_vertex: usize,
    /// Number of the first triangle.
    pub first_triangle: usize,
    /// Offsets from the origin, in world units.
    pub positions: &'a [[f32; 3]],
    /// Unit normals, outward: as many as positions, or none.
    pub normals: &'a [[f32; 3]],
    /// The user's data: as many as positions, or none.
    pub data: &'a [V],
    /// Numbers of vertices, counted over the whole surface, counter-clockwise seen from outside.
    pub triangles: &'a [[u32; 3]],
}

/// Takes a surface, part by part.
pub trait Sink<V = ()> {
    /// A surface begins, whose positions count from `origin` (world units).
    fn begin(&mut self, origin: [f64; 3]);

    /// Takes the next part. What does not fit is left out, and counted.
    fn append(&mut self, part: Part<'_, V>);

    /// The surface is complete.
    ///
    /// # Errors
    /// [`Error::Count`] when it did not fit: how much was needed, how much there was.
    fn end(&mut self) -> Result<(), Error>;
}

/// Replaces the mesh, keeping its memory. The user's data is left out: see [`Shaded`].
impl<V> Sink<V> for Mesh {
    fn begin(&mut self, origin: [f64; 3]) {
        self.origin = origin;
        self.vertices.clear();
        self.normals.clear();
        self.triangles.clear();
        self.attributes.clear();
    }

    fn append(&mut self, part: Part<'_, V>) {
        self.vertices.extend_from_slice(part.positions);
        self.normals.extend_from_slice(part.normals);
        self.triangles.extend_from_slice(part.triangles);
    }

    fn end(&mut self) -> Result<(), Error> {
        Ok(())
    }
}

/// A mesh with the user's data of each vertex.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Shaded<V> {
    /// Positions, normals, triangles.
    pub mesh: Mesh,
    /// One for each vertex.
    pub data: Vec<V>,
}

impl<V: Copy> Sink<V> for Shaded<V> {
    fn begin(&mut self, origin: [f64; 3]) {
        Sink::<V>::begin(&mut self.mesh, origin);
        self.data.clear();
    }

    fn append(&mut self, part: Part<'_, V>) {
        self.mesh.append(part);
        self.data.extend_from_slice(part.data);
    }

    fn end(&mut self) -> Result<(), Error> {
        Ok(())
    }
}

/// Counts, and keeps nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CountOnly {
    /// Vertices so far.
    pub vertices: usize,
    /// Triangles so far.
    pub triangles: usize,
}

impl<V> Sink<V> for CountOnly {
    fn begin(&mut self, _: [f64; 3]) {
        *self = Self::default();
    }

    fn append(&mut self, part: Part<'_, V>) {
        self.vertices += part.positions.len();
        self.triangles += part.triangles.len();
    }

    fn end(&mut self) -> Result<(), Error> {
        Ok(())
    }
}
