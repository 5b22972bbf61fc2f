//! A file of which nobody has said what it holds: a mesh if it has faces, particles otherwise.

use std::path::Path;

use pellicle::Mesh;

use crate::error::Error;
use crate::formats::catalog::{Format, Row};
use crate::formats::detect;
use crate::formats::ply;
use crate::formats::vtk::{CellKind, Reader, Section};
use crate::formats::vtkxml::XmlFile;
use crate::formats::vtkxml::document::Kind;
use crate::particles::{Particles, ReadOptions, read_by};
use crate::source::Source;

/// What a file holds.
#[derive(Debug, Clone, PartialEq)]
pub enum Content {
    /// Triangles.
    Mesh(Mesh),
    /// Points without faces.
    Particles(Particles),
}

/// Reads a file with faces as a mesh, and any other as particles.
///
/// Where a format holds both, the header or the list of sections tells, and the data are read once. (The cells of a VTK
/// unstructured grid in XML are known only when they are read: such a file of particles is gone through twice.) The
/// `options` choose among the attributes of a mesh, too; to ask a mesh for an array or a time step is an error.
///
/// # Errors
/// As [`read_particles`](crate::read_particles).
pub fn read_content(path: &Path, options: &ReadOptions) -> Result<Content, Error> {
    let row = detect::content(path)?;
    match (row.read_mesh, row.read_particles) {
        (Some(read), None) => filter(path, read(path)?, options).map(Content::Mesh),
        (None, Some(read)) => read_by(read, path, options).map(Content::Particles),
        (Some(read_mesh), Some(read_particles)) => match has_faces(path, row)? {
            Some(true) => filter(path, read_mesh(path)?, options).map(Content::Mesh),
            Some(false) => read_by(read_particles, path, options).map(Content::Particles),
            None => match read_mesh(path) {
                Ok(mesh) if !mesh.triangles.is_empty() => filter(path, mesh, options).map(Content::Mesh),
                // The points of a damaged surface shall not pass for particles.
                Err(error) if announces_faces(path) => Err(error),
                _ => read_by(read_particles, path, options).map(Content::Particles),
            },
        },
        (None, None) => Err(Error::Unsupported { path: path.into(), what: format!("{} is not read", row.name) }),
    }
}

/// Whether there are faces, without reading the data; `None` where that cannot be known.
fn has_faces(path: &Path, row: &Row) -> Result<Option<bool>, Error> {
    match row.format {
        Format::Ply => {
            let header = ply::read_header(&mut Source::open(path)?)?;
            let is_faces = |name: &str| matches!(name, "face" | "tristrips");
            Ok(Some(header.elements.iter().any(|element| is_faces(&element.name) && element.count > 0)))
        }
        Format::Vtk => has_faces_vtk(path).map(Some),
        Format::Vtp => has_faces_vtp(path),
        _ => Ok(None),
    }
}

/// Kinds of cells from here on are triangles, strips, polygons, pixels and quads; and solids, which the mesh reader
/// refuses by name.
const FIRST_FACE: i64 = 5;

/// Whether a VTK XML file says that there are faces, or does not get to say it although it would. Files of particles
/// without cells, or with points for cells however wrong, do not.
fn announces_faces(path: &Path) -> bool {
    let Ok(file) = XmlFile::open_grid(path) else { return false };
    let is_grid = file.document().kind == Kind::UnstructuredGrid;
    file.document().pieces.iter().any(|piece| match &piece.cells.types {
        Some(types) if is_grid => match file.indices(Some(types), piece.cells.count, "types") {
            Ok(types) => (0..types.len()).any(|i| types.get(i) >= FIRST_FACE),
            Err(_) => true,
        },
        _ => !is_grid && piece.cells.count + piece.strips.count > 0,
    })
}

/// Walks over the sections. In binary files their data are stepped over without being read.
fn has_faces_vtk(path: &Path) -> Result<bool, Error> {
    let mut reader = Reader::open(path)?;
    let mut has_faces = false;
    while let Some(section) = reader.next()? {
        match section {
            Section::Points { count, scalar } => reader.skip_points(scalar, count)?,
            Section::Cells(cells) => {
                if matches!(cells.kind, CellKind::Polygons | CellKind::Strips) && !cells.is_empty() {
                    return Ok(true);
                }
                reader.skip_cells(cells)?;
            }
            Section::CellTypes { count } => {
                reader.read_cell_types(count, |_, kind| {
                    has_faces |= kind >= FIRST_FACE;
                    Ok(())
                })?;
                return Ok(has_faces);
            }
            // Cells come before the arrays of points.
            Section::Array(array) if array.is_of_points => return Ok(false),
            Section::Array(array) => reader.skip_array(&array)?,
        }
    }
    Ok(has_faces)
}

/// Looks for the counts of polygons and strips in the beginning of the markup.
fn has_faces_vtp(path: &Path) -> Result<Option<bool>, Error> {
    let mut source = Source::open(path)?;
    let head = String::from_utf8_lossy(source.peek(64 << 10)?).into_owned();
    let Some((_, piece)) = head.split_once("<Piece") else { return Ok(None) };
    // More pieces may follow one that is empty.
    let Some((piece, _)) = piece.split_once('>') else { return Ok(None) };
    let count = |name: &str| {
        let (_, rest) = piece.split_once(name)?;
        let quoted = rest.trim_start().strip_prefix('=')?.trim_start();
        let digits = quoted.get(1..)?.split(['"', '\'']).next()?;
        digits.trim().parse::<u64>().ok()
    };
    match (count("NumberOfPolys"), count("NumberOfStrips")) {
        (Some(1..), _) | (_, Some(1..)) => Ok(Some(true)),
        _ if head.matches("<Piece").count() > 1 || count("NumberOfVerts").is_none_or(|count| count == 0) => Ok(None),
        _ => Ok(Some(false)),
    }
}

/// Leaves out the attributes that were not asked for.
fn filter(path: &Path, mut mesh: Mesh, options: &ReadOptions) -> Result<Mesh, Error> {
    if options.array.is_some() || options.frame > 0 {
        let what = "it holds one mesh: there are no arrays and time steps to choose from".into();
        return Err(Error::Unsupported { path: path.into(), what });
    }
    let normal = (!mesh.normals.is_empty()).then_some("normal");
    options.check(path, mesh.attributes.iter().map(|a| a.name.as_str()).chain(normal).map(|name| (name, name)))?;
    mesh.attributes.retain(|attribute| options.wants(&attribute.name, &attribute.name));
    Ok(mesh)
}
