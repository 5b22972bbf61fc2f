//! A file on its way out: bytes in order, arrays by several threads, not under its name until it is complete.

use std::ops::Range;
use std::path::Path;

use rayon::prelude::*;

use crate::columns::{Records, Values};
use crate::error::Error;
use crate::meshes::temporary::Temporary;
use crate::positional::{reserve, write_all_at};
use crate::scalar::Endian;

/// Bytes of text gathered before they are written.
const BUFFER: usize = 64 << 10;
/// Bytes formatted between two writes: large enough that threads seldom meet at the file's lock.
const CHUNK: usize = 1 << 20;
/// Bytes written at a time where no formatting is needed.
const DIRECT: usize = 4 << 20;
/// Lines formatted by one task, and tasks formatted before their text is written.
const LINES: usize = 1 << 13;
const BATCH: usize = 64;

/// A file that is being written from front to back.
pub(crate) struct Output {
    temporary: Temporary,
    /// Place behind all that was written.
    offset: u64,
    buffer: Vec<u8>,
}

impl Output {
    /// Creates the file. Where its length is known, room is reserved: a full disk is told before anything is written.
    pub(crate) fn create(path: &Path, len: Option<u64>) -> Result<Output, Error> {
        let temporary = Temporary::create(path)?;
        if let Some(len) = len {
            reserve(temporary.file(), len).map_err(|source| temporary.fail("reserve room", source))?;
        }
        Ok(Output { temporary, offset: 0, buffer: Vec::with_capacity(BUFFER + 256) })
    }

    /// Appends few bytes.
    pub(crate) fn bytes(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.buffer.extend_from_slice(bytes);
        if self.buffer.len() >= BUFFER { self.flush() } else { Ok(()) }
    }

    /// Appends an array.
    pub(crate) fn array(&mut self, values: Values<'_>, endian: Endian) -> Result<(), Error> {
        if let Some(plain) = values.plain(endian) {
            self.flush()?;
            plain.par_chunks(DIRECT).enumerate().try_for_each(|(i, part)| self.write(part, (i * DIRECT) as u64))?;
            self.offset += plain.len() as u64;
            return Ok(());
        }
        let size = values.scalar().size();
        self.tasks(values.len(), size, |range, to| {
            to.clear();
            to.resize(range.len() * size, 0);
            values.put(range, endian, to, size, 1);
        })
    }

    /// Appends `count` records.
    pub(crate) fn records(&mut self, records: &Records<'_>, count: usize, endian: Endian) -> Result<(), Error> {
        self.tasks(count, records.stride, |range, to| records.put(range, endian, to))
    }

    /// Appends `count` items of `size` bytes each, which `format` makes, range by range in several threads.
    pub(crate) fn tasks(
        &mut self,
        count: usize,
        size: usize,
        format: impl Fn(Range<usize>, &mut Vec<u8>) + Sync,
    ) -> Result<(), Error> {
        self.flush()?;
        let each = (CHUNK / size.max(1)).max(1);
        (0..count.div_ceil(each)).into_par_iter().try_for_each_init(Vec::new, |buffer, i| {
            format(i * each..count.min((i + 1) * each), buffer);
            self.write(buffer, i as u64 * (each * size) as u64)
        })?;
        self.offset += count as u64 * size as u64;
        Ok(())
    }

    /// Appends a line, or any other text, for each number below `count`.
    pub(crate) fn lines(&mut self, count: usize, line: impl Fn(usize, &mut String) + Sync) -> Result<(), Error> {
        self.flush()?;
        for first in (0..count).step_by(LINES * BATCH) {
            let end = count.min(first + LINES * BATCH);
            let text = |start: usize| {
                let mut text = String::with_capacity(LINES * 40);
                (start..end.min(start + LINES)).for_each(|i| line(i, &mut text));
                text
            };
            let starts: Vec<usize> = (first..end).step_by(LINES).collect();
            let texts: Vec<String> = starts.into_par_iter().map(text).collect();
            for text in &texts {
                self.write(text.as_bytes(), 0)?;
                self.offset += text.len() as u64;
            }
        }
        Ok(())
    }

    fn flush(&mut self) -> Result<(), Error> {
        let buffer = std::mem::take(&mut self.buffer);
        self.write(&buffer, 0)?;
        self.offset += buffer.len() as u64;
        self.buffer = buffer;
        self.buffer.clear();
        Ok(())
    }

    /// Writes at a place counted from the end of what is written.
    fn write(&self, bytes: &[u8], at: u64) -> Result<(), Error> {
        let file = self.temporary.file();
        write_all_at(file, bytes, self.offset + at).map_err(|source| self.temporary.fail("write", source))
    }

    /// Gives the complete file its name.
    pub(crate) fn finish(mut self) -> Result<(), Error> {
        self.flush()?;
        self.temporary.finish()
    }
}

/// What happened to data that a format cannot hold as they are.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Written {
    /// Attributes that the format has no room for; they are not in the file.
    pub left_out: Vec<String>,
    /// What was in double precision and is in single precision in the file, such as `position`; or lost a component.
    pub narrowed: Vec<String>,
}
