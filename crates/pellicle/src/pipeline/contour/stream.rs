//! Volumes that come slab by slab: larger than memory, or never stored at all.

use super::{ContourParams, VertexNormals, check_memory, window::Window};
use crate::{
    Border, Control, Error, Mesh, Volume,
    field::volume::Scalar,
    march::rows::{Grid, Iso, Shape},
    math::simd::Unit,
};

/// A volume without its samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StreamShape {
    /// Nodes along each axis; slabs follow each other along the last.
    pub dims: [usize; 3],
    /// Place of node (0, 0, 0) in the world.
    pub origin: [f64; 3],
    /// Step in the world along each axis.
    pub directions: [[f64; 3]; 3],
    /// What happens at the border.
    pub border: Border,
}

/// The next vertices and triangles of a surface that comes piece by piece. All pieces in order are the mesh.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ContourPiece {
    /// Vertices of all pieces before this one.
    pub first_vertex: u64,
    /// Offsets from the volume's origin.
    pub vertices: Vec<[f32; 3]>,
    /// Normals, or none.
    pub normals: Vec<[f32; 3]>,
    /// Corners, as vertex numbers minus `first_vertex`. They may name vertices of the next piece, never of an earlier one.
    pub triangles: Vec<[u32; 3]>,
}

/// Marches a volume whose slabs are handed in one after another.
///
/// Memory is bounded by a few slabs and the piece at hand. The pieces together are, byte for byte, what [`contour`](super::contour)
/// makes of the same samples packed in memory, the first axis fastest. Normals come from the gradient, or not at all.
///
/// ```
/// use pellicle::{ContourParams, ContourStream, StreamShape};
/// let shape = StreamShape::new([10, 10, 10]);
/// let mut stream = ContourStream::<u8>::new(&shape, 0.5, &ContourParams::default())?;
/// let mut triangles = 0;
/// for z in 0..10 {
///     let slab = vec![u8::from(z > 4); 100];
///     triangles += stream.push(&slab)?.map_or(0, |piece| piece.triangles.len());
/// }
/// triangles += stream.finish()?.triangles.len();
/// assert!(triangles > 100);
/// # Ok::<(), pellicle::Error>(())
/// ```
pub struct ContourStream<T> {
    dims: [usize; 3],
    whole: Shape,
    unit: Unit,
    iso: Iso,
    normals: VertexNormals,
    /// Slabs at hand, of which the first is number `before`.
    samples: Vec<T>,
    before: usize,
    /// First slab of the lattice whose vertices are not out yet.
    next: usize,
    first_vertex: u64,
    /// Slabs of the lattice to collect before they are marched.
    batch: usize,
    max_memory: Option<u64>,
}

impl StreamShape {
    /// With the origin at (0, 0, 0), node distance 1 and a closed border.
    pub fn new(dims: [usize; 3]) -> Self {
        let directions = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        Self { dims, origin: [0.0; 3], directions, border: Border::Closed }
    }

    /// Those of a volume.
    pub fn of(volume: &Volume<'_>) -> Self {
        let (dims, origin, directions, border) = (volume.dims(), volume.origin(), volume.directions(), volume.border());
        Self { dims, origin, directions, border }
    }

    /// The lattice of the whole volume, once all is checked.
    fn whole(&self) -> Result<Shape, Error> {
        // A view of one sample, repeated: it has the same checks.
        let one = Volume::strided(&[0u8], self.dims, 0, [0; 3])?;
        let one = one.with_origin(self.origin)?.with_directions(self.directions)?.with_border(self.border);
        Ok(Grid::<u8>::new(&one, &[0]).shape)
    }
}

/// A type of samples that a stream takes: any of those of [`Samples`](crate::Samples).
#[expect(private_bounds, reason = "sealed: what the trait asks for is nobody else's business")]
pub trait StreamSample: Scalar {}

macro_rules! stream_samples {
    ($($type:ty),*) => {$(impl StreamSample for $type {})*};
}
stream_samples!(u8, i8, u16, i16, u32, i32, u64, i64, f32, f64);

/// Nodes that a batch of slabs has at least.
const BATCH_NODES: usize = 1 << 21;

impl<T: StreamSample> ContourStream<T> {
    /// Ready for the first slab.
    ///
    /// # Errors
    /// [`Error::Dims`] and [`Error::Parameter`] as for [`Volume`] and [`contour`](super::contour); normals by faces are refused.
    /// [`Error::Memory`] when the limit has no room for the slabs that must be at hand.
    pub fn new(shape: &StreamShape, iso: f64, params: &ContourParams) -> Result<Self, Error> {
        let whole = shape.whole()?;
        if params.normals == VertexNormals::Faces {
            let must = "Off or Gradient: faces of the next piece are not known yet";
            return Err(Error::Parameter { name: "normals", value: f64::NAN, must });
        }
        let iso = params.isos(&[iso])?[0];
        let batch = BATCH_NODES.div_ceil(shape.dims[0] * shape.dims[1]).max(4);
        let batch = Self::fitting(&whole, batch, params.max_memory);
        check_memory(params.max_memory, "the slabs at hand", Self::held(&whole, batch))?;
        Ok(Self {
            dims: shape.dims,
            whole,
            unit: params.unit()?,
            iso,
            normals: params.normals,
            samples: Vec::new(),
            before: 0,
            next: 0,
            first_vertex: 0,
            batch,
            max_memory: params.max_memory,
        })
    }

    /// So many slabs, or fewer where they would take more than an eighth of the limit: most of the memory is for the pieces.
    fn fitting(whole: &Shape, mut batch: usize, max_memory: Option<u64>) -> usize {
        while batch > 1 && max_memory.is_some_and(|limit| Self::held(whole, batch) > limit / 8) {
            batch = batch.div_ceil(2);
        }
        batch
    }

