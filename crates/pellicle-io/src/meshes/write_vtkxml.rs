//! VTK XML out, meshes and particles as PolyData (`.vtp`) or UnstructuredGrid (`.vtu`): version 1.0, arrays appended raw,
//! little-endian, sizes of 64 bits. ParaView, VTK and meshio read it.
//!
//! ```text
//! markup with the offset of every array | _ | size u64, array | size u64, array | … | end of the markup
//! ```
//!
//! Sizes are known from the counts, so the markup is complete before the first array is written.

use std::fmt::Write as _;
use std::path::Path;

use pellicle::Mesh;

use super::{Faces, WriteOptions, one_line};
use crate::columns::{Points, Values};
use crate::error::Error;
use crate::formats::catalog::Format;
use crate::output::{Output, Written};
use crate::particles::Particles;
use crate::scalar::{Endian, Scalar};

/// Numbers of cells as `vtkCellType.h` has them.
const VERTEX: u8 = 1;
const TRIANGLE: u8 = 5;
const QUAD: u8 = 9;

/// The two kinds of file.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    PolyData,
    UnstructuredGrid,
}

/// Cells that all have the same number of corners.
struct Run<'a> {
    kind: u8,
    count: usize,
    sides: u32,
    corners: Values<'a>,
}

/// Cells, run after run.
struct Cells<'a>(Vec<Run<'a>>);

impl<'a> Cells<'a> {
    fn of_faces(Faces { mesh, quads }: Faces<'a>) -> Self {
        let mut runs = Vec::new();
        if !quads.is_empty() {
            runs.push(Run { kind: QUAD, count: quads.len(), sides: 4, corners: Values::U32(quads.as_flattened()) });
        }
        let (count, corners) = (mesh.triangles.len(), Values::U32(mesh.triangles.as_flattened()));
        runs.push(Run { kind: TRIANGLE, count, sides: 3, corners });
        Self(runs)
    }

    fn of_points(count: usize) -> Self {
        Self(vec![Run { kind: VERTEX, count, sides: 1, corners: counting(0, 1, count, count as u64) }])
    }

    fn count(&self) -> usize {
        self.0.iter().map(|run| run.count).sum()
    }

    /// Where each cell ends in the list of corners.
    fn ends(&self) -> Vec<Values<'a>> {
        let all: u64 = self.0.iter().map(|run| u64::from(run.sides) * run.count as u64).sum();
        let mut end = 0;
        let of_run = |run: &Run<'a>| {
            let first = end + u64::from(run.sides);
            end += u64::from(run.sides) * run.count as u64;
            counting(first, run.sides, run.count, all)
        };
        self.0.iter().map(of_run).collect()
    }
}

pub(crate) fn write_vtp(path: &Path, mesh: &Mesh, options: &WriteOptions) -> Result<Written, Error> {
    write_vtp_faces(path, mesh.into(), options)
}

pub(crate) fn write_vtu(path: &Path, mesh: &Mesh, options: &WriteOptions) -> Result<Written, Error> {
    write_vtu_faces(path, mesh.into(), options)
}

/// With quads, which come before the triangles.
pub(crate) fn write_vtp_faces(path: &Path, faces: Faces<'_>, options: &WriteOptions) -> Result<Written, Error> {
    write_file(path, Kind::PolyData, &Points::of_mesh(faces.mesh), &Cells::of_faces(faces), options)
}

/// The same as a grid.
pub(crate) fn write_vtu_faces(path: &Path, faces: Faces<'_>, options: &WriteOptions) -> Result<Written, Error> {
    write_file(path, Kind::UnstructuredGrid, &Points::of_mesh(faces.mesh), &Cells::of_faces(faces), options)
}

pub(crate) fn write_vtp_particles(
    path: &Path,
    particles: &Particles,
    options: &WriteOptions,
) -> Result<Written, Error> {
    let points = Points::of_particles(particles);
    write_file(path, Kind::PolyData, &points, &Cells::of_points(points.count), options)
}

pub(crate) fn write_vtu_particles(
    path: &Path,
    particles: &Particles,
    options: &WriteOptions,
) -> Result<Written, Error> {
    let points = Points::of_particles(particles);
    write_file(path, Kind::UnstructuredGrid, &points, &Cells::of_points(points.count), options)
}

/// `start`, `start + step`, …, in 64 bits where 31 are not enough for the `last` of the array.
fn counting(start: u64, step: u32, len: usize, last: u64) -> Values<'static> {
    if last <= i32::MAX as u64 {
        return Values::Count { start: start as u32, step, len };
    }
    Values::LongCount { start, step: step.into(), len }
}

/// The markup in the making, and the arrays that it announces.
struct Document<'a> {
    text: String,
    /// Each in parts of one type.
    arrays: Vec<Vec<Values<'a>>>,
    /// Bytes of all arrays with their sizes.
    appended: u64,
}

