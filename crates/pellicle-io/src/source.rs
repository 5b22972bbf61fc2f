//! A file as the readers see it: bytes, lines, tokens and records, each failure with its place.
//!
//! All reading goes through one buffer of fixed size, and nothing is reserved before [`Source::room`] has compared
//! what a header promises with the bytes that are left. So a lying header costs an error, not memory.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use flate2::read::GzDecoder;

use crate::error::{Error, Place};
use crate::formats::detect::GZIP;
use crate::scalar::{Encoding, Endian, Scalar};

/// Bytes read at a time: few system calls, and still within the second level cache.
const CAPACITY: usize = 256 << 10;
/// Longest line that is taken for a line of text.
pub(crate) const MAX_LINE: usize = 64 << 10;
/// Longest word that is taken for a number or a name.
const MAX_TOKEN: usize = 4 << 10;
/// Deflate cannot make data smaller than by this factor.
pub(crate) const MAX_INFLATION: u64 = 1032;
/// Bytes that are reserved ahead for compressed data, whose size says little about their content.
const MAX_RESERVE_INFLATED: usize = 1 << 20;

/// Content of this size is inflated whatever it was compressed to.
const FREE_INFLATION: u64 = 64 << 20;
/// Beyond it, the content may be larger than the file by this factor. Particles at rest on a grid reach 20.
const RATIO: u64 = 100;

/// How many bytes are read of the content of a compressed file of `len` bytes.
pub(crate) fn inflated_limit(len: u64) -> u64 {
    let possible = len.saturating_mul(MAX_INFLATION);
    possible.min(FREE_INFLATION.saturating_add(len.saturating_mul(RATIO)))
}

enum Input<'a> {
    File(File),
    Stream(Box<dyn Read + 'a>),
}

impl Input<'_> {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        loop {
            let result = match self {
                Input::File(file) => file.read(to),
                Input::Stream(stream) => stream.read(to),
            };
            match result {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                other => return other,
            }
        }
    }
}

/// A stream of bytes with its name and place.
pub(crate) struct Source<'a> {
    path: PathBuf,
    input: Input<'a>,
    buffer: Vec<u8>,
    start: usize,
    end: usize,
    /// Place of `buffer[start]` in the stream.
    offset: u64,
    /// Complete lines behind.
    lines: u64,
    /// Whether places are told as lines.
    is_text: bool,
    /// The stream ends here at the latest.
    limit: u64,
    /// Whether the limit is the stream's end, or only a bound.
    is_inflating: bool,
}

/// Opens a regular file; returns its length too.
pub(crate) fn open(path: &Path) -> Result<(File, u64), Error> {
    let fail = |source| Error::Open { path: path.into(), source };
    // Asked before opening, since opening a pipe waits for a writer.
    let metadata = std::fs::metadata(path).map_err(fail)?;
    if !metadata.is_file() {
        let what =
            if metadata.is_dir() { "this is a folder" } else { "this is not a regular file: write it to one first" };
        return Err(Error::Unsupported { path: path.into(), what: what.into() });
    }
    Ok((File::open(path).map_err(fail)?, metadata.len()))
}

