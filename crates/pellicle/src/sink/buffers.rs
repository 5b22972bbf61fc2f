//! Vertex and index memory of the caller's, of any layout.
//!
//! ```text
//! vertices   ├─ stride ─┤├─ stride ─┤   bytes; each vertex has its position, normal and user data at the layout's offsets
//! indices    3 u32 a triangle
//! ```
//!
//! Nothing is ever written outside the slices, nor between the fields of a vertex. When the surface does not fit, what
//! does is written, counting goes on to the end, and the error says how much was needed. Triangles are written only if all
//! of their vertices fit, so that what is there can be drawn.

use bytemuck::NoUninit;

use super::{Part, Sink};
use crate::Error;

/// Where in the bytes of one vertex its fields are. Offsets and stride in bytes, without any alignment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Bytes from one vertex to the next.
    pub stride: usize,
    /// Where the position begins: three `f32`, an offset from [`Buffers::origin`].
    pub position: usize,
    /// Where the normal begins: three `f32`.
    pub normal: Option<usize>,
    /// Where the user's data begins, byte for byte as the type has it.
    pub data: Option<usize>,
}

impl Layout {
    /// Positions alone, packed.
    pub const POSITIONS: Self = Self { stride: 12, position: 0, normal: None, data: None };
    /// Position, then normal, packed.
    pub const POSITIONS_NORMALS: Self = Self { stride: 24, position: 0, normal: Some(12), data: None };

    /// The bytes that a field takes, one after another.
    fn fields(&self, data_size: usize) -> impl Iterator<Item = (usize, usize)> {
        [Some((self.position, 12)), self.normal.map(|at| (at, 12)), self.data.map(|at| (at, data_size))]
            .into_iter()
            .flatten()
    }

    fn check(&self, data_size: usize) -> Result<(), Error> {
        let end = self.fields(data_size).map(|(at, size)| at + size).max().unwrap_or(0);
        if end > self.stride {
            let must = "at least where the last field ends";
            return Err(Error::Parameter { name: "stride", value: self.stride as f64, must });
        }
        let overlap = |(a, fa): (usize, (usize, usize))| {
            self.fields(data_size).skip(a + 1).any(|fb| fa.0 < fb.0 + fb.1 && fb.0 < fa.0 + fa.1)
        };
        if self.fields(data_size).enumerate().any(overlap) {
            let must = "such that the fields of a vertex do not overlap";
            return Err(Error::Parameter { name: "position, normal, data", value: self.position as f64, must });
        }
        Ok(())
    }
}

/// A sink that writes to the caller's slices.
///
/// ```
/// use pellicle::realtime::{Engine, Params};
/// use pellicle::sink::{Buffers, Layout};
///
/// let mut engine = Engine::new(Params::new(3.0, 1.0))?;
/// // Position, normal, and eight bytes of the caller's own that stay as they are.
/// let layout = Layout { stride: 32, ..Layout::POSITIONS_NORMALS };
/// let (mut vertices, mut indices) = (vec![0u8; 32 * 100], vec![0u32; 3 * 200]);
/// let mut buffers = Buffers::new(layout, &mut vertices, &mut indices)?;
/// let frame = engine.update(&[[0.5f32, 0.5, 0.5]], &mut buffers)?;
/// assert_eq!((buffers.vertices_needed(), buffers.triangles_needed()), (frame.vertices, frame.triangles));
/// # Ok::<(), pellicle::Error>(())
/// ```
#[derive(Debug)]
pub struct Buffers<'a> {
    layout: Layout,
    vertices: &'a mut [u8],
    indices: &'a mut [u32],
    origin: [f64; 3],
    needed: [usize; 2],
    written: usize,
    data_size: usize,
}

impl<'a> Buffers<'a> {
    /// Buffers without user data.
    ///
    /// # Errors
    /// [`Error::Parameter`] when the fields overlap or do not fit in the stride.
    pub fn new(layout: Layout, vertices: &'a mut [u8], indices: &'a mut [u32]) -> Result<Self, Error> {
        Self::with_data::<()>(layout, vertices, indices)
    }

    /// Buffers with user data of type `V`.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn with_data<V>(layout: Layout, vertices: &'a mut [u8], indices: &'a mut [u32]) -> Result<Self, Error> {
        layout.check(size_of::<V>())?;
        let data_size = size_of::<V>();
        Ok(Self { layout, vertices, indices, origin: [0.0; 3], needed: [0; 2], written: 0, data_size })
    }

    /// World position that positions count from.
    pub fn origin(&self) -> [f64; 3] {
        self.origin
    }

    /// Vertices of the whole surface, written or not.
    pub fn vertices_needed(&self) -> usize {
        self.needed[0]
    }

    /// Triangles of the whole surface, written or not.
    pub fn triangles_needed(&self) -> usize {
        self.needed[1]
    }

    /// Triangles that were written.
    pub fn triangles_written(&self) -> usize {
        self.written
    }

    /// Vertices that the slice holds.
    pub fn vertices_available(&self) -> usize {
        // The last vertex needs no bytes behind its last field.
        let end = self.layout.fields(self.data_size).map(|(at, size)| at + size).max().unwrap_or(0);
        if self.vertices.len() < end { 0 } else { (self.vertices.len() - end) / self.layout.stride + 1 }
    }

    /// Triangles that the slice holds.
    pub fn triangles_available(&self) -> usize {
        self.indices.len() / 3
    }

    /// Writes one field of the vertices from `first` on, as many as fit.
    fn scatter<T: NoUninit>(&mut self, at: Option<usize>, first: usize, values: &[T]) {
        let Some(at) = at else { return };
        let room = self.vertices_available().saturating_sub(first);
        for (i, value) in values.iter().take(room).enumerate() {
            let at = (first + i) * self.layout.stride + at;
            self.vertices[at..at + size_of::<T>()].copy_from_slice(bytemuck::bytes_of(value));
        }
    }
}

impl<V: NoUninit> Sink<V> for Buffers<'_> {
    fn begin(&mut self, origin: [f64; 3]) {
        (self.origin, self.needed, self.written) = (origin, [0; 2], 0);
    }

    fn append(&mut self, part: Part<'_, V>) {
        self.scatter(Some(self.layout.position), part.first_vertex, part.positions);
        self.scatter(self.layout.normal, part.first_vertex, part.normals);
        if size_of::<V>() == self.data_size {
            self.scatter(self.layout.data, part.first_vertex, part.data);
        }
        let vertices = self.vertices_available();
        for triangle in part.triangles {
            let room = self.written < self.triangles_available();
            if room && triangle.iter().all(|&v| (v as usize) < vertices) {
                self.indices[3 * self.written..3 * self.written + 3].copy_from_slice(triangle);
                self.written += 1;
            }
        }
        self.needed[0] += part.positions.len();
        self.needed[1] += part.triangles.len();
    }

    fn end(&mut self) -> Result<(), Error> {
        let available = [self.vertices_available(), self.triangles_available()];
        for (what, i) in [("vertices in the buffer", 0), ("triangles in the buffer", 1)] {
            if self.needed[i] > available[i] {
                return Err(Error::Count { what, needed: self.needed[i] as u64, available: available[i] as u64 });
            }
        }
        Ok(())
    }
}
