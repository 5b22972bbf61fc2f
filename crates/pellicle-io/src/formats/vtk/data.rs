//! The data of the sections: arrays and cells, read or passed over.

use super::{Array, Cells, Content, Reader, shorten, words};
use crate::error::Error;
use crate::scalar::{Encoding, Endian, Scalar, integer};
use crate::source::Source;

/// Corners of a cell, at most.
const MAX_CORNERS: i64 = 1 << 20;

impl Reader {
    /// Reads `tuples` times `components` numbers, handed out in runs of whole tuples.
    pub(crate) fn read(
        &mut self,
        scalar: Scalar,
        components: usize,
        tuples: u64,
        what: &str,
        each: impl FnMut(&[u8], Endian) -> Result<(), Error>,
    ) -> Result<(), Error> {
        self.source.records(self.encoding, &vec![scalar; components], tuples, what, each)
    }

    /// How many tuples to reserve memory for; an error if they cannot be in the file.
    pub(crate) fn room(&self, scalar: Scalar, components: usize, tuples: u64, what: &str) -> Result<usize, Error> {
        self.source.room(tuples, Source::least_bytes(self.encoding, &vec![scalar; components]), what)
    }

    /// Reads the types of cells.
    pub(crate) fn read_cell_types(
        &mut self,
        count: u64,
        mut each: impl FnMut(&Source<'_>, i64) -> Result<(), Error>,
    ) -> Result<(), Error> {
        self.room(Scalar::I32, 1, count, "cell types")?;
        for _ in 0..count {
            let kind = self.integer(Scalar::I32)?;
            each(&self.source, kind)?;
        }
        Ok(())
    }

    /// Passes over the types of cells.
    pub(crate) fn skip_cell_types(&mut self, count: u64) -> Result<(), Error> {
        self.skip_numbers(Scalar::I32, count, "cell types")
    }

    /// Passes over the points.
    pub(crate) fn skip_points(&mut self, scalar: Scalar, count: u64) -> Result<(), Error> {
        self.skip_numbers(scalar, count.saturating_mul(3), "points")
    }

    /// Passes over an array.
    pub(crate) fn skip_array(&mut self, array: &Array) -> Result<(), Error> {
        let values = array.tuples.saturating_mul(array.components as u64);
        match (array.content, self.encoding) {
            (Content::Numbers(scalar), _) => self.skip_numbers(scalar, values, "an array"),
            (Content::Bits, Encoding::Ascii) => self.skip_numbers(Scalar::U8, values, "an array"),
            (Content::Bits, _) => self.skip_numbers(Scalar::U8, values.div_ceil(8), "an array"),
            (Content::Strings, _) => self.skip_strings(values),
        }
    }

    /// Passes over cells.
    pub(crate) fn skip_cells(&mut self, cells: Cells) -> Result<(), Error> {
        if !cells.has_offsets {
            return self.skip_numbers(Scalar::I32, cells.size, "cells");
        }
        let offsets = self.connectivity_type("OFFSETS")?;
        self.skip_numbers(offsets, cells.count, "cells")?;
        let connectivity = self.connectivity_type("CONNECTIVITY")?;
        self.skip_numbers(connectivity, cells.size, "cells")
    }

    /// Reads cells; each is handed out as its list of points.
    pub(crate) fn read_cells(
        &mut self,
        cells: Cells,
        mut each: impl FnMut(&Source<'_>, &[i64]) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let (mut points, mut numbers) = (Vec::new(), 0u64);
        if !cells.has_offsets {
            self.room(Scalar::I32, 1, cells.count, "cells")?;
            for _ in 0..cells.count {
                let corners = self.integer(Scalar::I32)?;
                self.cell(Scalar::I32, corners, &mut points)?;
                numbers += 1 + points.len() as u64;
                each(&self.source, &points)?;
            }
            return self.check_size(cells, numbers);
        }
        let scalar = self.connectivity_type("OFFSETS")?;
        let mut offsets = Vec::with_capacity(self.room(scalar, 1, cells.count, "offsets of cells")?);
        for _ in 0..cells.count {
            offsets.push(self.integer(scalar)?);
        }
        let scalar = self.connectivity_type("CONNECTIVITY")?;
        for pair in offsets.windows(2) {
            self.cell(scalar, pair[1].saturating_sub(pair[0]), &mut points)?;
            numbers += points.len() as u64;
            each(&self.source, &points)?;
        }
        self.check_size(cells, numbers)
    }

    /// What follows is found by the size alone where cells are passed over, so it must be right.
    fn check_size(&self, cells: Cells, numbers: u64) -> Result<(), Error> {
        if numbers == cells.size {
            return Ok(());
        }
        let announced = cells.size;
        Err(self.source.fail(format!("the cells take {numbers} numbers, where {announced} are announced")))
    }

    fn cell(&mut self, scalar: Scalar, corners: i64, points: &mut Vec<i64>) -> Result<(), Error> {
        if !(0..=MAX_CORNERS).contains(&corners) {
            return Err(self.source.fail(format!("a cell of {corners} points")));
        }
        points.clear();
        for _ in 0..corners {
            points.push(self.integer(scalar)?);
        }
        Ok(())
    }

    fn integer(&mut self, scalar: Scalar) -> Result<i64, Error> {
        match self.encoding {
            Encoding::Binary(endian) => Ok(integer(self.source.exact(scalar.size(), "cells")?, scalar, endian)),
            Encoding::Ascii => {
                let mut bytes = Vec::with_capacity(8);
                self.source.number(scalar, &mut bytes, "cells")?;
                Ok(integer(&bytes, scalar, Endian::Little))
            }
        }
    }

    /// Reads a line such as `OFFSETS vtktypeint64`.
    fn connectivity_type(&mut self, key: &str) -> Result<Scalar, Error> {
        match words(&mut self.source)?.as_slice() {
            [found, kind, ..] if found.eq_ignore_ascii_case(key) => match self.content(kind)? {
                Content::Numbers(scalar) => Ok(scalar),
                _ => Err(self.source.fail(format!("{key} of type {kind}"))),
            },
            other => Err(self.source.fail(format!("'{}' stands where {key} is expected", shorten(other)))),
        }
    }

    fn skip_numbers(&mut self, scalar: Scalar, count: u64, what: &str) -> Result<(), Error> {
        if let Encoding::Binary(_) = self.encoding {
            return self.source.skip(count.saturating_mul(scalar.size() as u64), what);
        }
        self.source.room(count, 2, what)?;
        for _ in 0..count {
            if self.source.token()?.is_none() {
                return Err(self.source.fail(format!("the file ends within {what}: it seems to be cut short")));
            }
        }
        Ok(())
    }

    /// Passes over strings: in ASCII a line each; in binary each after its length, whose first two bits tell how many
    /// bytes it takes.
    fn skip_strings(&mut self, count: u64) -> Result<(), Error> {
        const WHAT: &str = "strings";
        self.source.room(count, 1, WHAT)?;
        for _ in 0..count {
            if self.encoding == Encoding::Ascii {
                self.source.line()?;
                continue;
            }
            let first = self.source.exact(1, WHAT)?[0];
            let further = [7, 3, 1, 0][usize::from(first >> 6)];
            let mut length = u64::from(first & 63);
            for &byte in self.source.exact(further, WHAT)? {
                length = length << 8 | u64::from(byte);
            }
            self.source.skip(length, WHAT)?;
        }
        Ok(())
    }

    /// Passes over the colours of a lookup table.
    pub(super) fn skip_table(&mut self, count: u64) -> Result<(), Error> {
        let scalar = if self.encoding == Encoding::Ascii { Scalar::F32 } else { Scalar::U8 };
        self.skip_numbers(scalar, count.saturating_mul(4), "a lookup table")
    }
}