impl<'a> Document<'a> {
    fn array(&mut self, name: &str, components: usize, parts: Vec<Values<'a>>) {
        let kind = type_name(&parts, name == "connectivity");
        // Writing to a string cannot fail.
        let _ = writeln!(
            self.text,
            "<DataArray type=\"{kind}\" Name=\"{}\" NumberOfComponents=\"{components}\" format=\"appended\" offset=\"{}\"/>",
            escape(name),
            self.appended
        );
        self.appended += 8 + bytes(&parts);
        self.arrays.push(parts);
    }

    fn cells(&mut self, tag: &str, kind: Kind, cells: &Cells<'a>) {
        let _ = writeln!(self.text, "<{tag}>");
        self.array("connectivity", 1, cells.0.iter().map(|run| run.corners).collect());
        self.array("offsets", 1, cells.ends());
        if kind == Kind::UnstructuredGrid {
            self.array("types", 1, cells.0.iter().map(|run| Values::Repeated(run.kind, run.count)).collect());
        }
        let _ = writeln!(self.text, "</{tag}>");
    }
}

fn bytes(parts: &[Values<'_>]) -> u64 {
    parts.iter().map(|part| part.bytes()).sum()
}

fn write_file(
    path: &Path,
    kind: Kind,
    points: &Points<'_>,
    cells: &Cells<'_>,
    options: &WriteOptions,
) -> Result<Written, Error> {
    let document = markup(kind, points, cells, options);
    let Document { text, arrays, appended } = document;
    let end = "\n</AppendedData>\n</VTKFile>\n";
    let mut out = Output::create(path, Some(text.len() as u64 + appended + end.len() as u64))?;
    out.bytes(text.as_bytes())?;
    for parts in arrays {
        out.bytes(&bytes(&parts).to_le_bytes())?;
        for part in parts {
            out.array(part, Endian::Little)?;
        }
    }
    out.bytes(end.as_bytes())?;
    out.finish()?;
    Ok(Written::default())
}

fn markup<'a>(kind: Kind, points: &Points<'a>, cells: &Cells<'a>, options: &WriteOptions) -> Document<'a> {
    let mut document = Document { text: String::from("<?xml version=\"1.0\"?>\n"), arrays: Vec::new(), appended: 0 };
    for comment in &options.comments {
        let mut comment = one_line(comment);
        // Two dashes in a row end a comment.
        while comment.contains("--") {
            comment = comment.replace("--", "- -");
        }
        let _ = writeln!(document.text, "<!-- {comment} -->");
    }
    let (tag, format) = match kind {
        Kind::PolyData => ("PolyData", Format::Vtp),
        Kind::UnstructuredGrid => ("UnstructuredGrid", Format::Vtu),
    };
    let _ = write!(
        document.text,
        "<VTKFile type=\"{tag}\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<{tag}>\n\
         <Piece NumberOfPoints=\"{}\" ",
        points.count
    );
    let is_points = cells.0.iter().any(|run| run.kind == VERTEX);
    let (vertices, polygons) = if is_points { (cells.count(), 0) } else { (0, cells.count()) };
    let _ = match kind {
        Kind::UnstructuredGrid => writeln!(document.text, "NumberOfCells=\"{}\">", cells.count()),
        Kind::PolyData => writeln!(
            document.text,
            "NumberOfVerts=\"{vertices}\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"{polygons}\">"
        ),
    };
    let names = points.names(format, &[]);
    let is_normal = |i: usize| names[i] == "normal" && points.columns[i].components == 3;
    let normals = if (0..names.len()).any(is_normal) { " Normals=\"normal\"" } else { "" };
    let _ = writeln!(document.text, "<PointData{normals}>");
    for (column, name) in points.columns.iter().zip(&names) {
        document.array(name, column.components, vec![column.values]);
    }
    document.text.push_str("</PointData>\n<CellData/>\n<Points>\n");
    document.array("Points", 3, vec![points.positions]);
    document.text.push_str("</Points>\n");
    match kind {
        Kind::UnstructuredGrid => document.cells("Cells", kind, cells),
        Kind::PolyData if is_points => document.cells("Verts", kind, cells),
        Kind::PolyData => document.cells("Polys", kind, cells),
    }
    let _ = write!(document.text, "</Piece>\n</{tag}>\n<AppendedData encoding=\"raw\">\n_");
    document
}

/// Indices below 2^31 are the same in both types of 32 bits; the signed one is what all programs read.
fn type_name(parts: &[Values<'_>], is_index: bool) -> &'static str {
    match parts.first().map(|part| part.scalar()) {
        Some(Scalar::F64) => "Float64",
        Some(Scalar::I64) => "Int64",
        Some(Scalar::U32) if is_index && !parts.iter().all(|part| fits_i32(*part)) => "UInt32",
        Some(Scalar::I32 | Scalar::U32) => "Int32",
        Some(Scalar::U8) => "UInt8",
        _ => "Float32",
    }
}

fn fits_i32(values: Values<'_>) -> bool {
    match values {
        Values::U32(indices) => indices.iter().all(|&i| i <= i32::MAX as u32),
        _ => true,
    }
}

pub(super) fn escape(name: &str) -> String {
    let mut out = String::with_capacity(name.len());
    for c in name.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c if c.is_control() => out.push('_'),
            c => out.push(c),
        }
    }
    out
}
