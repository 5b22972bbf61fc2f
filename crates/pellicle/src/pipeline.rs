//! Each road on one screen. Road A: particles → cells → density → band (coarse samples, fill, close) → count → emit.

use std::cell::RefCell;

use rayon::prelude::*;

use crate::{
    Attribute, Band, Control, Error, Mesh, Params, Positions, Stage, Stats, VertexAttribute,
    bricks::{
        band::{self, Budget},
        store::{Source, Store},
    },
    field::{density, sph::Sph},
    fill::{
        Values,
        points::{self, Interpolate, Normals, OctetVertices},
    },
    lattice::{Lattice, OCTET},
    lookup::cells::Cells,
    march::cubes::{
        count::{Counted, Part},
        emit::{Frame, Triangles, Vertices, want_needed},
    },
    math::{bits::ones, ranges::for_each_part, simd::Unit},
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

        let source = Source { unit, field: &field, cells: &self.cells, columns: &[&self.weights], control };
        let budget = Budget { bytes: beside_particles(params.max_memory, positions.len())? };
        self.band.find(&source, lattice.step(), params.band == Band::Full, budget)?;

        control.begin(Stage::Count)?;
        self.counted.count(unit, &self.band.fine)?;
        self.cut_chunks();

        let frame = Frame { origin: self.origin(), spacing: lattice.spacing };
        Ok(Surface { from: self, unit, field, lattice, frame, params, attributes, control })
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

/// Bytes that a limit leaves beside the sorted particles and their weights.
fn beside_particles(max_memory: Option<u64>, particles: usize) -> Result<u64, Error> {
    let needed = particles as u64 * (Cells::BYTES_PER_PARTICLE + size_of::<f32>() as u64);
    let available = max_memory.unwrap_or(u64::MAX);
    available.checked_sub(needed).ok_or(Error::Memory { what: "the particles alone", needed, available })
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
    field: Sph,
    lattice: Lattice,
    frame: Frame,
    params: &'a Params,
    attributes: &'a [Attribute<'a>],
    control: &'a Control<'a>,
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
            particles: self.from.cells.len() as u64,
            bricks_filled: self.from.band.fine.len() as u64,
            blocks: if self.from.band.has_values { 1 } else { self.chunk_count() as u64 },
            bricks_crossed: self.from.counted.crossed_bricks() as u64,
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
        self.check_mesh_fits()?;
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
        let triangles = &mut mesh.triangles[..];
        for_each_part(chunks.clone(), triangles, &first_triangle, &|i, to: &mut [_]| self.triangles(i, to));

        let vertices = &mesh.vertices;
        let of = |chunk: usize| &vertices[first_vertex(chunk)..first_vertex(chunk + 1)];
        grow(&mut mesh.normals, if self.params.normals { vertices.len() } else { 0 }, [0.0; 3]);
        if self.params.normals {
            let normals = &mut mesh.normals[..];
            for_each_part(chunks.clone(), normals, &first_vertex, &|i, to: &mut [_]| self.normals(i, of(i), to));
        }
        mesh.attributes.resize_with(self.attributes.len(), VertexAttribute::default);
        for (from, to) in self.attributes.iter().zip(&mut mesh.attributes) {
            from.name.clone_into(&mut to.name);
            to.components = from.components;
            grow(&mut to.values, vertices.len() * from.components, 0.0);
            let first_value = |chunk: usize| first_vertex(chunk) * from.components;
            let work = |i: usize, to: &mut [_]| self.interpolate(i, from, of(i), to);
            for_each_part(chunks.clone(), &mut to.values[..], &first_value, &work);
        }
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

    /// Whether the whole mesh fits in what the limit leaves.
    fn check_mesh_fits(&self) -> Result<(), Error> {
        let per_vertex = 1 + usize::from(self.params.normals);
        let values: usize = self.attributes.iter().map(|a| a.components).sum();
        let mesh = self.vertex_count() * (12 * per_vertex + 4 * values) + self.triangle_count() * 12;
        let needed = self.held() + mesh as u64;
        match self.params.max_memory {
            Some(available) if needed > available => {
                Err(Error::Memory { what: "the mesh in memory (writing it in chunks needs less)", needed, available })
            }
            _ => Ok(()),
        }
    }

    /// Bytes that the counted surface holds.
    fn held(&self) -> u64 {
        let Reconstructor { cells, band, .. } = self.from;
        let values = if band.has_values { band.fine.len() * size_of::<Values>() } else { 0 };
        let particles = cells.len() as u64 * (Cells::BYTES_PER_PARTICLE + size_of::<f32>() as u64);
        particles + Store::<1>::bytes(band.fine.octet_count(), band.fine.len()) + values as u64
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
        if self.params.normals {
            chunk.normals.resize(chunk.vertices.len(), [0.0; 3]);
            self.normals(i, &chunk.vertices, &mut chunk.normals);
        }
        chunk.attributes.resize_with(self.attributes.len(), Vec::new);
        for (from, to) in self.attributes.iter().zip(&mut chunk.attributes) {
            to.resize(chunk.vertices.len() * from.components, 0.0);
            self.interpolate(i, from, &chunk.vertices, to);
        }
    }

    /// The octets of a chunk, each with where the next begins.
    fn parts(&self, chunk: usize) -> impl Iterator<Item = (Part, Part)> + '_ {
        let Reconstructor { counted, chunks, .. } = self.from;
        counted.parts[chunks[chunk]..=chunks[chunk + 1]].windows(2).map(|pair| (pair[0], pair[1]))
    }

    /// Writes the vertices of one chunk.
    fn vertices(&self, chunk: usize, to: &mut [[f32; 3]]) {
        if self.from.band.has_values {
            return self.vertices_from(&self.from.band.fine, chunk, to);
        }
        // The values did not fit; those of this chunk are computed again.
        let Reconstructor { counted, band, cells, weights, .. } = self.from;
        let mut values = Store::default();
        for (part, _) in self.parts(chunk) {
            want_needed(&band.fine, counted, part, &mut values);
        }
        let (unit, field, control) = (self.unit, &self.field, self.control);
        let source = Source { unit, field, cells, columns: &[weights], control };
        values.fill(&source, self.lattice.step(), &[self.field.iso], true, &mut Vec::new());
        self.vertices_from(&values, chunk, to);
    }

    fn vertices_from(&self, values: &Store<1>, chunk: usize, mut to: &mut [[f32; 3]]) {
        let Reconstructor { counted, band, .. } = self.from;
        for (part, next) in self.parts(chunk) {
            let own = take(&mut to, (next.first_vertex - part.first_vertex) as usize);
            let (iso, frame) = (self.field.iso, self.frame);
            self.unit.run(Vertices { store: &band.fine, values, counted, part, iso, frame, to: own });
        }
    }

    /// Writes the triangles of one chunk.
    fn triangles(&self, chunk: usize, mut to: &mut [[u32; 3]]) {
        let Reconstructor { counted, band, .. } = self.from;
        for (part, next) in self.parts(chunk) {
            let own = take(&mut to, (next.first_triangle - part.first_triangle) as usize);
            self.unit.run(Triangles { store: &band.fine, counted, part, to: own });
        }
    }

    /// Writes the normals of one chunk, whose vertices are given.
    fn normals(&self, chunk: usize, vertices: &[[f32; 3]], mut to: &mut [[f32; 3]]) {
        self.for_each_octet(chunk, vertices, |of| {
            let own = take(&mut to, of.vertices.len());
            self.unit.run(Normals { of, field: &self.field, columns: &[&self.from.weights], to: own });
        });
    }

    /// Writes one attribute of one chunk, whose vertices are given.
    fn interpolate(&self, chunk: usize, attribute: &Attribute<'_>, vertices: &[[f32; 3]], mut to: &mut [f32]) {
        self.for_each_octet(chunk, vertices, |of| {
            let own = take(&mut to, of.vertices.len() * attribute.components);
            self.unit.run(Interpolate { of, weights: &self.from.weights, attribute, to: own });
        });
    }

    /// Calls `work` with the vertices of each octet of a chunk.
    fn for_each_octet(&self, chunk: usize, mut vertices: &[[f32; 3]], mut work: impl FnMut(OctetVertices<'_>)) {
        let Reconstructor { counted, band, cells, .. } = self.from;
        POINTS.with_borrow_mut(|scratch| {
            for (part, next) in self.parts(chunk) {
                let (own, rest) = vertices.split_at((next.first_vertex - part.first_vertex) as usize);
                vertices = rest;
                let octet = &band.fine.octets[part.octet as usize];
                let mut counts = [0; 8];
                ones(octet.filled.into()).for_each(|brick| counts[brick] = counted.crossings(octet, brick).vertices());
                work(OctetVertices {
                    cells,
                    step: self.lattice.step(),
                    octet: octet.at,
                    counts,
                    origin: self.frame.origin,
                    per_unit: 1.0 / self.lattice.support,
                    vertices: own,
                    scratch,
                });
            }
        });
    }
}

thread_local! {
    /// Candidates of the octet at work; kept between octets and frames.
    static POINTS: RefCell<points::Scratch> = RefCell::default();
}

/// Cuts the first `n` elements off.
fn take<'a, T>(from: &mut &'a mut [T], n: usize) -> &'a mut [T] {
    let (first, rest) = std::mem::take(from).split_at_mut(n);
    *from = rest;
    first
}

/// Makes `v` exactly `len` long. New memory comes zeroed from the system, untouched until it is used.
fn grow<T: Clone>(v: &mut Vec<T>, len: usize, zero: T) {
    if v.capacity() < len {
        *v = vec![zero; len];
    } else {
        v.resize(len, zero);
    }
}
