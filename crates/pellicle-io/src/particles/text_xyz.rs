//! XYZ as chemistry writes it: a count, a comment, and that many rows `El x y z …`; any number of such frames.
//!
//! Where the comment has `Properties=species:S:1:pos:R:3:velo:R:3` (extended XYZ) it names the columns: `pos` is the
//! position, every other property of numbers an attribute, logical values are 0 and 1; text, such as the species, is
//! passed over. Without, a first column that is no number is passed over, as is an atomic number before exactly three
//! others; the next three columns are the position and the further ones `column4` and so on, counted from 0.
//! Coordinates and real properties are kept in double precision. A file that does not begin with a count is a table
//! like CSV.
//!
//! Source: extended XYZ, <https://github.com/libAtoms/extxyz#extended-xyz-specification-and-parsing-tools>; the plain
//! format has no specification.

use std::path::Path;

use super::{Particles, ReadOptions, csv};
use crate::error::Error;
use crate::formats::names::{self, Group, Groups};
use crate::rows::{Extent, MAX_COLUMNS, Rows, Separator, fields, number, skip_lines};
use crate::scalar::Scalar;
use crate::source::Source;

/// Bytes that a row of three coordinates takes at least: digits and what ends them.
const LEAST: u64 = 6;

pub(crate) fn read(path: &Path, options: &ReadOptions) -> Result<Particles, Error> {
    csv::read(path, options)
}

/// The number of particles, if the line is nothing else.
pub(super) fn count(line: &[u8]) -> Option<Result<u64, String>> {
    let line = line.trim_ascii();
    let digits = line.strip_prefix(b"-").unwrap_or(line);
    if digits.is_empty() || !digits.iter().all(u8::is_ascii_digit) {
        return None;
    }
    let text = String::from_utf8_lossy(line).into_owned();
    Some(text.parse().map_err(|_| format!("{text} is no possible number of particles")))
}

/// Reads the frame that `options` names, of a file whose first line has been read and is `first`.
pub(super) fn read_frames(
    source: &mut Source<'_>,
    first: Result<u64, String>,
    options: &ReadOptions,
) -> Result<Particles, Error> {
    let mut announced = first;
    let mut frame = 0;
    loop {
        let particles = announced.map_err(|what| source.fail(what))?;
        source.room(particles, LEAST, "particles")?;
        let comment = source.line()?.map(<[u8]>::to_vec);
        let Some(comment) = comment else { return Err(source.cut("the comment behind the number of particles")) };
        if frame == options.frame {
            return read_frame(source, particles, &comment, options);
        }
        skip_lines(source, particles, "the rows of particles")?;
        frame += 1;
        announced = loop {
            let Some(line) = source.line()? else {
                let what = format!("there is no frame {}: the frames are 0 to {}", options.frame, frame - 1);
                return Err(source.unsupported(what));
            };
            if line.trim_ascii().is_empty() {
                continue;
            }
            let parsed = count(line);
            break parsed
                .unwrap_or_else(|| Err("this is no number of particles, which must follow behind a frame".into()));
        };
    }
}

fn read_frame(
    source: &mut Source<'_>,
    particles: u64,
    comment: &[u8],
    options: &ReadOptions,
) -> Result<Particles, Error> {
    let path = source.path().to_owned();
    let comment = String::from_utf8_lossy(comment).into_owned();
    let rows = match value(&comment, "Properties") {
        Some(properties) => extended(source, properties, options)?,
        None => {
            let bytes = source.peek(64 << 10)?;
            let end = bytes.iter().position(|&b| b == b'\n').unwrap_or(bytes.len());
            let row = if particles == 0 { b"X 0 0 0".to_vec() } else { bytes[..end].to_vec() };
            classic(source, &row, options)?
        }
    };
    let capacity = source.room(particles, LEAST, "particles")?;
    let mut table = rows.table(&path, options, capacity)?;
    rows.read(source, Extent::Lines(particles), &mut table)?;
    Ok(table.finish())
}

