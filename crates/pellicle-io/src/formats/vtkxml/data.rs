//! The data of an array in a VTK XML file: text, base64 or raw bytes, plain or in compressed blocks, on their way into
//! memory, by several threads.
//!
//! Binary data begin with sizes: of the data in bytes; or, compressed, the number of blocks, the size of a block, the
//! size of the last one if it is shorter, and the compressed size of each. [`Data::open`] checks all sizes against the
//! file before anything is reserved for the data.

use std::io::{self, Read};
use std::ops::Range;
use std::path::Path;

use flate2::{Decompress, FlushDecompress, Status};
use lzma_rust2::XzReader;
use rayon::prelude::*;

use super::base64::{Base64, Payload};
use super::document::{Compressor, DataArray, Document, Location};
use crate::error::{Error, Place};
use crate::scalar::{Endian, Field, Records, Scalar, Target, decode_component, integer};
use crate::source::MAX_INFLATION;

/// Numbers, or bytes of text or inflated data, that are worked on at once: enough to be worth a task, few enough to stay
/// in cache. A multiple of the size of every number.
const RUN: usize = 64 << 10;
/// LZ4 cannot make data smaller than by this factor.
const MAX_LZ4: u64 = 255;
/// Memory that the dictionary of an XZ stream may take, in KiB: what its strongest preset asks for.
const XZ_MEMORY_KIB: u32 = 66 << 10;

/// An array whose sizes have been checked.
pub(super) struct Data<'a> {
    path: &'a Path,
    name: &'a str,
    /// Place of the data in the file.
    place: u64,
    scalar: Scalar,
    endian: Endian,
    layout: Layout<'a>,
}

