//! Legacy VTK images: the dataset `STRUCTURED_POINTS` with arrays of points or of cells, ASCII and binary.
//!
//! The value of a cell stands for its centre. Names of arrays are found by passing over the file once.
//!
//! Source: "VTK File Formats", The VTK User's Guide.

use std::path::Path;

use super::choose::{self, Candidate};
use super::file::{Numbers, Stream, VolumeFile};
use super::grid::Grid;
use super::header::{Placement, Scaling, VolumeOptions};
use crate::error::Error;
use crate::formats::vtk::{Array, Content, Reader, Section};
use crate::scalar::Scalar;

/// The dataset that is read.
pub(crate) const DATASET: &str = "STRUCTURED_POINTS";

/// Arrays that are remembered, at most.
const MAX_ARRAYS: usize = 4096;

pub(crate) fn open(path: &Path, options: &VolumeOptions) -> Result<VolumeFile, Error> {
    options.check_frame(path, 1)?;
    let arrays = arrays(path)?;
    let candidates: Vec<Candidate> = arrays.iter().filter_map(candidate).collect();
    let chosen = choose::array(path, &candidates, &[None, None], options)?.clone();
    let mut reader = open_points(path)?;
    let array = loop {
        match next_array(&mut reader)? {
            None => return Err(reader.source().fail("the file changes while it is read")),
            Some(array) if candidate(&array).as_ref() == Some(&chosen) => break array,
            Some(array) => reader.skip_array(&array)?,
        }
    };
    let points = reader.points();
    let Some(dims) = points.dims else { return Err(reader.source().fail("there are no DIMENSIONS")) };
    let dims = match chosen.placement {
        Placement::Points => dims,
        Placement::Cells => dims.map(|n| n.saturating_sub(1)),
    };
    let count = dims.iter().try_fold(1u64, |product, &n| product.checked_mul(n));
    if count != Some(array.tuples) {
        let [x, y, z] = dims;
        let what = format!("the array '{}' has {} samples, which are not {x} × {y} × {z}", array.name, array.tuples);
        return Err(reader.source().fail(what));
    }
    let component = options.component(path, chosen.components)?;
    let (source, encoding) = reader.into_source();
    let numbers =
        Numbers { components: chosen.components, component, ..Numbers::new(encoding, Scalar::from(chosen.kind)) };
    VolumeFile::of_stream(dims, Stream { source, numbers }, |header| {
        let grid = Grid::new(points.origin.unwrap_or([0.0; 3]), points.spacing.unwrap_or([1.0; 3]));
        header.grid = if chosen.placement == Placement::Cells { grid.at_centers() } else { grid };
        header.placement = chosen.placement;
        if array.is_color_text {
            // Bytes that stand there as 0 to 1.
            header.scaling = Scaling { slope: 255.0, intercept: 0.0 };
        }
        (header.components, header.component) = (chosen.components, component);
        header.name = chosen.name;
        header.arrays = candidates;
    })
}

fn open_points(path: &Path) -> Result<Reader, Error> {
    let reader = Reader::open(path)?;
    if reader.dataset() == DATASET {
        return Ok(reader);
    }
    let what = format!("a legacy VTK dataset {}: volumes are read from {DATASET}", reader.dataset());
    Err(reader.source().unsupported(what))
}

/// The next array of points or cells.
fn next_array(reader: &mut Reader) -> Result<Option<Array>, Error> {
    match reader.next()? {
        None => Ok(None),
        Some(Section::Array(array)) => Ok(Some(array)),
        Some(_) => Err(reader.source().fail(format!("{DATASET} has neither POINTS nor CELLS"))),
    }
}

fn arrays(path: &Path) -> Result<Vec<Array>, Error> {
    let mut reader = open_points(path)?;
    let mut arrays = Vec::new();
    while let Some(array) = next_array(&mut reader)? {
        reader.skip_array(&array)?;
        arrays.push(array);
        if arrays.len() > MAX_ARRAYS {
            return Err(reader.source().fail(format!("more than {MAX_ARRAYS} arrays")));
        }
    }
    Ok(arrays)
}

/// Arrays of a FIELD before POINT_DATA belong to neither points nor cells; their number of tuples tells in the end.
fn candidate(array: &Array) -> Option<Candidate> {
    let Content::Numbers(scalar) = array.content else { return None };
    let placement = if array.is_of_points { Placement::Points } else { Placement::Cells };
    (array.components > 0).then(|| Candidate {
        name: array.name.clone(),
        kind: scalar.into(),
        components: array.components,
        placement,
    })
}
