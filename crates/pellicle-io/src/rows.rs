//! Rows of numbers in text, many at a time: what CSV, XYZ and LAMMPS dumps have in common.
//!
//! The source is looked at in batches that end with a line; a batch is cut into chunks, which threads parse into
//! packed records, and the records are appended in the order of the file. So the result depends on nothing but the
//! file, memory stays at a few batches, and compressed files are parsed as they are inflated. Only the columns that are
//! kept are parsed.

use std::path::Path;

use memchr::{memchr, memchr_iter, memrchr};
use rayon::prelude::*;

use crate::error::Error;
use crate::formats::names::Groups;
use crate::particles::ReadOptions;
use crate::scalar::{Endian, Scalar};
use crate::source::{MAX_LINE, Source};
use crate::table::Table;

/// Columns that a file may have.
pub(crate) const MAX_COLUMNS: usize = 4096;
/// Bytes that are parsed at a time: enough chunks for all threads, and less than a small file's overhead.
const BATCH: usize = 4 << 20;
/// Bytes that a thread parses at a time.
const CHUNK: usize = 128 << 10;

/// How a row is cut into fields.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Separator {
    Byte(u8),
    /// Any number of spaces and tabs.
    Blank,
}

impl Separator {
    fn ends(self, byte: u8) -> bool {
        match self {
            Separator::Byte(separator) => byte == separator,
            Separator::Blank => byte.is_ascii_whitespace(),
        }
    }

    /// Where a comma cannot separate, it may be the decimal mark.
    fn allows_decimal_comma(self) -> bool {
        self != Separator::Byte(b',')
    }
}

/// Cuts a row at its separators. A field in quotes may contain them.
pub(crate) fn fields(row: &[u8], separator: Separator) -> impl Iterator<Item = &[u8]> {
    let mut rest = Some(row);
    std::iter::from_fn(move || {
        let text = match separator {
            Separator::Byte(_) => rest.take()?,
            Separator::Blank => Some(rest.take()?.trim_ascii_start()).filter(|text| !text.is_empty())?,
        };
        let quoted = match text.trim_ascii_start().first() {
            Some(b'"') => {
                let open = text.iter().position(|&b| b == b'"').unwrap_or(0);
                text[open + 1..].iter().position(|&b| b == b'"').map_or(0, |close| open + 1 + close)
            }
            _ => 0,
        };
        let length = text[quoted..].iter().position(|&b| separator.ends(b)).map(|at| quoted + at);
        rest = length.map(|at| &text[at + 1..]);
        let field = text[..length.unwrap_or(text.len())].trim_ascii();
        Some(field.strip_prefix(b"\"").and_then(|f| f.strip_suffix(b"\"")).unwrap_or(field))
    })
}

/// The number that a field holds, if it holds one.
pub(crate) fn number(field: &[u8], separator: Separator) -> Option<f64> {
    let field = field.trim_ascii();
    if let Ok(value) = fast_float2::parse(field) {
        return Some(value);
    }
    if !separator.allows_decimal_comma() || field.len() > 64 {
        return None;
    }
    let comma = memchr(b',', field)?;
    let mut text = [0u8; 64];
    text[..field.len()].copy_from_slice(field);
    text[comma] = b'.';
    fast_float2::parse(&text[..field.len()]).ok()
}

/// Which lines are rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Extent {
    /// All lines to the end that are neither blank nor comments.
    ToEnd,
    /// The next so many lines, without exception.
    Lines(u64),
}

/// A column that is parsed.
#[derive(Debug, Clone, Copy)]
struct Kept {
    /// `F64` or `I64`.
    scalar: Scalar,
    /// An empty field is NaN rather than an error.
    may_be_empty: bool,
}

/// How to turn rows into packed records of the columns that are kept.
pub(crate) struct Rows {
    separator: Separator,
    /// For each column of the file.
    columns: Vec<Option<Kept>>,
    /// What the kept columns mean.
    groups: Groups,
    position: [usize; 3],
    layout: Vec<Scalar>,
}

