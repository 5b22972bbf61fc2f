//! Files without header: numbers, x fastest, of which the caller tells all.

use std::path::Path;

use super::file::{Numbers, Stream, VolumeFile};
use super::header::{RawVolume, VolumeOptions, check_dims};
use crate::error::Error;
use crate::scalar::{Encoding, Endian, Scalar};
use crate::source::Source;

/// For a file that nothing is told of.
pub(crate) fn open_untold(path: &Path, options: &VolumeOptions) -> Result<VolumeFile, Error> {
    match &options.raw {
        Some(raw) => open(path, raw, options),
        None => Err(Error::Unsupported {
            path: path.into(),
            what: "raw numbers say nothing of themselves: tell the dimensions and the type of the samples".into(),
        }),
    }
}

pub(super) fn open(path: &Path, raw: &RawVolume, options: &VolumeOptions) -> Result<VolumeFile, Error> {
    options.refuse_array(path, "a raw file")?;
    options.check_frame(path, 1)?;
    let component = options.component(path, raw.components)?;
    let mut source = Source::open(path)?;
    source.skip(raw.skip, "the bytes before the first sample")?;
    let scalar = Scalar::from(raw.kind);
    let dims = check_dims(&source, raw.dims)?;
    let needed = dims.iter().map(|&n| n as u128).product::<u128>() * (scalar.size() * raw.components) as u128;
    if needed != u128::from(source.remaining()) {
        let [x, y, z] = dims;
        let what = format!(
            "{x} × {y} × {z} samples of {} bytes are {needed} bytes, the file has {} after the first {}: correct the \
             dimensions, the type, or the number of bytes to skip",
            scalar.size() * raw.components,
            source.remaining(),
            raw.skip
        );
        return Err(source.fail(what));
    }
    let endian = if raw.big_endian { Endian::Big } else { Endian::Little };
    let numbers = Numbers { components: raw.components, component, ..Numbers::new(Encoding::Binary(endian), scalar) };
    VolumeFile::of_stream(raw.dims, Stream { source, numbers }, |header| {
        (header.components, header.component) = (raw.components, component);
    })
}