/// The columns by their number and by what the first row holds.
fn classic(source: &Source<'_>, row: &[u8], options: &ReadOptions) -> Result<Rows, Error> {
    let numeric: Vec<bool> = fields(row, Separator::Blank).map(|f| number(f, Separator::Blank).is_some()).collect();
    let columns = numeric.len();
    let first = usize::from(columns == 4 || numeric.first() == Some(&false));
    if !(first + 3..=MAX_COLUMNS).contains(&columns) || numeric[first..first + 3].contains(&false) {
        return Err(source.fail_ahead(1, "a row of XYZ is: element, x, y, z"));
    }
    let names: Vec<String> = (0..columns)
        .map(|i| match i.checked_sub(first) {
            Some(axis @ 0..3) => ["x", "y", "z"][axis].to_owned(),
            _ => format!("column{i}"),
        })
        .collect();
    let usable: Vec<usize> = (first..columns).filter(|&i| numeric[i]).collect();
    csv::rows_of(source, Separator::Blank, &names, &vec![Scalar::F64; columns], &usable, options)
}

/// The columns as the comment names them.
fn extended(source: &Source<'_>, properties: &str, options: &ReadOptions) -> Result<Rows, Error> {
    let parts: Vec<&str> = properties.split(':').collect();
    let mut scalars = Vec::new();
    let mut groups = Groups { position: None, attributes: Vec::new() };
    for part in parts.chunks(3) {
        let (&[name, kind, _], Some(width)) = (part, part.get(2).and_then(|w| w.parse::<usize>().ok())) else {
            let what = format!("the Properties '{properties}' are not triples name:type:columns");
            return Err(source.fail(what));
        };
        if width == 0 || width > MAX_COLUMNS - scalars.len().min(MAX_COLUMNS) {
            return Err(source.fail(format!("'{name}' has {width} columns: 1 to {MAX_COLUMNS} in all are possible")));
        }
        let columns: Vec<usize> = (scalars.len()..scalars.len() + width).collect();
        let scalar = match kind {
            "R" => Scalar::F64,
            "I" | "L" | "S" => Scalar::I64,
            _ => return Err(source.fail(format!("'{name}' has the type '{kind}': R, I, L and S are known"))),
        };
        scalars.extend(std::iter::repeat_n(scalar, width));
        if let (true, "R", Ok(position)) = (names::is_position(name), kind, <[usize; 3]>::try_from(columns.as_slice()))
        {
            groups.position = Some(position);
        } else if kind != "S" {
            groups.attributes.push(Group { name: names::canonical(name, width), original: name.into(), columns });
        }
    }
    let Some(position) = groups.position else {
        return Err(source.fail(format!("the Properties '{properties}' have no pos:R:3")));
    };
    Rows::new(source.path(), Separator::Blank, &scalars, position, groups, options)
}

/// The value of `key=value` in a comment, without quotes.
fn value<'a>(comment: &'a str, key: &str) -> Option<&'a str> {
    let mut rest = comment;
    loop {
        let at = rest.find(key)?;
        let is_start = rest[..at].chars().next_back().is_none_or(char::is_whitespace);
        rest = &rest[at + key.len()..];
        if let (true, Some(value)) = (is_start, rest.trim_start().strip_prefix('=')) {
            let value = value.trim_start();
            return match value.strip_prefix('"') {
                Some(quoted) => quoted.split('"').next(),
                None => value.split_whitespace().next(),
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_found_by_their_whole_key() {
        let comment = "Lattice=\"1 0 0 0 1 0 0 0 1\" MyProperties=a Properties=species:S:1:pos:R:3 pbc=\"T T T\"";
        assert_eq!(value(comment, "Properties"), Some("species:S:1:pos:R:3"));
        assert_eq!(value(comment, "pbc"), Some("T T T"));
        assert_eq!(value(comment, "none"), None);
    }

    #[test]
    fn a_count_is_nothing_but_digits() {
        assert_eq!(count(b" 12\t"), Some(Ok(12)));
        assert!(count(b"-3").is_some_and(|c| c.is_err()));
        assert!(count(b"99999999999999999999999").is_some_and(|c| c.is_err()));
        assert_eq!(count(b"1 2 3"), None);
        assert_eq!(count(b"1.5"), None);
        assert_eq!(count(b""), None);
    }
}