impl Rows {
    /// For rows of `scalars.len()` columns, each `F64` or `I64`; `groups` says what the columns of the file mean. What
    /// `options` does not ask for is not parsed.
    pub(crate) fn new(
        path: &Path,
        separator: Separator,
        scalars: &[Scalar],
        position: [usize; 3],
        mut groups: Groups,
        options: &ReadOptions,
    ) -> Result<Rows, Error> {
        options.check(path, groups.attributes.iter().map(|g| (g.name.as_str(), g.original.as_str())))?;
        groups.attributes.retain(|g| options.wants(&g.name, &g.original));
        let mut columns = vec![None; scalars.len()];
        let mut keep = |i: usize, may_be_empty: bool| {
            if let (Some(column), Some(&scalar)) = (columns.get_mut(i), scalars.get(i)) {
                *column = Some(Kept { scalar, may_be_empty: may_be_empty && scalar == Scalar::F64 });
            }
        };
        groups.attributes.iter().flat_map(|g| &g.columns).for_each(|&i| keep(i, true));
        position.iter().for_each(|&i| keep(i, false));
        let kept: Vec<usize> = (0..columns.len()).filter(|&i| columns[i].is_some()).collect();
        let renumber = |i: usize| kept.binary_search(&i).unwrap_or(0);
        for column in groups.attributes.iter_mut().flat_map(|g| &mut g.columns) {
            *column = renumber(*column);
        }
        let layout = columns.iter().flatten().map(|kept| kept.scalar).collect();
        Ok(Rows { separator, columns, groups, position: position.map(renumber), layout })
    }

    /// An empty table with room for `rows`.
    pub(crate) fn table(&self, path: &Path, options: &ReadOptions, rows: usize) -> Result<Table, Error> {
        Table::new(path, &self.layout, self.position, &self.groups, options, rows)
    }

    /// Appends the record of one row that was read otherwise.
    pub(crate) fn append_one(&self, source: &Source<'_>, row: &[u8], table: &mut Table) -> Result<(), Error> {
        let mut record = Vec::with_capacity(8 * self.layout.len());
        self.append(row, true, &mut record).map_err(|what| source.fail(what))?;
        table.append(&record, Endian::Little);
        Ok(())
    }

    /// About how many rows like this one can follow, which is no more than what `source` has room for.
    pub(crate) fn estimate(&self, source: &Source<'_>, row: &[u8]) -> usize {
        let bytes = (row.len() as u64 + 1).max(12 * self.layout.len() as u64);
        source.room(source.remaining() / bytes + 1, 1, "rows").unwrap_or(0)
    }

    /// Appends the rows that follow in `source`.
    pub(crate) fn read(&self, source: &mut Source<'_>, extent: Extent, table: &mut Table) -> Result<(), Error> {
        source.widen(BATCH);
        let mut extent = extent;
        while extent != Extent::Lines(0) {
            let batch = batch(source, extent)?;
            if batch.is_empty() {
                let Extent::Lines(missing) = extent else { break };
                return Err(source.cut(&format!("the rows of particles, of which {missing} are missing")));
            }
            let parsed: Vec<Parsed> = chunks(batch).into_par_iter().map(|chunk| self.parse(chunk, extent)).collect();
            let (bytes, mut lines) = (batch.len(), 0);
            for part in parsed {
                if let Some(what) = part.error {
                    return Err(source.fail_ahead(lines + part.lines, what));
                }
                table.append(&part.records, Endian::Little);
                lines += part.lines;
            }
            source.advance_lines(bytes, lines);
            if let Extent::Lines(left) = &mut extent {
                *left -= lines.min(*left);
            }
        }
        Ok(())
    }

    fn parse(&self, chunk: &[u8], extent: Extent) -> Parsed {
        let has_quotes = memchr(b'"', chunk).is_some();
        let mut parsed = Parsed { records: Vec::with_capacity(chunk.len()), lines: 0, error: None };
        let mut rest = chunk;
        while !rest.is_empty() {
            let end = memchr(b'\n', rest);
            let line = trim(&rest[..end.unwrap_or(rest.len())]);
            rest = end.map_or(&[], |end| &rest[end + 1..]);
            parsed.lines += 1;
            if extent == Extent::ToEnd && is_passed_over(line) {
                continue;
            }
            if let Err(what) = self.append(line, has_quotes, &mut parsed.records) {
                parsed.error = Some(what);
                break;
            }
        }
        parsed
    }

    /// Appends the record of a row, or tells what is wrong with it.
    fn append(&self, row: &[u8], has_quotes: bool, out: &mut Vec<u8>) -> Result<(), String> {
        let start = out.len();
        if !has_quotes && self.append_plain(row, out).is_some() {
            return Ok(());
        }
        out.truncate(start);
        self.append_any(row, out)
    }

