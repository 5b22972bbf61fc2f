//! Binary PLY out, at the speed of memory, by any number of threads.
//!
//! All records have fixed sizes, so the place of each is known before any is written:
//!
//! ```text
//! header | vertex 0 | vertex 1 | … | [quad 0 | …] | triangle 0 | triangle 1 | …
//!          x y z [nx ny nz] [attributes]   4 a b c d    3 a b c     (u8, then 32-bit indices: 17 or 13 bytes)
//! ```
//!
//! Callers hand over ranges in any order, from several threads, each with a buffer of its own that is reused. Vertices
//! without normals and attributes lie in memory as they lie in the file and are written without a copy.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use pellicle::Mesh;
use rayon::prelude::*;

use super::temporary::Temporary;
use super::{Faces, WriteOptions};
use crate::columns::{exceeds_bytes, unit_to_byte};
use crate::error::Error;
use crate::output::Written;
use crate::positional::{reserve, write_all_at};

/// Bytes of a triangle in the file.
const TRIANGLE: usize = 13;
/// Bytes of a quad.
const QUAD: usize = 17;
/// Values of all attributes of a vertex, at most.
const MAX_COMPONENTS: usize = 1 << 16;
/// Bytes formatted between two writes: large enough that threads seldom meet at the lock of the file.
const CHUNK: usize = 1 << 20;
/// Bytes written at a time where no formatting is needed.
const DIRECT: usize = 4 << 20;

/// What a PLY file will hold; known before its first byte is written.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PlyLayout {
    /// Vertices in all.
    pub vertex_count: u64,
    /// Quads in all, before the triangles.
    pub quad_count: u64,
    /// Triangles in all.
    pub triangle_count: u64,
    /// Whether each vertex has a normal.
    pub normals: bool,
    /// Name and number of components of each attribute. `velocity` with three becomes `vx vy vz`, `color` with three or
    /// four `red green blue alpha` in bytes, any other vector `NAME_0 NAME_1 …`.
    pub attributes: Vec<(String, usize)>,
    /// Whether positions are written in double precision; everything else but colours is in single precision.
    pub double: bool,
    /// Added to every position.
    pub origin: [f64; 3],
    /// Lines for the header.
    pub comments: Vec<String>,
}

/// A PLY file that is being written. It appears under its name when [`finish`](Self::finish) is called; dropped before
/// that, nothing remains.
#[derive(Debug)]
pub struct PlyFile {
    temporary: Temporary,
    layout: PlyLayout,
    header: u64,
    /// Bytes per vertex.
    stride: usize,
    /// Bytes written after the header, to tell a file with holes.
    written: AtomicU64,
}

/// Bytes behind the header.
fn data_len(layout: &PlyLayout, stride: usize) -> u64 {
    layout.vertex_count * stride as u64 + layout.quad_count * QUAD as u64 + layout.triangle_count * TRIANGLE as u64
}

impl PlyFile {
    /// Creates the file, not yet under its name, and writes its header.
    ///
    /// # Errors
    /// [`Error::TooLarge`] if there are more vertices than indices of 32 bits can tell, [`Error::Sink`].
    pub fn create(path: &Path, layout: &PlyLayout) -> Result<PlyFile, Error> {
        let available = u64::from(u32::MAX) + 1;
        if layout.vertex_count > available {
            let needed = layout.vertex_count;
            return Err(Error::TooLarge { path: path.into(), what: "vertices with 32-bit indices", needed, available });
        }
        let components = layout.attributes.iter().fold(0usize, |sum, (_, components)| sum.saturating_add(*components));
        if components > MAX_COMPONENTS {
            let (needed, available) = (components as u64, MAX_COMPONENTS as u64);
            return Err(Error::TooLarge { path: path.into(), what: "values per vertex", needed, available });
        }
        let attributes: usize =
            layout.attributes.iter().map(|(name, components)| components * value_size(name, *components)).sum();
        let stride = (if layout.double { 24 } else { 12 }) + (if layout.normals { 12 } else { 0 }) + attributes;
        let temporary = Temporary::create(path)?;
        let header = header(layout);
        let len = header.len() as u64 + data_len(layout, stride);
        reserve(temporary.file(), len).map_err(|source| temporary.fail("reserve room", source))?;
        write_all_at(temporary.file(), header.as_bytes(), 0).map_err(|source| temporary.fail("write", source))?;
        let header = header.len() as u64;
        Ok(PlyFile { temporary, layout: layout.clone(), header, stride, written: AtomicU64::new(0) })
    }

