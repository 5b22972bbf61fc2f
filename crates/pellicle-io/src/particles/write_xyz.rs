//! Raw positions out: three little-endian numbers per particle and nothing else; `f64` where the extension is `.f64`, else
//! `f32`. All attributes are left out.

use std::path::Path;

use super::{Particles, PositionData};
use crate::columns::{Points, Values};
use crate::error::Error;
use crate::meshes::WriteOptions;
use crate::output::{Output, Written};
use crate::scalar::{Endian, Scalar};

pub(crate) fn write(path: &Path, particles: &Particles, _options: &WriteOptions) -> Result<Written, Error> {
    let is_double = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("f64"));
    let positions = match &particles.positions {
        PositionData::F32(p) if is_double => Values::Widened(p.as_flattened()),
        _ if is_double => Points::of_particles(particles).positions,
        _ => Points::of_particles(particles).positions.narrowed(),
    };
    let mut out = Output::create(path, Some(positions.bytes()))?;
    out.array(positions, Endian::Little)?;
    out.finish()?;
    let mut written = Written { left_out: super::attribute_names(particles), ..Written::default() };
    if matches!(particles.positions, PositionData::F64(_)) && positions.scalar() == Scalar::F32 {
        written.narrowed.push("position".into());
    }
    Ok(written)
}