enum Layout<'a> {
    /// Decimal numbers.
    Text(&'a [u8]),
    Plain(Payload<'a>),
    Blocks {
        payload: Payload<'a>,
        compressor: Compressor,
        /// Where the compressed blocks begin; one more than there are blocks.
        starts: Vec<usize>,
        /// Bytes in a block, the last one excepted.
        block: usize,
        /// Bytes in all of them.
        size: usize,
    },
}

impl<'a> Data<'a> {
    /// Opens an array that must hold `values` numbers.
    pub(super) fn open(
        path: &'a Path,
        bytes: &'a [u8],
        document: &Document,
        array: &'a DataArray,
        scalar: Scalar,
        values: u64,
    ) -> Result<Data<'a>, Error> {
        let name = if array.name.is_empty() { "Points" } else { array.name.as_str() };
        let (start, is_base64, part) = match &array.location {
            Location::Text(range) => (range.start, false, bytes.get(range.clone()).unwrap_or_default()),
            Location::Base64(range) => (range.start, true, bytes.get(range.clone()).unwrap_or_default()),
            Location::Appended(offset) => appended(path, bytes, document, name, *offset)?,
        };
        let layout = Layout::Text(part);
        let mut data = Data { path, name, place: start as u64, scalar, endian: document.endian, layout };
        if let Location::Text(_) = array.location {
            // The last number needs no separator behind it.
            if u128::from(values) * 2 > part.len() as u128 + 1 {
                return Err(data.fail(format!(
                    "the array '{name}' must have {values} numbers, which do not fit into its {} bytes: the file is cut short or its header is wrong",
                    part.len()
                )));
            }
            return Ok(data);
        }
        let size = usize::try_from(u128::from(values) * scalar.size() as u128).map_err(|_| {
            data.fail(format!("the array '{name}' must have {values} numbers, which do not fit into memory"))
        })?;
        let reader = if is_base64 { Reader::Base64(Base64::new(part)) } else { Reader::Raw(part) };
        let sizes = Sizes { data: &data, document, reader };
        data.layout = match document.compressor {
            Some(compressor) => sizes.compressed(part.len() as u64, size, compressor)?,
            None => sizes.plain(size)?,
        };
        Ok(data)
    }

    fn fail(&self, what: String) -> Error {
        Error::Format { path: self.path.into(), place: Place::Byte(self.place), what }
    }

    fn damaged(&self, error: &io::Error) -> Error {
        self.fail(format!("the data of the array '{}' are damaged or cut short ({error})", self.name))
    }

    /// Decodes all numbers into `out`, which has as many as were asked for.
    pub(super) fn fill<D: Target + Send>(&self, out: &mut [D]) -> Result<(), Error> {
        let scalar = self.scalar.size();
        match &self.layout {
            Layout::Text(text) => self.fill_from_text(text, out),
            Layout::Plain(payload) => {
                out.par_chunks_mut(RUN / 4).enumerate().try_for_each_init(Vec::new, |scratch, (run, out)| {
                    let from = run * (RUN / 4) * scalar;
                    let bytes = payload.get(from..from + out.len() * scalar, scratch).map_err(|e| self.damaged(&e))?;
                    self.decode(bytes, out);
                    Ok(())
                })
            }
            Layout::Blocks { payload, compressor, starts, block, size } => {
                // Blocks that cut a number in two cannot be decoded one by one.
                let is_aligned = block % scalar == 0;
                let (per_task, blocks) = if is_aligned { (*block, 1) } else { (*size, starts.len() - 1) };
                if *size == 0 {
                    return Ok(());
                }
                let parts = out.par_chunks_mut(per_task / scalar).enumerate();
                parts.try_for_each_init(Inflater::new, |inflater, (task, out)| {
                    let numbers = task * blocks..(task + 1) * blocks;
                    let blocks = numbers.map(|i| (starts[i]..starts[i + 1], (*block).min(size - i * block)));
                    let decode = |bytes: &[u8], at: usize| {
                        let at = at / scalar;
                        self.decode(bytes, &mut out[at..at + bytes.len() / scalar]);
                    };
                    inflater.run(payload, *compressor, blocks, decode).map_err(|error| self.damaged(&error))
                })
            }
        }
    }

    fn fill_from_text<D: Target + Send>(&self, text: &[u8], out: &mut [D]) -> Result<(), Error> {
        let (mut rest, mut place, mut done) = (text, self.place, 0);
        // Numbers of which nobody knows where they begin: pieces of text are parsed at once, and joined in order.
        let together = 4 * rayon::current_num_threads();
        while done < out.len() {
            let mut parts: Vec<(&[u8], u64)> = Vec::new();
            while parts.len() < together && !rest.is_empty() {
                let reach = rest.len().min(RUN);
                let end = rest[reach..].iter().position(u8::is_ascii_whitespace).map_or(rest.len(), |at| reach + at);
                let (part, after) = rest.split_at(end);
                parts.push((part, place));
                (rest, place) = (after, place + end as u64);
            }
            if parts.is_empty() {
                let (name, expected) = (self.name, out.len());
                return Err(self.fail(format!("the array '{name}' has {done} numbers, {expected} were expected")));
            }
            let parsed: Result<Vec<Vec<u8>>, Error> =
                parts.into_par_iter().map(|(part, place)| self.parse(part, place)).collect();
            for bytes in parsed? {
                let count = (bytes.len() / self.scalar.size()).min(out.len() - done);
                let records = &bytes[..count * self.scalar.size()];
                let records = Records { bytes: records, stride: self.scalar.size(), endian: Endian::Little };
                let field = Field { offset: 0, scalar: self.scalar };
                decode_component(&mut out[done..done + count], 0, 1, records, field);
                done += count;
            }
        }
        Ok(())
    }

    /// The numbers of a piece of text, as little-endian bytes.
    fn parse(&self, text: &[u8], place: u64) -> Result<Vec<u8>, Error> {
        let mut out = Vec::with_capacity(text.len());
        for token in text.split(u8::is_ascii_whitespace).filter(|token| !token.is_empty()) {
            if self.scalar.encode(token, &mut out).is_none() {
                let at = token.as_ptr() as usize - text.as_ptr() as usize;
                let token = String::from_utf8_lossy(&token[..token.len().min(40)]).into_owned();
                let what = format!("'{token}' is not a number of the declared type, in the array '{}'", self.name);
                let place = Place::Byte(place + at as u64);
                return Err(Error::Format { path: self.path.into(), place, what });
            }
        }
        Ok(out)
    }

    fn decode<D: Target>(&self, bytes: &[u8], out: &mut [D]) {
        let records = Records { bytes, stride: self.scalar.size(), endian: self.endian };
        decode_component(out, 0, 1, records, Field { offset: 0, scalar: self.scalar });
    }
}

