//! Raw positions: three little-endian `f32` per particle and nothing else.
//!
//! The bytes go straight to where the positions stay. Without a header the size is the only check.

use std::fs::File;
use std::path::Path;

use rayon::prelude::*;

use super::{Particles, PositionData, ReadOptions};
use crate::error::{Error, Place};
use crate::formats::detect;
use crate::positional::read_exact_at;
use crate::source;

/// Bytes of a position.
const SIZE: u64 = 12;
/// Files are read in parts of this size, by all threads: large enough to hide the cost of handing out the parts.
const PART: usize = 8 << 20;

pub(crate) fn read(path: &Path, options: &ReadOptions) -> Result<Particles, Error> {
    let (file, len) = source::open(path)?;
    options.check(path, std::iter::empty())?;
    let fail = |what: String| Error::Format { path: path.into(), place: Place::Whole, what };
    let mut head = [0; 64];
    let head = &mut head[..len.min(64) as usize];
    read_at(path, &file, head, 0)?;
    if detect::by_content(head).is_some() {
        return Err(fail(detect::mismatch("raw xyz", head)));
    }
    if is_text(head) {
        let what = "this is text, but .xyz and .raw are read as raw little-endian f32 triples: rename it to .csv";
        return Err(Error::Unsupported { path: path.into(), what: what.into() });
    }
    if len % SIZE != 0 {
        return Err(fail(format!(
            "{len} bytes are no whole number of positions of {SIZE} bytes: the file is cut short or not raw xyz"
        )));
    }
    let count = usize::try_from(len / SIZE).map_err(|_| fail("too large for the memory of this machine".into()))?;
    let positions = read_triples(path, &file, 0, count)?;
    Ok(Particles { positions: PositionData::F32(positions), attributes: Vec::new() })
}

/// Whether the first bytes can only be decimal numbers. Two dozen random bytes look like this once in 10^18.
fn is_text(head: &[u8]) -> bool {
    let of_number = |b: &u8| b.is_ascii_digit() || b" \t\r\n,;+-.eE".contains(b);
    head.len() >= 24 && head.iter().all(|b| of_number(b) || b.is_ascii_alphabetic() || *b == b'#')
}

/// Reads `count` little-endian triples that begin at byte `offset`; they must be known to exist.
pub(super) fn read_triples(path: &Path, file: &File, offset: u64, count: usize) -> Result<Vec<[f32; 3]>, Error> {
    let mut positions = vec![[0f32; 3]; count];
    read_parts(path, file, offset, bytemuck::cast_slice_mut(&mut positions))?;
    if cfg!(target_endian = "big") {
        for value in positions.as_flattened_mut() {
            *value = f32::from_bits(value.to_bits().swap_bytes());
        }
    }
    Ok(positions)
}

/// Fills `to` from byte `offset` on, by several threads where that pays.
pub(super) fn read_parts(path: &Path, file: &File, offset: u64, to: &mut [u8]) -> Result<(), Error> {
    if to.len() <= PART {
        return read_at(path, file, to, offset);
    }
    to.par_chunks_mut(PART).enumerate().try_for_each(|(i, part)| read_at(path, file, part, offset + (i * PART) as u64))
}

fn read_at(path: &Path, file: &File, to: &mut [u8], offset: u64) -> Result<(), Error> {
    read_exact_at(file, to, offset).map_err(|source| Error::Read { path: path.into(), source })
}
