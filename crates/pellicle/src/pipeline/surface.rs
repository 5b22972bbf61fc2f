//! A counted surface, and how it is written: whole, or chunk by chunk.

use std::cell::RefCell;

use rayon::prelude::*;

use super::{Reconstructor, chosen, surface_boxes::SurfaceBoxes};
use crate::{
    Attribute, Band, Control, Error, Mesh, Params, Stage, Stats, VertexAttribute,
    bricks::store::{Round, Source, Store},
    fill::{Scratch, any::AnyField, points::OctetVertices, walled::WallLattice},
    lattice::Lattice,
    lookup::cells::Cells,
    march::cubes::{
        count::Part,
        emit::{Frame, Triangles, Vertices, want_needed},
    },
    math::{bits::ones, memory::filled, ranges::for_each_part, simd::Unit},
};

/// A counted surface, ready to be written: its size is exact, its vertices and triangles do not exist yet.
pub struct Surface<'a> {
    pub(super) from: &'a Reconstructor,
    pub(super) unit: Unit,
    pub(super) field: Box<dyn AnyField>,
    pub(super) lattice: Lattice,
    pub(super) walls: Option<WallLattice>,
    pub(super) frame: Frame,
    pub(super) params: &'a Params,
    pub(super) attributes: &'a [Attribute<'a>],
    pub(super) control: &'a Control<'a>,
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
            surface_particles: self.from.surface.boxes.len() as u64,
            surface_nodes: self.from.band.marks.nodes(),
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
            (to.components, to.carry) = (from.width(), from.carry_on());
            grow(&mut to.values, vertices.len() * from.width(), 0.0);
            let first_value = |chunk: usize| first_vertex(chunk) * from.width();
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
        let values: usize = self.attributes.iter().map(Attribute::width).sum();
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
        let Reconstructor { cells, columns, band, .. } = self.from;
        let values = if band.has_values { band.fine.value_bytes() } else { 0 };
        let per_particle = Cells::BYTES_PER_PARTICLE + (columns.len() * size_of::<f32>()) as u64;
        let particles = cells.len() as u64 * per_particle;
        let surface =
            if self.params.band == Band::Paper { cells.len() as u64 * SurfaceBoxes::BYTES_PER_PARTICLE } else { 0 };
        let lattice = Store::<1>::bytes(band.fine.octet_count(), band.fine.len()) + band.marks.bytes();
        particles + surface + lattice + values
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
            to.resize(chunk.vertices.len() * from.width(), 0.0);
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
        let Reconstructor { counted, band, cells, columns, .. } = self.from;
        let mut values = Store::default();
        for (part, _) in self.parts(chunk) {
            want_needed(&band.fine, counted, part, &mut values);
        }
        let (unit, field, control) = (self.unit, &*self.field, self.control);
        let source = Source { unit, field, cells, columns: &chosen::slices(columns), control };
        let (step, thresholds) = (self.lattice.step(), &[self.field.iso()]);
        let round = Round { step, thresholds, sampling: None, proves: false, keep_values: true };
        values.fill(&source, round, &mut Vec::new());
        self.vertices_from(&values, chunk, to);
    }

    fn vertices_from(&self, values: &Store<1>, chunk: usize, mut to: &mut [[f32; 3]]) {
        let Reconstructor { counted, band, .. } = self.from;
        for (part, next) in self.parts(chunk) {
            let own = take(&mut to, (next.first_vertex - part.first_vertex) as usize);
            let (iso, frame, walls) = (self.field.iso(), self.frame, self.walls.as_ref());
            self.unit.run(Vertices { store: &band.fine, values, counted, part, iso, frame, walls, to: own });
        }
    }

    /// Writes the triangles of one chunk.
    fn triangles(&self, chunk: usize, mut to: &mut [[u32; 3]]) {
        let Reconstructor { counted, band, .. } = self.from;
        for (part, next) in self.parts(chunk) {
            let own = take(&mut to, (next.first_triangle - part.first_triangle) as usize);
            self.unit.run(Triangles { store: &band.fine, marks: &band.marks, counted, part, to: own });
        }
    }

    /// Writes the normals of one chunk, whose vertices are given.
    fn normals(&self, chunk: usize, vertices: &[[f32; 3]], mut to: &mut [[f32; 3]]) {
        let columns = chosen::slices(&self.from.columns);
        self.for_each_octet(chunk, vertices, |of| {
            let own = take(&mut to, of.vertices.len());
            let (octet, vertices) = (of.octet, of.vertices);
            self.field.normals(self.unit, of, &columns, own);
            if let Some(walls) = &self.walls {
                walls.face(octet, self.origin(), vertices, own);
            }
        });
    }

    /// Writes one attribute of one chunk, whose vertices are given.
    fn interpolate(&self, chunk: usize, attribute: &Attribute<'_>, vertices: &[[f32; 3]], mut to: &mut [f32]) {
        let columns = chosen::slices(&self.from.columns);
        self.for_each_octet(chunk, vertices, |of| {
            let own = take(&mut to, of.vertices.len() * attribute.width());
            self.field.interpolate(self.unit, of, &columns, attribute, own);
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
                    beyond: 0,
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
    static POINTS: RefCell<Scratch> = RefCell::default();
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
        *v = filled(zero, len);
    } else {
        v.resize(len, zero);
    }
}
