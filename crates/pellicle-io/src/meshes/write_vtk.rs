//! Legacy VTK out: a binary POLYDATA of version 4.2, which every VTK reads; normals and attributes as POINT_DATA.

use std::io::Write;
use std::path::Path;

use pellicle::{Mesh, VertexAttribute};

use super::temporary::Temporary;
use super::{WriteOptions, one_line};
use crate::error::Error;

/// Bytes formatted between two writes.
const CHUNK: usize = 64 << 10;
/// Bytes of the title, with its line end.
const MAX_TITLE: usize = 255;

pub(crate) fn write(path: &Path, mesh: &Mesh, options: &WriteOptions) -> Result<(), Error> {
    let (vertices, triangles) = (mesh.vertices.len(), mesh.triangles.len());
    let available = 1 << 31;
    for (what, needed) in [("vertices with indices of 31 bits", vertices), ("triangles in a VTK file", 4 * triangles)] {
        if needed as u64 > available {
            return Err(Error::TooLarge { path: path.into(), what, needed: needed as u64, available });
        }
    }
    let mut out = Output { file: Temporary::create(path)?, buffer: Vec::with_capacity(CHUNK + 64) };
    out.text(&format!("# vtk DataFile Version 4.2\n{}\nBINARY\nDATASET POLYDATA\n", title(options)))?;
    write_points(&mut out, mesh)?;
    out.text(&format!("\nPOLYGONS {triangles} {}\n", 4 * triangles))?;
    for triangle in &mesh.triangles {
        out.numbers([3, triangle[0], triangle[1], triangle[2]].map(u32::to_be_bytes).as_flattened())?;
    }
    out.text(&format!("\nPOINT_DATA {vertices}\n"))?;
    if !mesh.normals.is_empty() {
        out.text("NORMALS Normals float\n")?;
        write_floats(&mut out, mesh.normals.as_flattened())?;
    }
    if !mesh.attributes.is_empty() {
        out.text(&format!("FIELD FieldData {}\n", mesh.attributes.len()))?;
    }
    for VertexAttribute { name, components, values } in &mesh.attributes {
        out.text(&format!("{} {components} {vertices} float\n", encode_name(name)))?;
        write_floats(&mut out, values)?;
    }
    out.flush()?;
    out.file.finish()
}

fn write_points(out: &mut Output, mesh: &Mesh) -> Result<(), Error> {
    let origin = mesh.origin;
    let is_double = origin != [0.0; 3];
    out.text(&format!("POINTS {} {}\n", mesh.vertices.len(), if is_double { "double" } else { "float" }))?;
    if !is_double {
        for v in &mesh.vertices {
            out.numbers(v.map(f32::to_be_bytes).as_flattened())?;
        }
        return Ok(());
    }
    for v in &mesh.vertices {
        let world = [0, 1, 2].map(|axis| origin[axis] + f64::from(v[axis]));
        out.numbers(world.map(f64::to_be_bytes).as_flattened())?;
    }
    Ok(())
}

fn write_floats(out: &mut Output, values: &[f32]) -> Result<(), Error> {
    for value in values {
        out.numbers(&value.to_be_bytes())?;
    }
    out.text("\n")
}

/// A file and the bytes on their way to it.
struct Output {
    file: Temporary,
    buffer: Vec<u8>,
}

impl Output {
    fn text(&mut self, text: &str) -> Result<(), Error> {
        self.numbers(text.as_bytes())
    }

    #[inline]
    fn numbers(&mut self, bytes: &[u8]) -> Result<(), Error> {
        if self.buffer.len() >= CHUNK {
            self.flush()?;
        }
        self.buffer.extend_from_slice(bytes);
        Ok(())
    }

    fn flush(&mut self) -> Result<(), Error> {
        self.file.file().write_all(&self.buffer).map_err(|source| self.file.fail("write", source))?;
        self.buffer.clear();
        Ok(())
    }
}

/// The comments in one line, as far as there is room for them.
fn title(options: &WriteOptions) -> String {
    let mut title = one_line(&options.comments.join("; "));
    if title.is_empty() {
        title.push_str("pellicle");
    }
    title.truncate(title.floor_char_boundary(MAX_TITLE));
    title
}

/// A name as a single word.
fn encode_name(name: &str) -> String {
    let mut out = String::with_capacity(name.len());
    for c in name.chars() {
        if c.is_ascii_whitespace() || c.is_ascii_control() || c == '%' || c == '"' {
            out.push_str(&format!("%{:02X}", c as u32));
        } else {
            out.push(c);
        }
    }
    if out.is_empty() { "unnamed".into() } else { out }
}
