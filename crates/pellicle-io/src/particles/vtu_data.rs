//! The data of a VTK XML file: text, base64, raw bytes and zlib blocks, each as a stream of numbers.
//!
//! Binary data begin with sizes: of the data in bytes; or, compressed, the number of blocks, the size of a block, the
//! size of the last one if it is shorter, and the compressed size of each. Sizes and data may be padded separately in
//! base64, so padding is accepted within.

use std::io::{self, Read};
use std::path::Path;

use flate2::read::ZlibDecoder;

use super::vtu_markup::{DataArray, Document, Location};
use crate::error::{Error, Place};
use crate::scalar::{Encoding, integer};
use crate::source::{MAX_INFLATION, Source};

/// Compressed blocks of one array, at most; VTK makes one of every 32 KiB.
const MAX_BLOCKS: u64 = 1 << 32;

/// Opens an array's data; `size` is what they must hold, in bytes.
pub(super) fn open<'a>(
    path: &Path,
    bytes: &'a [u8],
    document: &Document,
    array: &DataArray,
    size: u64,
) -> Result<(Source<'a>, Encoding), Error> {
    let (start, is_base64, part) = match &array.location {
        Location::Text(range) => {
            let part = bytes.get(range.clone()).unwrap_or_default();
            let source = Source::part(path, part, range.start as u64, part.len() as u64, false);
            return Ok((source, Encoding::Ascii));
        }
        Location::Base64(range) => {
            let blank =
                bytes.get(range.clone()).unwrap_or_default().iter().take_while(|b| b.is_ascii_whitespace()).count();
            (range.start + blank, true, bytes.get(range.start + blank..range.end).unwrap_or_default())
        }
        Location::Appended(offset) => appended(path, bytes, document, array, *offset)?,
    };
    let available = if is_base64 { part.len() as u64 / 4 * 3 + 3 } else { part.len() as u64 };
    let stream: Box<dyn Read + 'a> = if is_base64 { Box::new(Base64::new(part)) } else { Box::new(part) };
    let sizes = Sizes { path, start: start as u64, name: &array.name, document, stream };
    let source = if document.is_compressed { sizes.compressed(available)? } else { sizes.plain(available, size)? };
    Ok((source, Encoding::Binary(document.endian)))
}

/// The appended data from an array's offset on: where, whether in base64, the bytes.
fn appended<'a>(
    path: &Path,
    bytes: &'a [u8],
    document: &Document,
    array: &DataArray,
    offset: u64,
) -> Result<(usize, bool, &'a [u8]), Error> {
    let found = document.appended.and_then(|appended| {
        let start = appended.start.checked_add(usize::try_from(offset).ok()?)?;
        Some((start, appended.is_base64, bytes.get(start..)?))
    });
    found.ok_or_else(|| {
        let what =
            format!("the data of the array '{}' lie beyond the end of the file: it seems to be cut short", array.name);
        Error::Format { path: path.into(), place: Place::Byte(bytes.len() as u64), what }
    })
}

/// The sizes that stand before an array's data.
struct Sizes<'a, 'b> {
    path: &'b Path,
    start: u64,
    name: &'b str,
    document: &'b Document,
    stream: Box<dyn Read + 'a>,
}

impl<'a> Sizes<'a, '_> {
    fn fail(&self, what: String) -> Error {
        Error::Format { path: self.path.into(), place: Place::Byte(self.start), what }
    }

    fn next(&mut self) -> Result<u64, Error> {
        let mut bytes = [0; 8];
        let size = self.document.header.size();
        self.stream.read_exact(&mut bytes[..size]).map_err(|error| {
            self.fail(format!("the sizes before the array '{}' are damaged or cut short ({error})", self.name))
        })?;
        Ok(integer(&bytes[..size], self.document.header, self.document.endian).unsigned_abs())
    }

    fn plain(mut self, available: u64, size: u64) -> Result<Source<'a>, Error> {
        let found = self.next()?;
        if found != size {
            return Err(self.fail(format!("the array '{}' has {found} bytes, {size} were expected", self.name)));
        }
        let header = self.document.header.size() as u64;
        Ok(Source::part(self.path, self.stream, self.start, available.saturating_sub(header), false))
    }

    fn compressed(mut self, available: u64) -> Result<Source<'a>, Error> {
        let blocks = self.next()?;
        // The sizes of blocks before compression tell nothing that their number and content do not.
        self.next()?;
        self.next()?;
        if blocks > MAX_BLOCKS || blocks.saturating_mul(self.document.header.size() as u64) > available {
            return Err(self.fail(format!("the array '{}' announces {blocks} compressed blocks: too many", self.name)));
        }
        let mut sizes = Vec::with_capacity(blocks as usize);
        for _ in 0..blocks {
            sizes.push(self.next()?);
        }
        let limit = available.saturating_mul(MAX_INFLATION);
        let blocks = Blocks { sizes: sizes.into_iter(), state: State::Between(self.stream) };
        Ok(Source::part(self.path, blocks, self.start, limit, true))
    }
}

/// Blocks compressed one by one, inflated one after the other.
struct Blocks<'a> {
    sizes: std::vec::IntoIter<u64>,
    state: State<'a>,
}