impl<'a> Source<'a> {
    /// A file from its start.
    pub(crate) fn open(path: &Path) -> Result<Source<'static>, Error> {
        let (file, len) = open(path)?;
        Ok(Source::new(path, Input::File(file), 0, len, false))
    }

    /// A text file from its start, which may be compressed by gzip; places are told as lines.
    pub(crate) fn open_text(path: &Path) -> Result<Source<'static>, Error> {
        let mut source = Source::open(path)?;
        if source.peek(2)?.starts_with(&GZIP) {
            let (file, len) = open(path)?;
            source = Source::inflating(path, GzDecoder::new(file), inflated_limit(len));
        }
        source.set_text(true);
        if source.peek(3)?.starts_with(b"\xef\xbb\xbf") {
            source.advance(3);
        }
        Ok(source)
    }

    /// The `len` bytes of a file that begin at `offset`.
    pub(crate) fn open_part(path: &Path, offset: u64, len: u64) -> Result<Source<'static>, Error> {
        let (mut file, _) = open(path)?;
        let fail = |source| Error::Read { path: path.into(), source };
        file.seek(SeekFrom::Start(offset)).map_err(fail)?;
        Ok(Source::new(path, Input::File(file), offset, offset.saturating_add(len), false))
    }

    /// The content of a compressed file, of which `limit` bytes are read at most.
    pub(crate) fn inflating(path: &Path, stream: impl Read + 'a, limit: u64) -> Source<'a> {
        Source::new(path, Input::Stream(Box::new(stream)), 0, limit, true)
    }

    /// Bytes that follow each other in several files, `len` in all; places are told as if they were one file.
    pub(crate) fn joined(path: &Path, stream: impl Read + 'a, len: u64) -> Source<'a> {
        Source::new(path, Input::Stream(Box::new(stream)), 0, len, false)
    }

    fn new(path: &Path, input: Input<'a>, offset: u64, limit: u64, is_inflating: bool) -> Source<'a> {
        let buffer = vec![0; CAPACITY];
        Source {
            path: path.into(),
            input,
            buffer,
            start: 0,
            end: 0,
            offset,
            lines: 0,
            is_text: false,
            limit,
            is_inflating,
        }
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// From here on places are told as lines (`true`) or bytes.
    pub(crate) fn set_text(&mut self, is_text: bool) {
        self.is_text = is_text;
    }

    /// Whether the bytes come out of a decompressor, so that [`remaining`](Self::remaining) is a bound only.
    pub(crate) fn is_inflating(&self) -> bool {
        self.is_inflating
    }

    /// Lets [`peek`](Self::peek) show up to `capacity` bytes.
    pub(crate) fn widen(&mut self, capacity: usize) {
        if self.buffer.len() < capacity {
            self.buffer.resize(capacity, 0);
        }
    }

    /// Consumes bytes that [`peek`](Self::peek) has shown and that hold `lines` complete lines.
    pub(crate) fn advance_lines(&mut self, n: usize, lines: u64) {
        self.advance(n);
        self.lines += lines;
    }

    /// An error about the line that is `ahead` lines further, counted from 1.
    pub(crate) fn fail_ahead(&self, ahead: u64, what: impl Into<String>) -> Error {
        Error::Format { path: self.path.clone(), place: Place::Line(self.lines + ahead), what: what.into() }
    }

    /// Bytes that may still come: exact for plain files, a bound for compressed ones.
    pub(crate) fn remaining(&self) -> u64 {
        self.limit.saturating_sub(self.offset)
    }

    pub(crate) fn offset(&self) -> u64 {
        self.offset
    }

    /// An error about what was just read.
    pub(crate) fn fail(&self, what: impl Into<String>) -> Error {
        let place = if self.is_text { Place::Line(self.lines.max(1)) } else { Place::Byte(self.offset) };
        Error::Format { path: self.path.clone(), place, what: what.into() }
    }

    /// An error about something that is sound but not read here.
    pub(crate) fn unsupported(&self, what: impl Into<String>) -> Error {
        Error::Unsupported { path: self.path.clone(), what: what.into() }
    }

    fn read(&mut self, into: usize) -> Result<usize, Error> {
        self.input.read(&mut self.buffer[into..]).map_err(|source| match source.kind() {
            io::ErrorKind::InvalidData | io::ErrorKind::InvalidInput | io::ErrorKind::UnexpectedEof => {
                self.fail(format!("the compressed or encoded data are damaged ({source})"))
            }
            _ => Error::Read { path: self.path.clone(), source },
        })
    }

    /// The next bytes, at least `n` of them unless the stream ends before; nothing is consumed. `n` is at most 128 KiB,
    /// or what [`widen`](Self::widen) was told.
    pub(crate) fn peek(&mut self, n: usize) -> Result<&[u8], Error> {
        if self.end - self.start < n && self.start > 0 {
            self.buffer.copy_within(self.start..self.end, 0);
            self.end -= self.start;
            self.start = 0;
        }
        while self.end - self.start < n {
            let count = self.read(self.end)?;
            if count == 0 {
                break;
            }
            self.end += count;
        }
        Ok(&self.buffer[self.start..self.end])
    }

    /// Consumes bytes that [`peek`](Self::peek) has shown.
    pub(crate) fn advance(&mut self, n: usize) {
        debug_assert!(n <= self.end - self.start);
        self.start += n;
        self.offset += n as u64;
    }

    /// The next `n` bytes, consumed. `n` is at most 128 KiB.
    pub(crate) fn exact(&mut self, n: usize, what: &str) -> Result<&[u8], Error> {
        let available = self.peek(n)?.len();
        if available < n {
            return Err(self.cut(what));
        }
        self.advance(n);
        Ok(&self.buffer[self.start - n..self.start])
    }

    pub(crate) fn cut(&self, what: &str) -> Error {
        self.fail(format!("the file ends within {what}: it seems to be cut short"))
    }

    /// Passes over `n` bytes.
    pub(crate) fn skip(&mut self, n: u64, what: &str) -> Result<(), Error> {
        if n > self.remaining() {
            return Err(self.cut(what));
        }
        let buffered = (self.end - self.start) as u64;
        if n > buffered
            && let Input::File(file) = &mut self.input
        {
            let to = self.offset + n;
            file.seek(SeekFrom::Start(to)).map_err(|source| Error::Read { path: self.path.clone(), source })?;
            (self.start, self.end, self.offset) = (0, 0, to);
            return Ok(());
        }
        let mut left = n;
        while left > 0 {
            let step = left.min(64 << 10) as usize;
            self.exact(step, what)?;
            left -= step as u64;
        }
        Ok(())
    }

    /// The next line without its end (`\n` or `\r\n`), or `None` at the end of the file.
    pub(crate) fn line(&mut self) -> Result<Option<&[u8]>, Error> {
        let mut searched = 0;
        let length = loop {
            let bytes = &self.buffer[self.start..self.end];
            if let Some(at) = bytes[searched..].iter().position(|&b| b == b'\n') {
                break searched + at;
            }
            searched = bytes.len();
            if searched > MAX_LINE {
                self.lines += 1;
                return Err(self.fail(format!("more than {MAX_LINE} bytes without a line end: this is not text")));
            }
            if self.peek(searched + 1)?.len() == searched {
                break searched;
            }
        };
        let has_end = length < self.end - self.start;
        if length == 0 && !has_end {
            return Ok(None);
        }
        self.lines += 1;
        self.advance(length + usize::from(has_end));
        let line = &self.buffer[self.start - length - usize::from(has_end)..][..length];
        Ok(Some(line.strip_suffix(b"\r").unwrap_or(line)))
    }

    /// The next word between white space, or `None` at the end of the file.
    pub(crate) fn token(&mut self) -> Result<Option<&[u8]>, Error> {
        loop {
            let bytes = &self.buffer[self.start..self.end];
            let blank = bytes.iter().take_while(|b| b.is_ascii_whitespace()).count();
            self.lines += bytes[..blank].iter().filter(|&&b| b == b'\n').count() as u64;
            self.advance(blank);
            if self.start < self.end {
                break;
            }
            if self.peek(1)?.is_empty() {
                return Ok(None);
            }
        }
        let mut searched = 0;
        let length = loop {
            let bytes = &self.buffer[self.start..self.end];
            if let Some(at) = bytes[searched..].iter().position(u8::is_ascii_whitespace) {
                break searched + at;
            }
            searched = bytes.len();
            if searched > MAX_TOKEN {
                return Err(self.fail(format!("a word of more than {MAX_TOKEN} bytes: this is not text")));
            }
            if self.peek(searched + 1)?.len() == searched {
                break searched;
            }
        };
        self.advance(length);
        Ok(Some(&self.buffer[self.start - length..self.start]))
    }

    /// Appends the next number of an ASCII file to `out`, as `scalar` in little-endian bytes.
    pub(crate) fn number(&mut self, scalar: Scalar, out: &mut Vec<u8>, what: &str) -> Result<(), Error> {
        let Some(token) = self.token()? else { return Err(self.cut(what)) };
        if scalar.encode(token, out).is_none() {
            let token = String::from_utf8_lossy(&token[..token.len().min(40)]).into_owned();
            // The line of the word itself is not complete yet.
            self.lines += 1;
            return Err(self.fail(format!("'{token}' is not a number of the declared type, in {what}")));
        }
        Ok(())
    }

    /// Checks that `count` items of at least `bytes` each can follow; returns how many to reserve memory for.
    pub(crate) fn room(&self, count: u64, bytes: u64, what: &str) -> Result<usize, Error> {
        let needed = u128::from(count) * u128::from(bytes.max(1));
        // The last number of an ASCII file needs no separator behind it.
        if needed > u128::from(self.remaining()) + 1 {
            let left = self.remaining();
            let has = if self.is_inflating {
                format!(
                    "of compressed data no more than {left} are read here: decompress it first, unless it is damaged"
                )
            } else {
                format!("the file has {left} left: it is cut short or its header is wrong")
            };
            return Err(self.fail(format!("{count} {what} are announced, which take at least {needed} bytes; {has}")));
        }
        let count = usize::try_from(count).map_err(|_| self.fail(format!("{count} {what} do not fit into memory")))?;
        let ahead = MAX_RESERVE_INFLATED / bytes.max(1) as usize + 1;
        Ok(if self.is_inflating { count.min(ahead) } else { count })
    }

    /// Bytes that a record of `layout` takes at least.
    pub(crate) fn least_bytes(encoding: Encoding, layout: &[Scalar]) -> u64 {
        match encoding {
            Encoding::Ascii => 2 * layout.len() as u64,
            Encoding::Binary(_) => layout.iter().map(|s| s.size() as u64).sum(),
        }
    }

    /// Reads `count` records of `stride` bytes and hands them to `each` in runs.
    pub(crate) fn raw_records(
        &mut self,
        stride: usize,
        count: u64,
        what: &str,
        mut each: impl FnMut(&[u8]) -> Result<(), Error>,
    ) -> Result<(), Error> {
        self.room(count, stride as u64, what)?;
        let per_run = ((64 << 10) / stride.max(1)).max(1);
        let mut left = count;
        while left > 0 {
            let run = left.min(per_run as u64) as usize;
            each(self.exact(run * stride, what)?)?;
            left -= run as u64;
        }
        Ok(())
    }

    /// Reads `count` records of the numbers in `layout` and hands them to `each` in runs, as packed bytes.
    pub(crate) fn records(
        &mut self,
        encoding: Encoding,
        layout: &[Scalar],
        count: u64,
        what: &str,
        mut each: impl FnMut(&[u8], Endian) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let stride: usize = layout.iter().map(|s| s.size()).sum();
        if stride == 0 {
            return Ok(());
        }
        if stride > 64 << 10 {
            return Err(self.fail(format!("{what} of {stride} bytes each: the limit is 65536")));
        }
        self.room(count, Self::least_bytes(encoding, layout), what)?;
        let per_run = (64 << 10) / stride;
        let mut text = Vec::new();
        let mut left = count;
        while left > 0 {
            let run = left.min(per_run as u64) as usize;
            match encoding {
                Encoding::Binary(endian) => each(self.exact(run * stride, what)?, endian)?,
                Encoding::Ascii => {
                    text.clear();
                    for _ in 0..run {
                        for &scalar in layout {
                            self.number(scalar, &mut text, what)?;
                        }
                    }
                    each(&text, Endian::Little)?;
                }
            }
            left -= run as u64;
        }
        Ok(())
    }
}
