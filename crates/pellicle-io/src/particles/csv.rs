//! Tables in text: CSV and its relatives.
//!
//! The separator is the first of semicolon, tab, comma and space that occurs in the first row. If that row holds
//! anything but numbers it names the columns: x, y, z in any case (or ParaView's `Points:0` and so on) are the
//! position, vx, vy, vz the velocity. Without names the first three columns are the position, and the further ones
//! `column3` and so on. Lines that begin with `#` are comments, except that the first may name the columns. A column
//! that holds no number in its first row is passed over. Numbers are kept in double precision.

use std::path::Path;

use super::{Particles, ReadOptions};
use crate::error::Error;
use crate::formats::names::{self, Groups};
use crate::scalar::{Endian, Scalar};
use crate::source::Source;
use crate::table::Table;

/// Columns that a file may have.
const MAX_COLUMNS: usize = 4096;
/// Bytes of decoded rows that are handed on at a time.
const RUN: usize = 64 << 10;

/// How a row is cut into fields.
#[derive(Clone, Copy, PartialEq)]
enum Separator {
    Byte(u8),
    /// Any number of spaces and tabs.
    Blank,
}

pub(crate) fn read(path: &Path, options: &ReadOptions) -> Result<Particles, Error> {
    let mut source = Source::open(path)?;
    source.set_text(true);
    if source.peek(3)?.starts_with(b"\xef\xbb\xbf") {
        source.advance(3);
    }
    let Some(mut row) = first_row(&mut source)? else { return empty(path, options) };
    let separator = separator(&row);
    let mut names = None;
    if !is_numeric(&row, separator) {
        names = Some(column_names(&source, &row, separator)?);
        let Some(next) = next_row(&mut source)? else {
            return named_but_empty(&source, path, options, names.as_deref());
        };
        row = next;
    }
    let reader = RowReader::new(&source, &row, separator, names, options)?;
    reader.read(&mut source, path, &row, options)
}

/// A file without rows holds no particles.
fn empty(path: &Path, options: &ReadOptions) -> Result<Particles, Error> {
    let none = Groups { position: Some([0, 1, 2]), attributes: Vec::new() };
    Ok(Table::new(path, &[Scalar::F64; 3], [0, 1, 2], &none, options, 0)?.finish())
}

fn named_but_empty(
    source: &Source<'_>,
    path: &Path,
    options: &ReadOptions,
    names: Option<&[String]>,
) -> Result<Particles, Error> {
    let names = names.unwrap_or_default();
    let groups = names::group(names);
    let position = groups.position.ok_or_else(|| no_position(source, names))?;
    Ok(Table::new(path, &vec![Scalar::F64; names.len()], position, &groups, options, 0)?.finish())
}

fn no_position(source: &Source<'_>, names: &[String]) -> Error {
    source.fail(format!("no columns are named x, y and z; the columns are: {}", names.join(", ")))
}

/// The first line that is not blank; as it may name the columns in a comment, its `#` is dropped.
fn first_row(source: &mut Source<'_>) -> Result<Option<Vec<u8>>, Error> {
    while let Some(line) = source.line()? {
        let line = line.trim_ascii();
        if line.contains(&0) {
            return Err(source.fail("there are zero bytes: this is not text"));
        }
        let Some(comment) = line.strip_prefix(b"#") else {
            if line.is_empty() {
                continue;
            }
            return Ok(Some(line.to_vec()));
        };
        let comment = comment.trim_ascii();
        let names: Vec<String> = fields(comment, separator(comment)).map(name).collect();
        if names::group(&names).position.is_some() {
            return Ok(Some(comment.to_vec()));
        }
    }
    Ok(None)
}

/// The next line that is neither blank nor a comment.
fn next_row(source: &mut Source<'_>) -> Result<Option<Vec<u8>>, Error> {
    while let Some(line) = source.line()? {
        let line = line.trim_ascii();
        if !line.is_empty() && !line.starts_with(b"#") {
            return Ok(Some(line.to_vec()));
        }
    }
    Ok(None)
}

fn separator(row: &[u8]) -> Separator {
    for byte in [b';', b'\t', b','] {
        if row.contains(&byte) {
            return Separator::Byte(byte);
        }
    }
    Separator::Blank
}

/// Cuts a row at its separators. A field in quotes may contain them.
fn fields(row: &[u8], separator: Separator) -> impl Iterator<Item = &[u8]> {
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
        let ends = |&b: &u8| match separator {
            Separator::Byte(byte) => b == byte,
            Separator::Blank => b.is_ascii_whitespace(),
        };
        let length = text[quoted..].iter().position(ends).map(|at| quoted + at);
        rest = length.map(|at| &text[at + 1..]);
        let field = text[..length.unwrap_or(text.len())].trim_ascii();
        Some(field.strip_prefix(b"\"").and_then(|f| f.strip_suffix(b"\"")).unwrap_or(field))
    })
}

fn number(field: &[u8]) -> Option<f64> {
    std::str::from_utf8(field).ok()?.trim().parse().ok()
}