type Stream<'a> = Box<dyn Read + 'a>;

enum State<'a> {
    Between(Stream<'a>),
    Within(Box<ZlibDecoder<io::Take<Stream<'a>>>>),
    Over,
}

impl Read for Blocks<'_> {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        loop {
            match std::mem::replace(&mut self.state, State::Over) {
                State::Over => return Ok(0),
                State::Between(stream) => {
                    let Some(size) = self.sizes.next() else { return Ok(0) };
                    self.state = State::Within(Box::new(ZlibDecoder::new(stream.take(size))));
                }
                State::Within(mut decoder) => {
                    let count = decoder.read(to)?;
                    if count > 0 || to.is_empty() {
                        self.state = State::Within(decoder);
                        return Ok(count);
                    }
                    let mut rest = decoder.into_inner();
                    io::copy(&mut rest, &mut io::sink())?;
                    self.state = State::Between(rest.into_inner());
                }
            }
        }
    }
}

/// Decodes base64; stops at the first byte that cannot belong to it, such as the `<` of the end tag.
struct Base64<'a> {
    text: &'a [u8],
    /// Decoded bytes that were not asked for yet, last first.
    left: [u8; 3],
    left_len: usize,
}

/// The value of each character; 64 marks padding, 255 all that is not base64.
const VALUES: [u8; 256] = {
    let mut values = [255; 256];
    let alphabet = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut i = 0;
    while i < 64 {
        values[alphabet[i] as usize] = i as u8;
        i += 1;
    }
    values[b'=' as usize] = 64;
    values
};

impl<'a> Base64<'a> {
    fn new(text: &'a [u8]) -> Self {
        Base64 { text, left: [0; 3], left_len: 0 }
    }

    /// Decodes the next four characters to up to three bytes; 0 at the end.
    fn quantum(&mut self) -> io::Result<([u8; 3], usize)> {
        let (mut values, mut count) = ([0u8; 4], 0);
        let mut used = 0;
        for &byte in self.text {
            let value = VALUES[usize::from(byte)];
            if value == 255 && !byte.is_ascii_whitespace() {
                break;
            }
            used += 1;
            if value != 255 {
                values[count] = value;
                count += 1;
                if count == 4 {
                    break;
                }
            }
        }
        self.text = &self.text[used..];
        let padding = values.iter().rev().take_while(|&&v| v == 64).count();
        match (count, padding) {
            (0, _) => return Ok(([0; 3], 0)),
            (4, 0..=2) if !values[..4 - padding].contains(&64) => {}
            _ => return Err(io::Error::new(io::ErrorKind::InvalidData, "not base64, or cut short")),
        }
        let bits = values.iter().fold(0u32, |bits, &v| bits << 6 | u32::from(v & 63));
        let [_, a, b, c] = bits.to_be_bytes();
        Ok(([a, b, c], 3 - padding))
    }
}

impl Read for Base64<'_> {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        let mut done = 0;
        while done < to.len() && self.left_len > 0 {
            self.left_len -= 1;
            to[done] = self.left[self.left_len];
            done += 1;
        }
        // Four plain characters in a row are by far the most frequent.
        let (quads, _) = self.text.as_chunks::<4>();
        let mut used = 0;
        for (quad, to) in quads.iter().zip(to[done..].as_chunks_mut::<3>().0) {
            let values = quad.map(|byte| VALUES[usize::from(byte)]);
            if values.iter().any(|&v| v >= 64) {
                break;
            }
            let bits = values.iter().fold(0u32, |bits, &v| bits << 6 | u32::from(v));
            to.copy_from_slice(&bits.to_be_bytes()[1..]);
            used += 1;
        }
        self.text = &self.text[4 * used..];
        done += 3 * used;
        if done == 0 && !to.is_empty() {
            let (bytes, count) = self.quantum()?;
            for (i, &byte) in bytes[..count].iter().enumerate() {
                self.left[count - 1 - i] = byte;
            }
            self.left_len = count;
            while done < to.len() && self.left_len > 0 {
                self.left_len -= 1;
                to[done] = self.left[self.left_len];
                done += 1;
            }
        }
        Ok(done)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decode(text: &[u8], step: usize) -> Vec<u8> {
        let (mut decoder, mut out, mut part) = (Base64::new(text), Vec::new(), vec![0; step]);
        loop {
            match decoder.read(&mut part).expect("this is base64") {
                0 => return out,
                count => out.extend_from_slice(&part[..count]),
            }
        }
    }

    #[test]
    fn base64_is_decoded_through_padding_within_and_white_space_whatever_the_step() {
        for step in 1..12 {
            assert_eq!(decode(b"cGVs\nbGlj bGU=\tc2tpbg==c2tpbg== </DataArray>", step), b"pellicleskinskin");
        }
    }

    #[test]
    fn damaged_base64_is_an_error() {
        for text in [&b"cGV"[..], b"c===", b"c=Vs", b"cGVsb"] {
            assert!(io::copy(&mut Base64::new(text), &mut io::sink()).is_err());
        }
    }
}
