//! Legacy VTK meshes in: the polygons of a POLYDATA, or the plane cells of an UNSTRUCTURED_GRID.

use std::path::Path;

use pellicle::Mesh;

use super::assemble::{self, push_polygon};
use crate::error::Error;
use crate::formats::vtk::{CellKind, Cells, Reader, Section};
use crate::particles::vtk::{read_array, read_points};
use crate::particles::{AttributeChoice, Particles, PositionData, ReadOptions};
use crate::source::Source;

pub(crate) fn read(path: &Path) -> Result<Mesh, Error> {
    let mut reader = Reader::open(path)?;
    if !matches!(reader.dataset(), "POLYDATA" | "UNSTRUCTURED_GRID") {
        let what =
            format!("a legacy VTK dataset {}: meshes are read from POLYDATA and UNSTRUCTURED_GRID", reader.dataset());
        return Err(reader.source().unsupported(what));
    }
    let options = ReadOptions { attributes: AttributeChoice::All, ..ReadOptions::default() };
    let mut positions: Option<PositionData> = None;
    let (mut attributes, mut names, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    while let Some(section) = reader.next()? {
        let points = positions.as_ref().map(PositionData::len);
        match section {
            Section::Points { .. } if points.is_some() => {
                return Err(reader.source().fail("there are POINTS a second time"));
            }
            Section::Points { count, scalar } => positions = Some(read_points(&mut reader, count, scalar)?),
            Section::Cells(cells) => read_faces(&mut reader, cells, points.unwrap_or(0) as u64, &mut triangles)?,
            Section::CellTypes { count } => reader.read_cell_types(count, check_type)?,
            Section::Array(array) => {
                attributes.extend(read_array(&mut reader, &array, points, &options, &mut names)?);
            }
        }
    }
    let Some(positions) = positions else { return Err(reader.source().fail("there are no POINTS")) };
    Ok(assemble::mesh(Particles { positions, attributes }, triangles))
}

fn read_faces(reader: &mut Reader, cells: Cells, vertices: u64, triangles: &mut Vec<[u32; 3]>) -> Result<(), Error> {
    match cells.kind {
        CellKind::Vertices | CellKind::Lines => reader.skip_cells(cells),
        CellKind::Strips => {
            let what = "the triangles are in strips, which are not read: triangulate the mesh before saving it";
            Err(reader.source().unsupported(what))
        }
        CellKind::Polygons => reader.read_cells(cells, |source, corners| {
            push_polygon(triangles, corners, vertices).map_err(|what| source.fail(what))
        }),
        // Points and lines among the cells bound no surface.
        CellKind::Mixed => reader.read_cells(cells, |source, corners| match corners.len() {
            0..3 => Ok(()),
            _ => push_polygon(triangles, corners, vertices).map_err(|what| source.fail(what)),
        }),
    }
}

/// Refuses cells that are no polygons. The numbers are those of `vtkCellType.h`.
fn check_type(source: &Source<'_>, kind: i64) -> Result<(), Error> {
    const PLANE: [i64; 8] = [0, 1, 2, 3, 4, 5, 7, 9];
    if PLANE.contains(&kind) {
        return Ok(());
    }
    Err(source
        .unsupported(format!("there are cells of type {kind}: points, lines, triangles, quads and polygons are read")))
}