fn is_numeric(row: &[u8], separator: Separator) -> bool {
    fields(row, separator).all(|field| field.is_empty() || number(field).is_some())
}

fn name(field: &[u8]) -> String {
    String::from_utf8_lossy(field).trim().to_owned()
}

fn column_names(source: &Source<'_>, row: &[u8], separator: Separator) -> Result<Vec<String>, Error> {
    let names: Vec<String> = fields(row, separator).map(name).collect();
    if names.len() > MAX_COLUMNS {
        return Err(source.fail(format!("{} columns: the limit is {MAX_COLUMNS}", names.len())));
    }
    if names::group(&names).position.is_none() {
        return Err(no_position(source, &names));
    }
    Ok(names)
}

/// Turns rows into packed records of the columns that are kept.
struct RowReader {
    separator: Separator,
    columns: usize,
    /// Whether each column of the file is kept.
    is_kept: Vec<bool>,
    /// What the kept columns mean.
    groups: Groups,
}

impl RowReader {
    /// `row` is the first one with numbers; a column without one there is no column of numbers.
    fn new(
        source: &Source<'_>,
        row: &[u8],
        separator: Separator,
        names: Option<Vec<String>>,
        options: &ReadOptions,
    ) -> Result<RowReader, Error> {
        let is_number: Vec<bool> = fields(row, separator).map(|f| f.is_empty() || number(f).is_some()).collect();
        let columns = names.as_ref().map_or(is_number.len(), Vec::len);
        if !(3..=MAX_COLUMNS).contains(&columns) {
            return Err(source.fail(format!("{columns} columns: a position takes three")));
        }
        let names = names.unwrap_or_else(|| {
            ["x", "y", "z"].map(String::from).into_iter().chain((3..columns).map(|i| format!("column{i}"))).collect()
        });
        let usable: Vec<usize> = (0..columns).filter(|&i| is_number.get(i).copied().unwrap_or(false)).collect();
        let usable_names: Vec<String> = usable.iter().map(|&i| names[i].clone()).collect();
        let mut groups = names::group(&usable_names);
        let Some(position) = groups.position else {
            return Err(source.fail("the columns of the position do not hold numbers"));
        };
        options.check(source.path(), groups.attributes.iter().map(|g| (g.name.as_str(), g.original.as_str())))?;
        groups.attributes.retain(|g| options.wants(&g.name, &g.original));
        let mut is_kept = vec![false; columns];
        for &i in position.iter().chain(groups.attributes.iter().flat_map(|g| &g.columns)) {
            is_kept[usable[i]] = true;
        }
        // From the number among the usable columns to the number among the kept ones.
        let kept: Vec<usize> = (0..columns).filter(|&i| is_kept[i]).collect();
        let renumber = |i: usize| kept.binary_search(&usable[i]).unwrap_or(0);
        groups.position = Some(position.map(renumber));
        for column in groups.attributes.iter_mut().flat_map(|g| &mut g.columns) {
            *column = renumber(*column);
        }
        Ok(RowReader { separator, columns, is_kept, groups })
    }

    fn read(
        &self,
        source: &mut Source<'_>,
        path: &Path,
        first: &[u8],
        options: &ReadOptions,
    ) -> Result<Particles, Error> {
        let kept = self.is_kept.iter().filter(|&&kept| kept).count();
        let layout = vec![Scalar::F64; kept];
        let position = self.groups.position.unwrap_or([0, 1, 2]);
        // The first row tells about how many will follow; short ones may come, so this is no more than a start.
        let rows = source.remaining() / (first.len() as u64 + 1).max(12 * kept as u64) + 1;
        let mut table = Table::new(path, &layout, position, &self.groups, options, source.room(rows, 1, "rows")?)?;
        let mut run = Vec::with_capacity(RUN + 8 * kept);
        self.append(first, &mut run).map_err(|what| source.fail(what))?;
        while let Some(line) = source.line()? {
            let line = line.trim_ascii();
            if line.is_empty() || line.starts_with(b"#") {
                continue;
            }
            if let Err(what) = self.append(line, &mut run) {
                return Err(source.fail(what));
            }
            if run.len() >= RUN {
                table.append(&run, Endian::Little);
                run.clear();
            }
        }
        table.append(&run, Endian::Little);
        Ok(table.finish())
    }

    /// Appends the record of a row, or tells what is wrong with it.
    fn append(&self, row: &[u8], run: &mut Vec<u8>) -> Result<(), String> {
        let mut count = 0;
        for field in fields(row, self.separator) {
            if self.is_kept.get(count).copied().unwrap_or(false) {
                let Some(value) = number(field) else {
                    let field: String = String::from_utf8_lossy(field).chars().take(40).collect();
                    return Err(format!("'{field}' in column {} is not a number", count + 1));
                };
                run.extend_from_slice(&value.to_le_bytes());
            }
            count += 1;
        }
        // Some programs end every row with a separator.
        let is_ended = count == self.columns + 1 && fields(row, self.separator).last().is_some_and(<[u8]>::is_empty);
        if count == self.columns || is_ended {
            return Ok(());
        }
        Err(format!("{count} columns, where {} were expected", self.columns))
    }
}
