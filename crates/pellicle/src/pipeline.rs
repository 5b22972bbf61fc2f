//! Each road on one screen. Road A: particles → cells → density → band (coarse samples, fill, close) → count → emit.

use rayon::prelude::*;

use crate::{
    Attribute, Band, Control, Error, Mesh, Params, Positions, Stage, Stats,
    bricks::{
        band::{self, Budget},
        store::Source,
    },
    field::{density, sph::Sph},
    lattice::{Lattice, OCTET},
    lookup::cells::Cells,
    march::cubes::{
        count::Counted,
        emit::{Frame, Triangles, Vertices},
    },
    math::{ranges::for_each_part, simd::Unit},
};

/// Positions in, mesh out, with default parameters for particles of one radius or with [`Params`] of your own.
///
/// Runs in the current rayon pool. For a sequence of frames keep a [`Reconstructor`], which reuses its memory.
///
/// ```
/// // A drop of 5 × 5 × 5 particles, 0.1 apart.
/// let positions: Vec<[f32; 3]> =
///     (0..125).map(|i| [i % 5, i / 5 % 5, i / 25].map(|v| v as f32 * 0.1)).collect();
/// let mesh = pellicle::reconstruct(&positions, &pellicle::Params::new(0.05))?;
/// assert!(mesh.triangles.len() > 1000);
/// # Ok::<(), pellicle::Error>(())
/// ```
///
/// # Errors
/// See [`Reconstructor::extract`].
pub fn reconstruct<'a>(positions: impl Into<Positions<'a>>, params: &Params) -> Result<Mesh, Error> {
    Reconstructor::new().extract(positions.into(), &[], params, &Control::default())?.to_mesh()
}

/// Turns frames of particles into surfaces. Owns all working memory; a second frame of the same size allocates next to
/// nothing.
#[derive(Default)]
pub struct Reconstructor {
    cells: Cells,
    weights: Vec<f32>,
    band: band::Band,
    counted: Counted,
    chunks: Vec<usize>,
}

impl Reconstructor {
    /// With no memory yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Finds and counts the surface of the particles; the result writes it, whole or in chunks. Runs in the current rayon
    /// pool. No particles give an empty surface.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a parameter out of range, [`Error::NotFinite`] and [`Error::OutsideLattice`] for the first
    /// particle that cannot be placed, [`Error::Length`] for an attribute of the wrong length, [`Error::Memory`] and
    /// [`Error::Count`] when the surface would be too large, [`Error::Cancelled`].
    pub fn extract<'a>(
        &'a mut self,
        positions: Positions<'a>,
        attributes: &'a [Attribute<'a>],
        params: &'a Params,
        control: &'a Control<'a>,
    ) -> Result<Surface<'a>, Error> {
        params.check()?;
        check_attributes(attributes, positions.len())?;
        let unit = Unit::new(params.lanes).ok_or(Error::Parameter {
            name: "lanes",
            value: f64::NAN,
            must: "a vector unit that this machine has; choose Auto",
        })?;
        let lattice = Lattice { spacing: params.spacing(), support: params.support() };
        let field = Sph { iso: params.iso as f32 };

        control.begin(Stage::Sort)?;
        self.cells.build(positions, lattice)?;

        control.begin(Stage::Density)?;
        density::weights(unit, &self.cells, control, &mut self.weights);

        control.begin(Stage::Fill)?;
        let source = Source { unit, field: &field, cells: &self.cells, columns: &[&self.weights], control };
        let budget = Budget { bytes: params.max_memory.unwrap_or(u64::MAX) };
        self.band.find(&source, lattice.step(), params.band == Band::Full, budget)?;

        control.begin(Stage::Count)?;
        self.counted.count(unit, &self.band.fine)?;
        self.cut_chunks();

        let frame = Frame { origin: self.origin(), spacing: lattice.spacing };
        Ok(Surface { from: self, unit, iso: field.iso, frame, attributes, control, particles: positions.len() })
    }

    /// Cuts the octets into chunks of a few thousand vertices: enough to share among threads, few enough to stay in the
    /// second-level cache while they are written.
    fn cut_chunks(&mut self) {
        const CHUNK_VERTICES: u32 = 4096;
        self.chunks.clear();
        self.chunks.push(0);
        let parts = &self.counted.parts;
        let mut first = 0;
        for (i, part) in parts.iter().enumerate() {
            if part.first_vertex - first >= CHUNK_VERTICES || i + 1 == parts.len() {
                self.chunks.push(i);
                first = part.first_vertex;
            }
        }
        self.chunks.dedup();
    }

    /// The node that vertices count from. The world's origin, unless the surface lies so far from it that offsets in `f32`
    /// would lose more than about a thousandth of a cell; then a node near its middle.
    fn origin(&self) -> [i32; 3] {
        const NEAR: i32 = 1 << 14;
        let octets = &self.band.fine.octets;
        let parts = self.counted.parts.split_last().map_or(&[][..], |(_, parts)| parts);
        std::array::from_fn(|a| {
            let nodes = parts.iter().map(|part| i64::from(octets[part.octet as usize].at[a]) * i64::from(OCTET));
            let (low, high) = nodes.fold((i64::MAX, i64::MIN), |(low, high), n| (low.min(n), high.max(n)));
            if low > high || (low > -i64::from(NEAR) && high < i64::from(NEAR)) {
                return 0;
            }
            ((low + high) / 2).div_euclid(NEAR.into()) as i32 * NEAR
        })
    }
}

