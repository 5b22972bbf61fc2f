//! Tables in text: CSV and its relatives.
//!
//! The separator is the first of semicolon, tab, bar, comma and blank that occurs in the first row, or else the first
//! character that stands in no name and no number; where it is not the comma, a comma is a decimal mark. If the first row holds anything but numbers it names the columns: x, y, z in any
//! case (or ParaView's `Points:0` and so on) are the position, vx, vy, vz the velocity. Without names the first three
//! columns are the position, and the further ones `column3` and so on. Lines that begin with `#` or `%` are comments,
//! except that the first may name the columns. A column that holds no number in its first row is passed over; an empty
//! field of an attribute is NaN. Numbers are kept in double precision. A file whose first row is one integer is XYZ.
//!
//! Source: RFC 4180 for commas and quotes; the rest is what spreadsheets, ParaView, pandas and numpy.savetxt write.

use std::path::Path;

use super::{Particles, ReadOptions, text_xyz};
use crate::error::Error;
use crate::formats::names;
use crate::rows::{Extent, MAX_COLUMNS, Rows, Separator, fields, is_passed_over, number, trim};
use crate::scalar::Scalar;
use crate::source::Source;

pub(crate) fn read(path: &Path, options: &ReadOptions) -> Result<Particles, Error> {
    options.refuse_array(path, "text")?;
    let mut source = Source::open_text(path)?;
    let Some(row) = first_row(&mut source)? else {
        options.refuse_frame(path, "an empty file")?;
        return empty(path, options);
    };
    if let Some(count) = text_xyz::count(&row) {
        return text_xyz::read_frames(&mut source, count, options);
    }
    options.refuse_frame(path, "a table of text")?;
    read_table(&mut source, row, options)
}

fn read_table(source: &mut Source<'_>, first: Vec<u8>, options: &ReadOptions) -> Result<Particles, Error> {
    let path = source.path().to_owned();
    let separator = separator(&first);
    if is_numeric(&first, separator) {
        let rows = rows(source, &first, separator, None, options)?;
        return read_rows(source, &rows, &first, &path, options);
    }
    let names = column_names(source, &first, separator)?;
    let Some(row) = next_row(source)? else {
        let groups = names::group(&names);
        let scalars = vec![Scalar::F64; names.len()];
        let position = groups.position.ok_or_else(|| no_position(source, &names))?;
        return Ok(Rows::new(&path, separator, &scalars, position, groups, options)?
            .table(&path, options, 0)?
            .finish());
    };
    let rows = rows(source, &row, separator, Some(names), options)?;
    read_rows(source, &rows, &row, &path, options)
}

fn read_rows(
    source: &mut Source<'_>,
    rows: &Rows,
    first: &[u8],
    path: &Path,
    options: &ReadOptions,
) -> Result<Particles, Error> {
    // The first row tells about how many will follow; short ones may come, so this is no more than a start.
    let mut table = rows.table(path, options, rows.estimate(source, first))?;
    rows.append_one(source, first, &mut table)?;
    rows.read(source, Extent::ToEnd, &mut table)?;
    Ok(table.finish())
}

/// A file without rows holds no particles.
fn empty(path: &Path, options: &ReadOptions) -> Result<Particles, Error> {
    let none = names::group(&["x", "y", "z"].map(String::from));
    let rows = Rows::new(path, Separator::Blank, &[Scalar::F64; 3], [0, 1, 2], none, options)?;
    Ok(rows.table(path, options, 0)?.finish())
}

fn no_position(source: &Source<'_>, names: &[String]) -> Error {
    source.fail(format!("no columns are named x, y and z; the columns are: {}", names.join(", ")))
}

/// The first line that is not blank; as it may name the columns in a comment, its `#` is dropped.
fn first_row(source: &mut Source<'_>) -> Result<Option<Vec<u8>>, Error> {
    while let Some(line) = source.line()? {
        let line = trim(line);
        if line.contains(&0) {
            return Err(source.fail("there are zero bytes: this is not text"));
        }
        if !is_passed_over(line) {
            return Ok(Some(line.to_vec()));
        }
        let comment = line.trim_ascii();
        let comment =
            comment.strip_prefix(b"#").or_else(|| comment.strip_prefix(b"%")).unwrap_or_default().trim_ascii();
        let names: Vec<String> = fields(comment, separator(comment)).take(MAX_COLUMNS).map(name).collect();
        if names::group(&names).position.is_some() {
            return Ok(Some(comment.to_vec()));
        }
    }
    Ok(None)
}

