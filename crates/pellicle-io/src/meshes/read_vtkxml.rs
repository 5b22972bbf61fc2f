//! VTK XML meshes in: the polygons and triangle strips of a PolyData (`.vtp`), or the plane cells of an
//! UnstructuredGrid (`.vtu`). Several pieces become one mesh.

use std::path::Path;

use pellicle::Mesh;

use super::assemble;
use super::cells::{self, Cells};
use crate::error::Error;
use crate::formats::vtkxml::document::{CellArrays, Kind};
use crate::formats::vtkxml::{Indices, XmlFile};
use crate::particles::{AttributeChoice, Particles, ReadOptions};

pub(crate) fn read(path: &Path) -> Result<Mesh, Error> {
    let file = XmlFile::open_grid(path)?;
    let is_grid = file.document().kind == Kind::UnstructuredGrid;
    let (mut cells, mut first) = (Cells::new(), 0);
    // Points and lines of PolyData stand in lists of their own, which are passed over.
    for piece in &file.document().pieces {
        let points = Points { first, count: piece.count };
        add(&file, &piece.cells, (!is_grid).then_some(cells::POLYGON), points, &mut cells)?;
        if !is_grid {
            add(&file, &piece.strips, Some(cells::STRIP), points, &mut cells)?;
        }
        first = first.saturating_add(piece.count);
    }
    if let Some(what) = cells.refusal() {
        return Err(Error::Unsupported { path: path.into(), what });
    }
    let options = ReadOptions { attributes: AttributeChoice::All, ..ReadOptions::default() };
    let points = Particles { positions: file.positions()?, attributes: file.attributes(&options)? };
    Ok(assemble::mesh(points, cells.triangles))
}

/// The points of a piece among those of all pieces.
#[derive(Clone, Copy)]
struct Points {
    first: u64,
    count: u64,
}

/// Adds the cells of a piece, all of `kind` or of the kinds that the file tells.
fn add(file: &XmlFile, arrays: &CellArrays, kind: Option<i64>, points: Points, cells: &mut Cells) -> Result<(), Error> {
    if arrays.count == 0 {
        return Ok(());
    }
    let kinds = match kind {
        Some(_) => None,
        None => Some(file.indices(arrays.types.as_ref(), arrays.count, "types")?),
    };
    let kind_of = |i: usize| kind.or_else(|| kinds.as_ref().map(|kinds| kinds.get(i))).unwrap_or_default();
    let offsets = file.indices(arrays.offsets.as_ref(), arrays.count, "offsets")?;
    let last = offsets.get(offsets.len() - 1);
    let Ok(length) = u64::try_from(last) else {
        return Err(file.fail(format!("the corners of the cells end at {last}, a negative place")));
    };
    let connectivity = file.indices(arrays.connectivity.as_ref(), length, "corners")?;
    // Exact where all cells are triangles, as in most surfaces; no more than the corners, which are in memory.
    cells.triangles.reserve(triangles_at_most(&offsets, &connectivity));
    let total = points.first.saturating_add(points.count);
    let (mut corners, mut start) = (Vec::new(), 0);
    for i in 0..offsets.len() {
        let end = offsets.get(i);
        let Some(range) = usize::try_from(end).ok().filter(|end| (start..=connectivity.len()).contains(end)) else {
            return Err(file.fail(format!("cell {i} ends at corner {end}, after {start} and of {length}")));
        };
        corners.clear();
        for at in start..range {
            let corner = connectivity.get(at);
            if u64::try_from(corner).is_ok_and(|corner| corner < points.count) {
                // Beyond i64 there is no count of points that fit into memory.
                corners.push(corner.saturating_add_unsigned(points.first));
            } else {
                return Err(file.fail(format!("cell {i} refers to point {corner}, of {} in its Piece", points.count)));
            }
        }
        cells.push(kind_of(i), &corners, total).map_err(|what| file.fail(format!("cell {i}: {what}")))?;
        start = range;
    }
    Ok(())
}

/// A cell of n corners makes n − 2 triangles.
fn triangles_at_most(offsets: &Indices, connectivity: &Indices) -> usize {
    connectivity.len().saturating_sub(2 * offsets.len())
}