    /// Writes the vertices from number `first` on: `positions` relative to the layout's origin, `normals` (empty if the
    /// layout has none), and for each attribute its values for these vertices. `buffer` is scratch.
    ///
    /// # Errors
    /// [`Error::Length`] if the slices do not fit together or into the layout, [`Error::Sink`].
    pub fn write_vertices(
        &self,
        first: u64,
        positions: &[[f32; 3]],
        normals: &[[f32; 3]],
        attributes: &[&[f32]],
        buffer: &mut Vec<u8>,
    ) -> Result<(), Error> {
        self.check_vertices(first, positions.len(), normals.len(), attributes)?;
        let offset = self.header + first * self.stride as u64;
        let is_plain = self.stride == 12 && self.layout.origin == [0.0; 3];
        if is_plain && cfg!(target_endian = "little") {
            for (i, part) in bytemuck::cast_slice::<_, u8>(positions).chunks(DIRECT).enumerate() {
                self.write(part, offset + (i * DIRECT) as u64)?;
            }
            return Ok(());
        }
        let per_chunk = (CHUNK / self.stride).max(1);
        buffer.resize(per_chunk.min(positions.len()) * self.stride, 0);
        for from in (0..positions.len()).step_by(per_chunk) {
            let range = from..positions.len().min(from + per_chunk);
            let bytes = &mut buffer[..range.len() * self.stride];
            self.format_positions(&positions[range.clone()], bytes);
            let mut at = if self.layout.double { 24 } else { 12 };
            if self.layout.normals {
                self.format_floats(normals[range.clone()].as_flattened(), 3, at, bytes);
                at += 12;
            }
            for ((name, components), values) in self.layout.attributes.iter().zip(attributes) {
                let values = &values[range.start * components..range.end * components];
                let size = value_size(name, *components);
                if size == 1 {
                    self.format_bytes(values, *components, at, bytes);
                } else {
                    self.format_floats(values, *components, at, bytes);
                }
                at += size * components;
            }
            self.write(bytes, offset + (from * self.stride) as u64)?;
        }
        Ok(())
    }

    /// Writes the triangles from number `first` on. `buffer` is scratch.
    ///
    /// # Errors
    /// [`Error::Length`] if they do not fit into the layout, [`Error::Sink`].
    pub fn write_triangles(&self, first: u64, triangles: &[[u32; 3]], buffer: &mut Vec<u8>) -> Result<(), Error> {
        self.check_range("the range of triangles", first, triangles.len(), self.layout.triangle_count)?;
        let quads = self.layout.quad_count * QUAD as u64;
        let start = self.header + self.layout.vertex_count * self.stride as u64 + quads;
        self.write_faces::<3, TRIANGLE>(start + first * TRIANGLE as u64, triangles, buffer)
    }

    /// Writes the quads from number `first` on. `buffer` is scratch.
    ///
    /// # Errors
    /// As [`write_triangles`](Self::write_triangles).
    pub fn write_quads(&self, first: u64, quads: &[[u32; 4]], buffer: &mut Vec<u8>) -> Result<(), Error> {
        self.check_range("the range of quads", first, quads.len(), self.layout.quad_count)?;
        let start = self.header + self.layout.vertex_count * self.stride as u64;
        self.write_faces::<4, QUAD>(start + first * QUAD as u64, quads, buffer)
    }

    /// Writes faces of `N` corners, `BYTES` each.
    fn write_faces<const N: usize, const BYTES: usize>(
        &self,
        start: u64,
        faces: &[[u32; N]],
        buffer: &mut Vec<u8>,
    ) -> Result<(), Error> {
        let per_chunk = CHUNK / BYTES;
        buffer.resize(per_chunk.min(faces.len()) * BYTES, 0);
        for (i, chunk) in faces.chunks(per_chunk).enumerate() {
            let bytes = &mut buffer[..chunk.len() * BYTES];
            for (to, corners) in bytes.chunks_exact_mut(BYTES).zip(chunk) {
                to[0] = N as u8;
                for (to, corner) in to[1..].chunks_exact_mut(4).zip(corners) {
                    to.copy_from_slice(&corner.to_le_bytes());
                }
            }
            self.write(bytes, start + (i * per_chunk * BYTES) as u64)?;
        }
        Ok(())
    }

