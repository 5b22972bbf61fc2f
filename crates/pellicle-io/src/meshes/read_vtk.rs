//! Legacy VTK meshes in: the polygons and triangle strips of a POLYDATA, or the plane cells of an UNSTRUCTURED_GRID.

use std::path::Path;

use pellicle::Mesh;

use super::assemble;
use super::cells::{self, Cells};
use crate::error::Error;
use crate::formats::vtk::{CellKind, Reader, Section};
use crate::particles::vtk::{read_array, read_points};
use crate::particles::{AttributeChoice, Particles, PositionData, ReadOptions};

pub(crate) fn read(path: &Path) -> Result<Mesh, Error> {
    let mut reader = Reader::open(path)?;
    if !matches!(reader.dataset(), "POLYDATA" | "UNSTRUCTURED_GRID") {
        let what =
            format!("a legacy VTK dataset {}: meshes are read from POLYDATA and UNSTRUCTURED_GRID", reader.dataset());
        return Err(reader.source().unsupported(what));
    }
    let options = ReadOptions { attributes: AttributeChoice::All, ..ReadOptions::default() };
    let mut positions: Option<PositionData> = None;
    let (mut attributes, mut names, mut cells, mut mixed) = (Vec::new(), Vec::new(), Cells::new(), Mixed::default());
    while let Some(section) = reader.next()? {
        let points = positions.as_ref().map(PositionData::len);
        let vertices = points.unwrap_or(0) as u64;
        match section {
            Section::Points { .. } if points.is_some() => {
                return Err(reader.source().fail("there are POINTS a second time"));
            }
            Section::Points { count, scalar } => positions = Some(read_points(&mut reader, count, scalar)?),
            Section::Cells(list) => {
                let kind = match list.kind {
                    CellKind::Vertices | CellKind::Lines => {
                        reader.skip_cells(list)?;
                        continue;
                    }
                    CellKind::Polygons => cells::POLYGON,
                    CellKind::Strips => cells::STRIP,
                    CellKind::Mixed => {
                        reader.read_cells(list, |_, corners| {
                            mixed.push(corners);
                            Ok(())
                        })?;
                        continue;
                    }
                };
                reader.read_cells(list, |source, corners| {
                    cells.push(kind, corners, vertices).map_err(|what| source.fail(what))
                })?;
            }
            Section::CellTypes { count } => {
                if count != mixed.ends.len() as u64 {
                    let what = format!("there are {count} CELL_TYPES for {} CELLS", mixed.ends.len());
                    return Err(reader.source().fail(what));
                }
                let mut lists = mixed.lists();
                reader.read_cell_types(count, |source, kind| {
                    let corners = lists.next().unwrap_or_default();
                    cells.push(kind, corners, vertices).map_err(|what| source.fail(what))
                })?;
            }
            Section::Array(array) => {
                attributes.extend(read_array(&mut reader, &array, points, &options, &mut names)?);
            }
        }
    }
    let Some(positions) = positions else { return Err(reader.source().fail("there are no POINTS")) };
    if let Some(what) = cells.refusal() {
        return Err(reader.source().unsupported(what));
    }
    Ok(assemble::mesh(Particles { positions, attributes }, cells.triangles))
}

/// Cells of an unstructured grid, whose types are told after them.
#[derive(Default)]
struct Mixed {
    corners: Vec<i64>,
    /// Where each cell's corners end.
    ends: Vec<usize>,
}

impl Mixed {
    fn push(&mut self, corners: &[i64]) {
        self.corners.extend_from_slice(corners);
        self.ends.push(self.corners.len());
    }

    fn lists(&self) -> impl Iterator<Item = &[i64]> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, &end)| &self.corners[start..end])
    }
}
