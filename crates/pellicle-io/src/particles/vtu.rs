//! VTK XML particles: the points of an UnstructuredGrid (`.vtu`) or PolyData (`.vtp`) and their PointData.

use std::path::Path;

use super::{Particles, ReadOptions};
use crate::error::Error;
use crate::formats::vtkxml::XmlFile;

pub(crate) fn read(path: &Path, options: &ReadOptions) -> Result<Particles, Error> {
    options.single(path, "VTK XML")?;
    let file = XmlFile::open_grid(path)?;
    Ok(Particles { positions: file.positions()?, attributes: file.attributes(options)? })
}