    /// Gives the complete file its name, in place of one that is there.
    ///
    /// # Errors
    /// [`Error::Length`] if not every vertex and triangle was written, [`Error::Sink`].
    pub fn finish(self) -> Result<(), Error> {
        let expected = data_len(&self.layout, self.stride);
        let found = self.written.load(Ordering::Acquire);
        if found != expected {
            let path = self.temporary.path().into();
            return Err(Error::Length { path, what: "the data part, in bytes,".into(), found, expected });
        }
        self.temporary.finish()
    }

    fn write(&self, bytes: &[u8], offset: u64) -> Result<(), Error> {
        write_all_at(self.temporary.file(), bytes, offset).map_err(|source| self.temporary.fail("write", source))?;
        self.written.fetch_add(bytes.len() as u64, Ordering::AcqRel);
        Ok(())
    }

    fn format_positions(&self, positions: &[[f32; 3]], bytes: &mut [u8]) {
        let origin = self.layout.origin;
        if self.layout.double {
            for (to, v) in bytes.chunks_exact_mut(self.stride).zip(positions) {
                for axis in 0..3 {
                    let world = origin[axis] + f64::from(v[axis]);
                    to[8 * axis..8 * axis + 8].copy_from_slice(&world.to_le_bytes());
                }
            }
            return;
        }
        for (to, v) in bytes.chunks_exact_mut(self.stride).zip(positions) {
            for axis in 0..3 {
                let world = (origin[axis] + f64::from(v[axis])) as f32;
                to[4 * axis..4 * axis + 4].copy_from_slice(&world.to_le_bytes());
            }
        }
    }

    /// Puts `components` values at byte `at` of every record.
    fn format_floats(&self, values: &[f32], components: usize, at: usize, bytes: &mut [u8]) {
        if components == 0 {
            return;
        }
        for (to, values) in bytes.chunks_exact_mut(self.stride).zip(values.chunks_exact(components)) {
            for (to, value) in to[at..].chunks_exact_mut(4).zip(values) {
                to.copy_from_slice(&value.to_le_bytes());
            }
        }
    }

    /// The same for colours.
    fn format_bytes(&self, values: &[f32], components: usize, at: usize, bytes: &mut [u8]) {
        for (to, values) in bytes.chunks_exact_mut(self.stride).zip(values.chunks_exact(components)) {
            for (to, &value) in to[at..].iter_mut().zip(values) {
                *to = unit_to_byte(value);
            }
        }
    }

    fn check_vertices(&self, first: u64, count: usize, normals: usize, attributes: &[&[f32]]) -> Result<(), Error> {
        self.check_range("the range of vertices", first, count, self.layout.vertex_count)?;
        self.check_length("the list of normals", normals, if self.layout.normals { count } else { 0 })?;
        self.check_length("the list of attributes", attributes.len(), self.layout.attributes.len())?;
        for ((name, components), values) in self.layout.attributes.iter().zip(attributes) {
            self.check_length(name, values.len(), count * components)?;
        }
        Ok(())
    }

    fn check_length(&self, what: &str, found: usize, expected: usize) -> Result<(), Error> {
        if found == expected {
            return Ok(());
        }
        let path = self.temporary.path().into();
        Err(Error::Length { path, what: what.into(), found: found as u64, expected: expected as u64 })
    }

    fn check_range(&self, what: &str, first: u64, count: usize, available: u64) -> Result<(), Error> {
        let end = first.saturating_add(count as u64);
        if end <= available {
            return Ok(());
        }
        let path = self.temporary.path().into();
        Err(Error::Length { path, what: format!("{what}, which ends at {end},"), found: end, expected: available })
    }
}