fn check_attributes(attributes: &[Attribute<'_>], particles: usize) -> Result<(), Error> {
    for attribute in attributes {
        let expected = particles * attribute.components;
        if attribute.components == 0 || attribute.values.len() != expected {
            let what = format!("attribute {} with {} components", attribute.name, attribute.components);
            return Err(Error::Length { what, found: attribute.values.len(), expected });
        }
    }
    Ok(())
}

/// A counted surface, ready to be written: its size is exact, its vertices and triangles do not exist yet.
pub struct Surface<'a> {
    from: &'a Reconstructor,
    unit: Unit,
    iso: f32,
    frame: Frame,
    attributes: &'a [Attribute<'a>],
    control: &'a Control<'a>,
    particles: usize,
}

/// A piece of a surface: consecutive vertices and consecutive triangles, and where they belong in the whole.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Chunk {
    /// Number of the first vertex.
    pub first_vertex: usize,
    /// Offsets from [`Surface::origin`].
    pub vertices: Vec<[f32; 3]>,
    /// Unit normals, outward; as many as vertices, or none.
    pub normals: Vec<[f32; 3]>,
    /// Values of each attribute asked for, vertex after vertex.
    pub attributes: Vec<Vec<f32>>,
    /// Number of the first triangle.
    pub first_triangle: usize,
    /// Vertex numbers, counted over the whole surface.
    pub triangles: Vec<[u32; 3]>,
}