/// The appended data from an array's offset on: where, whether in base64, the bytes.
fn appended<'a>(
    path: &Path,
    bytes: &'a [u8],
    document: &Document,
    name: &str,
    offset: u64,
) -> Result<(usize, bool, &'a [u8]), Error> {
    let found = document.appended.and_then(|appended| {
        let start = appended.start.checked_add(usize::try_from(offset).ok()?)?;
        Some((start, appended.is_base64, bytes.get(start..)?))
    });
    found.ok_or_else(|| {
        let what = format!("the data of the array '{name}' lie beyond the end of the file: it seems to be cut short");
        Error::Format { path: path.into(), place: Place::Byte(bytes.len() as u64), what }
    })
}

enum Reader<'a> {
    Raw(&'a [u8]),
    Base64(Base64<'a>),
}

impl<'a> Reader<'a> {
    /// The next `size` bytes; nothing is read of them yet.
    fn payload(self, size: usize) -> io::Result<Payload<'a>> {
        match self {
            Reader::Raw(bytes) => {
                bytes.get(..size).map(|bytes| Payload::Raw(bytes.into())).ok_or(io::ErrorKind::UnexpectedEof.into())
            }
            Reader::Base64(decoder) => Payload::of_text(decoder, size),
        }
    }
}

/// The sizes that stand before an array's data.
struct Sizes<'a, 'b> {
    data: &'b Data<'a>,
    document: &'b Document,
    reader: Reader<'a>,
}

impl<'a> Sizes<'a, '_> {
    fn fail(&self, what: String) -> Error {
        self.data.fail(format!("the array '{}' {what}", self.data.name))
    }

    fn next(&mut self) -> Result<u64, Error> {
        let header = self.document.header;
        let (mut bytes, size) = ([0; 8], header.size());
        let read = match &mut self.reader {
            Reader::Raw(rest) => rest.read_exact(&mut bytes[..size]),
            Reader::Base64(decoder) => decoder.read_exact(&mut bytes[..size]),
        };
        read.map_err(|error| self.fail(format!("has sizes before it that are damaged or cut short ({error})")))?;
        // Beyond the range of the signed type it is too large in any case.
        Ok(integer(&bytes[..size], header, self.document.endian).unsigned_abs())
    }

    fn plain(mut self, size: usize) -> Result<Layout<'a>, Error> {
        let found = self.next()?;
        if found != size as u64 {
            return Err(self.fail(format!("has {found} bytes, {size} were expected")));
        }
        let data = self.data;
        Ok(Layout::Plain(self.reader.payload(size).map_err(|error| data.damaged(&error))?))
    }

    /// `available` is the file's part that the data are in.
    fn compressed(mut self, available: u64, size: usize, compressor: Compressor) -> Result<Layout<'a>, Error> {
        let (count, block, last) = (self.next()?, self.next()?, self.next()?);
        let found = match (count, last) {
            (0, _) => Some(0),
            (_, 0) => count.checked_mul(block),
            _ => (count - 1).checked_mul(block).and_then(|full| full.checked_add(last)),
        };
        if found != Some(size as u64) || last > block {
            return Err(self.fail(format!(
                "has {count} blocks of {block} bytes and a last one of {last}, which are not the {size} bytes that were expected"
            )));
        }
        // Of the characters of base64 no more than three in four count; a block that holds anything takes two bytes.
        if count.saturating_mul(self.document.header.size() as u64 + 2) > available {
            return Err(self.fail(format!("announces {count} compressed blocks: too many for the file")));
        }
        let mut starts = Vec::with_capacity(count as usize + 1);
        let mut end = 0u64;
        starts.push(0);
        for _ in 0..count {
            end = end.saturating_add(self.next()?);
            if end > available {
                return Err(self.fail(format!("has {end} compressed bytes or more, the file has {available} left")));
            }
            starts.push(end as usize);
        }
        let factor = match compressor {
            Compressor::Zlib => Some(MAX_INFLATION),
            Compressor::Lz4 => Some(MAX_LZ4),
            // As much as one likes.
            Compressor::Lzma => None,
        };
        if factor.is_some_and(|factor| end.saturating_mul(factor) < size as u64) {
            return Err(self.fail(format!("has {end} compressed bytes, which cannot make the {size} expected")));
        }
        let data = self.data;
        let payload = self.reader.payload(end as usize).map_err(|error| data.damaged(&error))?;
        // A size is no larger than the data, which were found to fit into memory.
        let block = if count == 1 { size } else { block as usize };
        Ok(Layout::Blocks { payload, compressor, starts, block, size })
    }
}