    /// Bytes of the slabs at hand when so many are marched, and of their signs.
    fn held(whole: &Shape, batch: usize) -> u64 {
        let slabs = whole.nodes[2].min(batch + 4);
        let nodes = [whole.nodes[0], whole.nodes[1], slabs];
        let samples = nodes.iter().map(|&n| n as u64).product::<u64>() * size_of::<T>() as u64;
        samples + Window::bytes(&Shape { nodes, ..*whole }, 1)
    }

    /// With this many slabs marched at a time, at least 1, in place of about two million nodes: less memory, smaller pieces.
    /// Fewer, where the limit of memory has no room for so many.
    pub fn with_batch(self, slabs: usize) -> Self {
        // More slabs than there are wait for no more.
        let batch = Self::fitting(&self.whole, slabs.clamp(1, self.whole.nodes[2]), self.max_memory);
        Self { batch, ..self }
    }

    /// Nodes of a slab.
    fn slab(&self) -> usize {
        self.dims[0] * self.dims[1]
    }

    /// Slabs taken so far.
    pub fn taken(&self) -> usize {
        self.before + self.samples.len() / self.slab()
    }

    /// Takes the next slab, or several at once: rows of samples, the first axis fastest. Returns a piece when enough came
    /// together for one.
    ///
    /// # Errors
    /// [`Error::Length`] when they are not whole slabs or more than there are to come, [`Error::Count`] when a piece
    /// exceeds `u32`, [`Error::Memory`] when it does not fit the limit.
    pub fn push(&mut self, slabs: &[T]) -> Result<Option<ContourPiece>, Error> {
        let left = (self.dims[2] - self.taken()) * self.slab();
        if !slabs.len().is_multiple_of(self.slab()) || slabs.len() > left {
            let what = format!("the slabs from number {} on", self.taken());
            return Err(Error::Length { what, found: slabs.len(), expected: self.slab().min(left) });
        }
        self.samples.extend_from_slice(slabs);
        // Vertices of a slab need the next one, and its gradients the one after that; numbers need the counts of the next.
        let known = self.taken() + self.whole.pad[2];
        if known < self.next + self.batch + 2 {
            return Ok(None);
        }
        self.march(known - 2, false).map(Some)
    }

    /// The last piece, once all slabs were handed in.
    ///
    /// # Errors
    /// [`Error::Length`] when slabs are missing, [`Error::Count`] and [`Error::Memory`] as for [`push`](Self::push).
    pub fn finish(mut self) -> Result<ContourPiece, Error> {
        if self.taken() != self.dims[2] {
            return Err(Error::Length {
                what: "the volume's slabs".into(),
                found: self.taken(),
                expected: self.dims[2],
            });
        }
        self.march(self.whole.nodes[2], true)
    }

    /// Everything of the lattice's slabs up to `end`.
    fn march(&mut self, end: usize, last: bool) -> Result<ContourPiece, Error> {
        let grid = Grid::window(&self.samples, self.dims, &self.whole, self.before, last);
        // The lattice's slab that the window begins with.
        let begin = self.before + self.whole.pad[2] - grid.shape.pad[2];
        let ny = grid.shape.nodes[1];
        let rows = (self.next - begin) * ny..(end - begin) * ny;
        let window = Window::new(Box::new(grid), rows, self.unit, vec![self.iso], false, &Control::default())?;
        let per_vertex = if self.normals == VertexNormals::Off { 12 } else { 24 };
        let piece = per_vertex * window.vertices(0) as u64 + 12 * window.triangles(0) as u64;
        let needed = size_of_val(&self.samples[..]) as u64 + window.held() + piece;
        check_memory(self.max_memory, "the slabs and the piece at hand", needed)?;
        let mut piece = ContourPiece {
            first_vertex: self.first_vertex,
            vertices: vec![[0.0; 3]; window.vertices(0)],
            normals: Vec::new(),
            triangles: vec![[0; 3]; window.triangles(0)],
        };
        window.emit_vertices(0, &mut piece.vertices);
        window.emit_triangles(0, &mut piece.triangles);
        if self.normals == VertexNormals::Gradient {
            piece.normals = vec![[0.0; 3]; piece.vertices.len()];
            window.emit_normals(0, &mut piece.normals);
        }
        drop(window);
        self.first_vertex += piece.vertices.len() as u64;
        self.next = end;
        // Gradients of the next slab reach back by one.
        let keep_from = (end - 1).saturating_sub(self.whole.pad[2]).max(self.before);
        let slab = self.slab();
        if !last {
            self.samples.drain(..(keep_from - self.before) * slab);
            self.before = keep_from;
        }
        Ok(piece)
    }
}

impl ContourPiece {
    /// Appends this piece to a mesh that holds all pieces before it.
    ///
    /// # Errors
    /// [`Error::Count`] when vertex numbers exceed `u32`.
    pub fn append_to(self, mesh: &mut Mesh) -> Result<(), Error> {
        let needed = self.first_vertex + self.vertices.len() as u64;
        if needed > u64::from(u32::MAX) {
            return Err(Error::Count { what: "vertices", needed, available: u32::MAX.into() });
        }
        let first = self.first_vertex as u32;
        mesh.vertices.extend(self.vertices);
        mesh.normals.extend(self.normals);
        mesh.triangles.extend(self.triangles.iter().map(|t| t.map(|v| v.wrapping_add(first))));
        Ok(())
    }
}

impl<T: StreamSample> std::fmt::Debug for ContourStream<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ContourStream").field("dims", &self.dims).field("taken", &self.taken()).finish_non_exhaustive()
    }
}