impl Surface<'_> {
    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.from.counted.vertices()
    }

    /// Number of triangles.
    pub fn triangle_count(&self) -> usize {
        self.from.counted.triangles() as usize
    }

    /// World position that vertices count from.
    pub fn origin(&self) -> [f64; 3] {
        self.frame.origin.map(|n| f64::from(n) * self.frame.spacing)
    }

    /// What the work amounted to.
    pub fn stats(&self) -> Stats {
        Stats {
            particles: self.particles as u64,
            bricks_filled: self.from.band.fine.len() as u64,
            vertices: self.vertex_count() as u64,
            triangles: self.triangle_count() as u64,
        }
    }

    /// The whole surface in memory.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub fn to_mesh(&self) -> Result<Mesh, Error> {
        let mut mesh = Mesh::default();
        self.write_mesh(&mut mesh)?;
        Ok(mesh)
    }

    /// The whole surface into a mesh whose memory is reused.
    ///
    /// # Errors
    /// [`Error::Cancelled`]; the mesh is then incomplete.
    pub fn write_mesh(&self, mesh: &mut Mesh) -> Result<(), Error> {
        self.control.begin(Stage::Emit)?;
        mesh.origin = self.origin();
        grow(&mut mesh.vertices, self.vertex_count(), [0.0; 3]);
        grow(&mut mesh.triangles, self.triangle_count(), [0; 3]);
        let counted = &self.from.counted;
        let chunks = 0..self.chunk_count();
        let first = |chunk: usize| counted.parts[self.from.chunks[chunk]];
        let first_vertex = |chunk: usize| first(chunk).first_vertex as usize;
        for_each_part(chunks.clone(), &mut mesh.vertices[..], &first_vertex, &|i, to: &mut [_]| self.vertices(i, to));
        let first_triangle = |chunk: usize| first(chunk).first_triangle as usize;
        for_each_part(chunks, &mut mesh.triangles[..], &first_triangle, &|i, to: &mut [_]| self.triangles(i, to));
        self.control.check()
    }

    /// Calls `write` with every chunk of the surface, from many threads of the pool and in any order; each says where it
    /// belongs. Memory is a chunk's a thread.
    ///
    /// # Errors
    /// The first error of `write`, or [`Error::Cancelled`].
    pub fn for_each_chunk<E: Send + From<Error>>(
        &self,
        write: impl Fn(&Chunk) -> Result<(), E> + Sync,
    ) -> Result<(), E> {
        self.control.begin(Stage::Emit)?;
        (0..self.chunk_count()).into_par_iter().with_max_len(1).try_for_each_init(Chunk::default, |chunk, i| {
            self.control.check()?;
            self.fill_chunk(i, chunk);
            write(chunk)
        })
    }

    fn chunk_count(&self) -> usize {
        self.from.chunks.len() - 1
    }

    fn fill_chunk(&self, i: usize, chunk: &mut Chunk) {
        let parts = &self.from.counted.parts;
        let (first, end) = (parts[self.from.chunks[i]], parts[self.from.chunks[i + 1]]);
        chunk.first_vertex = first.first_vertex as usize;
        chunk.first_triangle = first.first_triangle as usize;
        chunk.vertices.resize((end.first_vertex - first.first_vertex) as usize, [0.0; 3]);
        chunk.triangles.resize((end.first_triangle - first.first_triangle) as usize, [0; 3]);
        self.vertices(i, &mut chunk.vertices);
        self.triangles(i, &mut chunk.triangles);
    }

    /// Writes the vertices of one chunk.
    fn vertices(&self, chunk: usize, to: &mut [[f32; 3]]) {
        let Reconstructor { counted, band, chunks, .. } = self.from;
        let parts = &counted.parts[chunks[chunk]..=chunks[chunk + 1]];
        let first = parts[0].first_vertex;
        for pair in parts.windows(2) {
            let to = &mut to[(pair[0].first_vertex - first) as usize..(pair[1].first_vertex - first) as usize];
            self.unit.run(Vertices { store: &band.fine, counted, part: pair[0], iso: self.iso, frame: self.frame, to });
        }
    }

    /// Writes the triangles of one chunk.
    fn triangles(&self, chunk: usize, to: &mut [[u32; 3]]) {
        let Reconstructor { counted, band, chunks, .. } = self.from;
        let parts = &counted.parts[chunks[chunk]..=chunks[chunk + 1]];
        let first = parts[0].first_triangle;
        for pair in parts.windows(2) {
            let to = &mut to[(pair[0].first_triangle - first) as usize..(pair[1].first_triangle - first) as usize];
            self.unit.run(Triangles { store: &band.fine, counted, part: pair[0], to });
        }
    }
}

/// Makes `v` exactly `len` long. New memory comes zeroed from the system, untouched until it is used.
fn grow<T: Clone>(v: &mut Vec<T>, len: usize, zero: T) {
    if v.capacity() < len {
        *v = vec![zero; len];
    } else {
        v.resize(len, zero);
    }
}