    /// The common case, as fast as it goes: no quotes, no decimal comma, nothing empty, the right number of columns.
    fn append_plain(&self, row: &[u8], out: &mut Vec<u8>) -> Option<()> {
        let mut rest = row;
        for (i, column) in self.columns.iter().enumerate() {
            if i > 0
                && let Separator::Byte(separator) = self.separator
            {
                let (&first, behind) = rest.split_first()?;
                if first != separator {
                    return None;
                }
                rest = behind;
            }
            while let Some((b' ' | b'\t', behind)) = rest.split_first() {
                // A tab may be the separator, behind which a field is empty.
                if self.separator == Separator::Byte(b'\t') && rest[0] == b'\t' {
                    break;
                }
                rest = behind;
            }
            match column {
                Some(Kept { scalar: Scalar::F64, .. }) => {
                    let (value, length) = fast_float2::parse_partial::<f64, _>(rest).ok()?;
                    out.extend_from_slice(&value.to_le_bytes());
                    rest = &rest[length..];
                }
                _ => {
                    let length = rest.iter().position(|&b| self.separator.ends(b)).unwrap_or(rest.len());
                    let field = &rest[..length];
                    if field.is_empty() {
                        return None;
                    }
                    if column.is_some() {
                        out.extend_from_slice(&integer(field)?.to_le_bytes());
                    }
                    rest = &rest[length..];
                }
            }
            if self.separator != Separator::Blank {
                while let Some((b' ', behind)) = rest.split_first() {
                    rest = behind;
                }
            } else if rest.first().is_some_and(|b| !b.is_ascii_whitespace()) {
                return None;
            }
        }
        rest.trim_ascii().is_empty().then_some(())
    }

    /// Any case, and the message where there is something wrong.
    fn append_any(&self, row: &[u8], out: &mut Vec<u8>) -> Result<(), String> {
        let mut count = 0;
        for field in fields(row, self.separator) {
            if let Some(Some(kept)) = self.columns.get(count) {
                let bytes = match kept.scalar {
                    Scalar::F64 if kept.may_be_empty && field.is_empty() => Some(f64::NAN.to_le_bytes()),
                    Scalar::F64 => number(field, self.separator).map(f64::to_le_bytes),
                    _ => integer(field).map(i64::to_le_bytes),
                };
                let Some(bytes) = bytes else {
                    let field: String = String::from_utf8_lossy(field).chars().take(40).collect();
                    return Err(format!("'{field}' in column {} is not a number", count + 1));
                };
                out.extend_from_slice(&bytes);
            }
            count += 1;
        }
        // Some programs end every row with a separator.
        let expected = self.columns.len();
        let is_ended = count == expected + 1 && fields(row, self.separator).last().is_some_and(<[u8]>::is_empty);
        if count == expected || is_ended {
            return Ok(());
        }
        Err(format!("{count} columns, where {expected} were expected"))
    }
}

/// What a chunk gave: the lines up to the error and including it, if there is one.
struct Parsed {
    records: Vec<u8>,
    lines: u64,
    error: Option<String>,
}

/// A line without the blanks around it. Tabs stay: there may be empty fields before and behind them.
pub(crate) fn trim(line: &[u8]) -> &[u8] {
    let is_kept = |b: &u8| !matches!(b, b' ' | b'\r');
    let start = line.iter().position(is_kept).unwrap_or(line.len());
    let end = line.iter().rposition(is_kept).map_or(start, |last| last + 1);
    &line[start..end]
}

/// Whether the line is no row: blank or a comment.
pub(crate) fn is_passed_over(line: &[u8]) -> bool {
    matches!(line.trim_ascii_start().first(), None | Some(b'#' | b'%'))
}

/// An integer; logical values of extended XYZ are `T` and `F`.
fn integer(field: &[u8]) -> Option<i64> {
    match field {
        b"T" | b"True" | b"TRUE" | b"true" => return Some(1),
        b"F" | b"False" | b"FALSE" | b"false" => return Some(0),
        _ => {}
    }
    let text = std::str::from_utf8(field).ok()?;
    if let Ok(value) = text.parse() {
        return Some(value);
    }
    // Some programs write integers as 3.0.
    let value: f64 = text.parse().ok()?;
    (value.fract() == 0.0 && value.abs() < 9.0e15).then_some(value as i64)
}

