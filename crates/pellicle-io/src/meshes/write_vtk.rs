//! Legacy VTK out, meshes and particles: a binary POLYDATA of version 4.2, which every VTK reads; normals and attributes
//! as POINT_DATA. Particles are cells of one point, so that programs show them.

use std::path::Path;

use pellicle::Mesh;

use super::{Faces, WriteOptions, one_line};
use crate::columns::{Points, Records, Values};
use crate::error::Error;
use crate::formats::catalog::Format;
use crate::output::{Output, Written};
use crate::particles::Particles;
use crate::scalar::{Endian, Scalar};

/// Bytes of the title, with its line end.
const MAX_TITLE: usize = 255;
/// Numbers in the list of cells, whose length has 31 bits.
const MAX_CELLS: u64 = 1 << 31;

pub(crate) fn write(path: &Path, mesh: &Mesh, options: &WriteOptions) -> Result<Written, Error> {
    write_faces(path, mesh.into(), options)
}

/// The same with quads, which come before the triangles.
pub(crate) fn write_faces(path: &Path, faces: Faces<'_>, options: &WriteOptions) -> Result<Written, Error> {
    let Faces { mesh, quads } = faces;
    let polygons = |corners: usize, len: usize, values| {
        (Records::new(vec![(1, Values::Count { start: corners as u32, step: 0, len }), (corners, values)]), len)
    };
    let cells = [
        polygons(4, quads.len(), Values::U32(quads.as_flattened())),
        polygons(3, mesh.triangles.len(), Values::U32(mesh.triangles.as_flattened())),
    ];
    write_points(path, &Points::of_mesh(mesh), "POLYGONS", &cells, options)
}

pub(crate) fn write_particles(path: &Path, particles: &Particles, options: &WriteOptions) -> Result<Written, Error> {
    let points = Points::of_particles(particles);
    let len = points.count;
    let one = Values::Count { start: 1, step: 0, len };
    let cells = Records::new(vec![(1, one), (1, Values::Count { start: 0, step: 1, len })]);
    write_points(path, &points, "VERTICES", &[(cells, len)], options)
}

fn write_points(
    path: &Path,
    points: &Points<'_>,
    keyword: &str,
    cells: &[(Records<'_>, usize)],
    options: &WriteOptions,
) -> Result<Written, Error> {
    let count: usize = cells.iter().map(|(_, len)| len).sum();
    let size: u64 = cells.iter().map(|(records, len)| *len as u64 * (records.stride / 4) as u64).sum();
    for (what, needed) in [("points with indices of 31 bits", points.count as u64), ("numbers in cells", size)] {
        if needed > MAX_CELLS {
            return Err(Error::TooLarge { path: path.into(), what, needed, available: MAX_CELLS });
        }
    }
    let mut out = Output::create(path, None)?;
    out.bytes(format!("# vtk DataFile Version 4.2\n{}\nBINARY\nDATASET POLYDATA\n", title(options)).as_bytes())?;
    out.bytes(format!("POINTS {} {}\n", points.count, type_name(points.positions)).as_bytes())?;
    out.array(points.positions, Endian::Big)?;
    out.bytes(format!("\n{keyword} {count} {size}\n").as_bytes())?;
    for (records, len) in cells {
        out.records(records, *len, Endian::Big)?;
    }
    out.bytes(format!("\nPOINT_DATA {}\n", points.count).as_bytes())?;
    let names = points.names(Format::Vtk, &[]);
    let (mut normals, mut fields) = (Vec::new(), Vec::new());
    for (column, name) in points.columns.iter().zip(&names) {
        let is_normal = name == "normal" && column.components == 3 && matches!(column.values, Values::F32(_));
        if is_normal { normals.push((column, name)) } else { fields.push((column, name)) }
    }
    for (column, name) in normals {
        out.bytes(format!("NORMALS {name} float\n").as_bytes())?;
        out.array(column.values, Endian::Big)?;
        out.bytes(b"\n")?;
    }
    if !fields.is_empty() {
        out.bytes(format!("FIELD FieldData {}\n", fields.len()).as_bytes())?;
    }
    for (column, name) in fields {
        let (name, components, kind) = (encode_name(name), column.components, type_name(column.values));
        out.bytes(format!("{name} {components} {} {kind}\n", points.count).as_bytes())?;
        out.array(column.values, Endian::Big)?;
        out.bytes(b"\n")?;
    }
    out.finish()?;
    Ok(Written::default())
}

fn type_name(values: Values<'_>) -> &'static str {
    match values.scalar() {
        Scalar::F64 => "double",
        Scalar::I64 => "vtktypeint64",
        Scalar::I32 => "int",
        Scalar::U32 => "unsigned_int",
        Scalar::U8 => "unsigned_char",
        _ => "float",
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
        if c.is_whitespace() || c.is_control() || c == '%' || c == '"' {
            for byte in c.to_string().bytes() {
                out.push_str(&format!("%{byte:02X}"));
            }
        } else {
            out.push(c);
        }
    }
    out
}
