//! Raw positions: three little-endian `f32` or `f64` per particle and nothing else.
//!
//! The bytes go straight to where the positions stay. Without a header the size is the only check. A `.xyz` that begins
//! as text is read as text.

use std::fs::File;
use std::path::Path;

use rayon::prelude::*;

use super::{Particles, PositionData, RawType, ReadOptions, text_xyz};
use crate::error::{Error, Place};
use crate::formats::detect;
use crate::positional::read_exact_at;
use crate::source;

/// Files are read in parts of this size, by all threads: large enough to hide the cost of handing out the parts.
const PART: usize = 4 << 20;

pub(crate) fn read(path: &Path, options: &ReadOptions) -> Result<Particles, Error> {
    let (file, len) = source::open(path)?;
    let fail = |what: String| Error::Format { path: path.into(), place: Place::Whole, what };
    let mut head = [0; 64];
    let head = &mut head[..len.min(64) as usize];
    read_at(path, &file, head, 0)?;
    let has_extension = |extension: &str| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension));
    // Whoever says what the numbers are is believed.
    if options.raw == RawType::Auto {
        let is_compressed =
            head.starts_with(&detect::GZIP) && path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gz"));
        if is_compressed {
            return read_compressed(path, options);
        }
        if detect::by_content(head).is_some() {
            return Err(fail(detect::mismatch("raw xyz", head)));
        }
        if detect::is_text(head) {
            if has_extension("xyz") {
                return text_xyz::read(path, options);
            }
            let what = "this is text, but .raw, .f32 and .f64 are read as raw little-endian triples: rename it to .xyz";
            return Err(Error::Unsupported { path: path.into(), what: what.into() });
        }
    }
    options.single(path, "raw xyz")?;
    options.check(path, std::iter::empty())?;
    let is_double = match options.raw {
        RawType::Auto => has_extension("f64"),
        RawType::F32 => false,
        RawType::F64 => true,
    };
    let size = if is_double { 24 } else { 12 };
    if len % size != 0 {
        return Err(fail(odd_length(len, is_double)));
    }
    let count = usize::try_from(len / size).map_err(|_| fail("too large for the memory of this machine".into()))?;
    Ok(Particles { positions: read_positions(path, &file, 0, count, is_double)?, attributes: Vec::new() })
}

fn read_compressed(path: &Path, options: &ReadOptions) -> Result<Particles, Error> {
    let mut source = source::Source::open_text(path)?;
    let bytes = source.peek(64)?;
    if detect::is_text(&bytes[..bytes.len().min(64)]) {
        return text_xyz::read(path, options);
    }
    Err(source.unsupported("raw xyz is not read compressed: decompress it first"))
}

/// Names both possibilities, as nothing but the length tells them apart.
fn odd_length(len: u64, is_double: bool) -> String {
    let (single, double) = ("f32 (12 bytes a position)", "f64 (24 bytes a position)");
    let (expected, other, size) = if is_double { (double, single, 12) } else { (single, double, 24) };
    let advice = if len.is_multiple_of(size) {
        format!(
            "it would be one of {other}: say so, or give it the extension {}",
            if is_double { ".f32" } else { ".f64" }
        )
    } else {
        format!("nor of {other}: the file is cut short or not raw xyz")
    };
    format!("{len} bytes are no whole number of positions in {expected}; {advice}")
}

/// Reads `count` little-endian triples that begin at byte `offset`; they must be known to exist.
pub(super) fn read_positions(
    path: &Path,
    file: &File,
    offset: u64,
    count: usize,
    is_double: bool,
) -> Result<PositionData, Error> {
    if is_double {
        let mut positions = vec![[0f64; 3]; count];
        read_parts(path, file, offset, bytemuck::cast_slice_mut(&mut positions))?;
        if cfg!(target_endian = "big") {
            for value in positions.as_flattened_mut() {
                *value = f64::from_bits(value.to_bits().swap_bytes());
            }
        }
        return Ok(PositionData::F64(positions));
    }
    let mut positions = vec![[0f32; 3]; count];
    read_parts(path, file, offset, bytemuck::cast_slice_mut(&mut positions))?;
    if cfg!(target_endian = "big") {
        for value in positions.as_flattened_mut() {
            *value = f32::from_bits(value.to_bits().swap_bytes());
        }
    }
    Ok(PositionData::F32(positions))
}

/// Fills `to` from byte `offset` on, by several threads where that pays.
fn read_parts(path: &Path, file: &File, offset: u64, to: &mut [u8]) -> Result<(), Error> {
    if to.len() <= PART {
        return read_at(path, file, to, offset);
    }
    to.par_chunks_mut(PART).enumerate().try_for_each(|(i, part)| read_at(path, file, part, offset + (i * PART) as u64))
}

fn read_at(path: &Path, file: &File, to: &mut [u8], offset: u64) -> Result<(), Error> {
    read_exact_at(file, to, offset).map_err(|source| Error::Read { path: path.into(), source })
}