fn header(layout: &PlyLayout) -> String {
    let mut text = String::from("ply\nformat binary_little_endian 1.0\n");
    // Writing to a string cannot fail.
    for comment in &layout.comments {
        let _ = writeln!(text, "comment {}", super::one_line(comment));
    }
    let _ = writeln!(text, "element vertex {}", layout.vertex_count);
    let position = if layout.double { "double" } else { "float" };
    let _ = writeln!(text, "property {position} x\nproperty {position} y\nproperty {position} z");
    if layout.normals {
        text.push_str("property float nx\nproperty float ny\nproperty float nz\n");
    }
    for (name, components) in &layout.attributes {
        for property in property_names(name, *components, layout.normals) {
            let kind = if value_size(name, *components) == 1 { "uchar" } else { "float" };
            let _ = writeln!(text, "property {kind} {property}");
        }
    }
    // The bytes of an index are the same; int is what most programs expect.
    let index = if layout.vertex_count > 1 << 31 { "uint" } else { "int" };
    let _ = writeln!(text, "element face {}", layout.quad_count + layout.triangle_count);
    let _ = writeln!(text, "property list uchar {index} vertex_indices\nend_header");
    text
}

/// Whether an attribute is a colour, which PLY has in bytes: that is what other programs read.
pub(crate) fn is_color(name: &str, components: usize) -> bool {
    name == "color" && matches!(components, 3 | 4)
}

/// Bytes of a number of an attribute.
fn value_size(name: &str, components: usize) -> usize {
    if is_color(name, components) { 1 } else { 4 }
}

/// The names of an attribute's components: single words, none of which is that of a coordinate.
pub(crate) fn property_names(name: &str, components: usize, has_normals: bool) -> Vec<String> {
    let word: String = name.chars().map(|c| if c.is_whitespace() || c.is_control() { '_' } else { c }).collect();
    match (word.as_str(), components) {
        ("velocity", 3) => ["vx", "vy", "vz"].map(String::from).into(),
        ("color", 3 | 4) => ["red", "green", "blue", "alpha"][..components].iter().map(|&part| part.into()).collect(),
        ("normal", 3) if !has_normals => ["nx", "ny", "nz"].map(String::from).into(),
        ("", 1) => vec!["unnamed".into()],
        ("x" | "y" | "z" | "nx" | "ny" | "nz", 1) => vec![format!("{word}_value")],
        (word, 1) => vec![word.into()],
        (word, _) => (0..components).map(|i| format!("{word}_{i}")).collect(),
    }
}

/// Writes a whole mesh.
pub(crate) fn write(path: &Path, mesh: &Mesh, options: &WriteOptions) -> Result<Written, Error> {
    write_faces(path, mesh.into(), options)
}

/// The same with quads.
pub(crate) fn write_faces(path: &Path, faces: Faces<'_>, options: &WriteOptions) -> Result<Written, Error> {
    let Faces { mesh, quads } = faces;
    let layout = PlyLayout {
        vertex_count: mesh.vertices.len() as u64,
        quad_count: quads.len() as u64,
        triangle_count: mesh.triangles.len() as u64,
        normals: !mesh.normals.is_empty(),
        attributes: mesh.attributes.iter().map(|a| (a.name.clone(), a.components)).collect(),
        double: mesh.origin != [0.0; 3],
        origin: mesh.origin,
        comments: options.comments.clone(),
    };
    let file = PlyFile::create(path, &layout)?;
    /// Records per task: some 10 tasks for a mesh of a million triangles, so that the threads end together.
    const TASK: usize = 1 << 18;
    mesh.vertices.par_chunks(TASK).enumerate().try_for_each_init(Vec::new, |buffer, (i, positions)| {
        let range = i * TASK..i * TASK + positions.len();
        let normals = if layout.normals { &mesh.normals[range.clone()] } else { &[] };
        let attributes: Vec<&[f32]> =
            mesh.attributes.iter().map(|a| &a.values[range.start * a.components..range.end * a.components]).collect();
        file.write_vertices(range.start as u64, positions, normals, &attributes, buffer)
    })?;
    quads
        .par_chunks(TASK)
        .enumerate()
        .try_for_each_init(Vec::new, |buffer, (i, quads)| file.write_quads((i * TASK) as u64, quads, buffer))?;
    mesh.triangles.par_chunks(TASK).enumerate().try_for_each_init(Vec::new, |buffer, (i, triangles)| {
        file.write_triangles((i * TASK) as u64, triangles, buffer)
    })?;
    file.finish()?;
    let lost = mesh.attributes.iter().filter(|a| is_color(&a.name, a.components) && exceeds_bytes(&a.values));
    Ok(Written { narrowed: lost.map(|a| a.name.clone()).collect(), ..Written::default() })
}