/// The next bytes that end with a line, or with the file; no more lines than `extent` allows.
fn batch<'a>(source: &'a mut Source<'_>, extent: Extent) -> Result<&'a [u8], Error> {
    let length = {
        let bytes = source.peek(BATCH)?;
        let whole = if bytes.len() < BATCH { Some(bytes.len()) } else { memrchr(b'\n', bytes).map(|at| at + 1) };
        whole.map(|length| match extent {
            Extent::ToEnd => length,
            Extent::Lines(limit) => {
                let last = usize::try_from(limit - 1).ok().and_then(|n| memchr_iter(b'\n', &bytes[..length]).nth(n));
                last.map_or(length, |at| at + 1)
            }
        })
    };
    match length {
        Some(length) => Ok(&source.peek(BATCH)?[..length]),
        None => Err(source.fail_ahead(1, format!("more than {MAX_LINE} bytes without a line end: this is not text"))),
    }
}

/// Passes over `count` lines, which must be there.
pub(crate) fn skip_lines(source: &mut Source<'_>, count: u64, what: &str) -> Result<(), Error> {
    source.widen(BATCH);
    let mut left = count;
    while left > 0 {
        let batch = batch(source, Extent::Lines(left))?;
        let (bytes, mut lines) = (batch.len(), memchr_iter(b'\n', batch).count() as u64);
        // The last line of a file needs no end.
        lines += u64::from(batch.last().is_some_and(|&b| b != b'\n'));
        if bytes == 0 {
            return Err(source.cut(what));
        }
        source.advance_lines(bytes, lines);
        left -= lines.min(left);
    }
    Ok(())
}

/// Cuts a batch into chunks that end with a line.
fn chunks(batch: &[u8]) -> Vec<&[u8]> {
    let mut chunks = Vec::with_capacity(batch.len() / CHUNK + 1);
    let mut rest = batch;
    while rest.len() > CHUNK {
        let Some(end) = memchr(b'\n', &rest[CHUNK..]) else { break };
        let (chunk, behind) = rest.split_at(CHUNK + end + 1);
        chunks.push(chunk);
        rest = behind;
    }
    chunks.push(rest);
    chunks
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(separator: Separator, columns: usize) -> Rows {
        let groups = Groups { position: None, attributes: Vec::new() };
        let scalars = vec![Scalar::F64; columns];
        let path = Path::new("a");
        Rows::new(path, separator, &scalars, [0, 1, 2], groups, &ReadOptions::default()).expect("three columns")
    }

    #[test]
    fn the_fast_way_and_the_general_one_agree_wherever_the_fast_one_answers() {
        let cases: [(&str, Separator, bool); 12] = [
            ("1,2,3", Separator::Byte(b','), true),
            ("1 , 2 , 3e-3", Separator::Byte(b','), true),
            ("1\t2\t3", Separator::Byte(b'\t'), true),
            ("1;2;3", Separator::Byte(b';'), true),
            ("  1 \t 2   3", Separator::Blank, true),
            ("nan inf -inf", Separator::Blank, true),
            ("1,5;2,5;3,5", Separator::Byte(b';'), false),
            ("1,2", Separator::Byte(b','), false),
            ("1,2,3,4", Separator::Byte(b','), false),
            ("1,,3", Separator::Byte(b','), false),
            ("1 2 3x", Separator::Blank, false),
            ("1,2,3,", Separator::Byte(b','), false),
        ];
        for (row, separator, is_fast) in cases {
            let rows = rows(separator, 3);
            let (mut fast, mut general) = (Vec::new(), Vec::new());
            let answer = rows.append_plain(row.as_bytes(), &mut fast);
            assert_eq!(answer.is_some(), is_fast, "{row}");
            let result = rows.append_any(row.as_bytes(), &mut general);
            if is_fast {
                assert_eq!(result, Ok(()), "{row}");
                assert_eq!(fast, general, "{row}");
            }
        }
    }

    #[test]
    fn a_comma_is_a_decimal_mark_where_it_does_not_separate() {
        assert_eq!(number(b"1,5", Separator::Byte(b';')), Some(1.5));
        assert_eq!(number(b"-2,5e3", Separator::Blank), Some(-2500.0));
        assert_eq!(number(b"1,5", Separator::Byte(b',')), None);
        assert_eq!(number(b"1,234.5", Separator::Byte(b';')), None);
        assert_eq!(number(b"", Separator::Blank), None);
    }
}