/// What a thread needs to inflate blocks.
struct Inflater {
    zlib: Decompress,
    packed: Vec<u8>,
    /// Inflated bytes that are not decoded yet.
    window: Vec<u8>,
}

impl Inflater {
    fn new() -> Inflater {
        Inflater { zlib: Decompress::new(true), packed: Vec::new(), window: vec![0; RUN] }
    }

    /// Inflates blocks, given by place and inflated size, and hands their joined content to `decode` in parts of whole
    /// numbers, each with its place.
    fn run(
        &mut self,
        payload: &Payload<'_>,
        compressor: Compressor,
        blocks: impl Iterator<Item = (Range<usize>, usize)>,
        mut decode: impl FnMut(&[u8], usize),
    ) -> io::Result<()> {
        let (mut filled, mut done) = (0, 0);
        for (range, size) in blocks {
            let mut packed = payload.get(range, &mut self.packed)?;
            let mut unpacked = Vec::new();
            let mut stream: Box<dyn Read> = match compressor {
                Compressor::Zlib => {
                    self.zlib.reset(true);
                    Box::new(Zlib { state: &mut self.zlib, input: &mut packed })
                }
                Compressor::Lzma => Box::new(XzReader::new_mem_limit(&mut packed, false, XZ_MEMORY_KIB)),
                Compressor::Lz4 => {
                    unpacked.resize(size, 0);
                    let count = lz4_flex::block::decompress_into(packed, &mut unpacked).map_err(io::Error::other)?;
                    packed = &[];
                    Box::new(&unpacked[..count])
                }
            };
            let mut left = size;
            while left > 0 {
                let step = left.min(RUN - filled);
                stream.read_exact(&mut self.window[filled..filled + step])?;
                (filled, left) = (filled + step, left - step);
                if filled == RUN {
                    decode(&self.window, done);
                    (filled, done) = (0, done + RUN);
                }
            }
            let is_longer = stream.read(&mut [0])? > 0;
            drop(stream);
            if is_longer || !packed.is_empty() {
                return Err(io::Error::new(io::ErrorKind::InvalidData, "a block is longer than announced"));
            }
        }
        decode(&self.window[..filled], done);
        Ok(())
    }
}

/// A zlib stream in memory, by a state that is used again and again.
struct Zlib<'a, 'b> {
    state: &'a mut Decompress,
    input: &'a mut &'b [u8],
}

impl Read for Zlib<'_, '_> {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        let (read, written) = (self.state.total_in(), self.state.total_out());
        let status = self.state.decompress(self.input, to, FlushDecompress::None)?;
        *self.input = &self.input[(self.state.total_in() - read) as usize..];
        match (self.state.total_out() - written) as usize {
            0 if status != Status::StreamEnd && !to.is_empty() => Err(io::ErrorKind::UnexpectedEof.into()),
            count => Ok(count),
        }
    }
}
