//! NumPy arrays out: N×3 positions in their own precision. All attributes are left out.

use std::path::Path;

use super::Particles;
use crate::columns::Points;
use crate::error::Error;
use crate::formats::npy_header::header;
use crate::meshes::WriteOptions;
use crate::output::{Output, Written};
use crate::scalar::Endian;

pub(crate) fn write(path: &Path, particles: &Particles, _options: &WriteOptions) -> Result<Written, Error> {
    let positions = Points::of_particles(particles).positions;
    let header = header(positions, 3);
    let mut out = Output::create(path, Some(header.len() as u64 + positions.bytes()))?;
    out.bytes(&header)?;
    out.array(positions, Endian::Little)?;
    out.finish()?;
    Ok(Written { left_out: super::attribute_names(particles), ..Written::default() })
}