/// The next line that is neither blank nor a comment.
fn next_row(source: &mut Source<'_>) -> Result<Option<Vec<u8>>, Error> {
    while let Some(line) = source.line()? {
        let line = trim(line);
        if !is_passed_over(line) {
            return Ok(Some(line.to_vec()));
        }
    }
    Ok(None)
}

fn separator(row: &[u8]) -> Separator {
    let usual = [b';', b'\t', b'|', b',', b' '].into_iter().find(|byte| row.contains(byte));
    let unusual =
        || row.iter().copied().find(|b| b.is_ascii() && !b.is_ascii_alphanumeric() && !b"+-._\"'[]()".contains(b));
    let found = usual.or_else(unusual).filter(|&byte| byte != b' ');
    // Blanks and tabs may be mixed, or several tabs align numbers, unless there are names.
    let has_blanks = |field: &[u8]| field.is_empty() || field.iter().any(u8::is_ascii_whitespace);
    match found {
        Some(b'\t') if fields(row, Separator::Byte(b'\t')).any(has_blanks) && is_numeric(row, Separator::Blank) => {
            Separator::Blank
        }
        Some(byte) => Separator::Byte(byte),
        None => Separator::Blank,
    }
}

fn is_number(field: &[u8], separator: Separator) -> bool {
    field.is_empty() || number(field, separator).is_some()
}

fn is_numeric(row: &[u8], separator: Separator) -> bool {
    fields(row, separator).all(|field| is_number(field, separator))
}

fn name(field: &[u8]) -> String {
    String::from_utf8_lossy(field).trim().to_owned()
}

fn column_names(source: &Source<'_>, row: &[u8], separator: Separator) -> Result<Vec<String>, Error> {
    let named = fields(row, separator).map(name).enumerate();
    // Indices that pandas writes have no name.
    let names: Vec<String> = named.map(|(i, name)| if name.is_empty() { format!("column{i}") } else { name }).collect();
    if names.len() > MAX_COLUMNS {
        return Err(source.fail(format!("{} columns: the limit is {MAX_COLUMNS}", names.len())));
    }
    if names::group(&names).position.is_none() {
        return Err(no_position(source, &names));
    }
    Ok(names)
}

/// `row` is the first one with numbers; a column without one there is no column of numbers.
fn rows(
    source: &Source<'_>,
    row: &[u8],
    separator: Separator,
    names: Option<Vec<String>>,
    options: &ReadOptions,
) -> Result<Rows, Error> {
    let is_number: Vec<bool> = fields(row, separator).map(|field| is_number(field, separator)).collect();
    let columns = names.as_ref().map_or(is_number.len(), Vec::len);
    if !(3..=MAX_COLUMNS).contains(&columns) {
        return Err(source.fail(format!("{columns} columns: a position takes three")));
    }
    let names = names.unwrap_or_else(|| {
        ["x", "y", "z"].map(String::from).into_iter().chain((3..columns).map(|i| format!("column{i}"))).collect()
    });
    let usable: Vec<usize> = (0..columns).filter(|&i| is_number.get(i).copied().unwrap_or(false)).collect();
    rows_of(source, separator, &names, &vec![Scalar::F64; columns], &usable, options)
}

/// Rows of columns with names, of which only those in `usable` hold numbers.
pub(super) fn rows_of(
    source: &Source<'_>,
    separator: Separator,
    names: &[String],
    scalars: &[Scalar],
    usable: &[usize],
    options: &ReadOptions,
) -> Result<Rows, Error> {
    let usable_names: Vec<String> = usable.iter().map(|&i| names[i].clone()).collect();
    let mut groups = names::group(&usable_names);
    let Some(position) = groups.position else {
        return Err(source.fail("the columns of the position do not hold numbers"));
    };
    for column in groups.attributes.iter_mut().flat_map(|g| &mut g.columns) {
        *column = usable[*column];
    }
    Rows::new(source.path(), separator, scalars, position.map(|i| usable[i]), groups, options)
}
