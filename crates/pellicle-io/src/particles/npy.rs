//! NumPy arrays: N × k numbers, of which the first three columns are the position.
//!
//! Columns: x y z, then for k = 4 density, for k = 6 velocity, for k = 7 velocity and density; for any other k the
//! further ones are named `column3` and so on. `f32` triples in C order, the common case, are read in place.
//!
//! Source: the NPY format, versions 1.0 to 3.0, <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>.

use std::path::Path;

use super::{AttributeValues, ParticleAttribute, Particles, PositionData, ReadOptions, xyz};
use crate::error::Error;
use crate::formats::detect;
use crate::formats::names::{Group, Groups};
use crate::scalar::{Encoding, Endian, Field, Records, Scalar};
use crate::source::{self, Source};
use crate::table::Table;

const MAGIC: &[u8] = b"\x93NUMPY";

/// What the header says.
#[derive(Debug, PartialEq)]
struct Header {
    scalar: Scalar,
    endian: Endian,
    is_fortran: bool,
    rows: u64,
    columns: usize,
}

pub(crate) fn read(path: &Path, options: &ReadOptions) -> Result<Particles, Error> {
    let mut source = Source::open(path)?;
    let header = read_header(&mut source)?;
    let layout = vec![header.scalar; header.columns];
    let record = header.scalar.size() as u64 * header.columns as u64;
    let rows = source.room(header.rows, record, "rows")?;
    let groups = columns(header.columns);
    if header.columns == 3 && header.endian == Endian::Little && !header.is_fortran {
        options.check(path, std::iter::empty())?;
        return Ok(Particles { positions: read_in_place(&source, header.scalar, rows)?, attributes: Vec::new() });
    }
    if header.is_fortran {
        return read_columns(&mut source, &header, rows, &groups, options);
    }
    let mut table = Table::new(path, &layout, [0, 1, 2], &groups, options, rows)?;
    source.records(Encoding::Binary(header.endian), &layout, header.rows, "rows", |bytes, endian| {
        table.append(bytes, endian);
        Ok(())
    })?;
    Ok(table.finish())
}

fn read_in_place(source: &Source<'_>, scalar: Scalar, rows: usize) -> Result<PositionData, Error> {
    let (file, _) = source::open(source.path())?;
    xyz::read_positions(source.path(), &file, source.offset(), rows, scalar == Scalar::F64)
}

/// Reads an array in Fortran order: all x, then all y, and so on.
fn read_columns(
    source: &mut Source<'_>,
    header: &Header,
    rows: usize,
    groups: &Groups,
    options: &ReadOptions,
) -> Result<Particles, Error> {
    let named = groups.attributes.iter().map(|g| (g.name.as_str(), g.original.as_str()));
    options.check(source.path(), named)?;
    let mut positions = match header.scalar {
        Scalar::F32 => PositionData::F32(vec![[0.0; 3]; rows]),
        _ => PositionData::F64(vec![[0.0; 3]; rows]),
    };
    for axis in 0..3 {
        read_column(source, header, |first, records, field| positions.set(first, axis, records, field))?;
    }
    let mut attributes = Vec::new();
    for group in &groups.attributes {
        if !options.wants(&group.name, &group.original) {
            source.skip(header.rows * (header.scalar.size() * group.columns.len()) as u64, "rows")?;
            continue;
        }
        let components = group.columns.len();
        let mut values = AttributeValues::of([header.scalar], 0);
        values.resize(rows * components);
        for component in 0..components {
            read_column(source, header, |first, records, field| {
                values.set(first * components, (component, components), records, field);
            })?;
        }
        attributes.push(ParticleAttribute { name: group.name.clone(), components, values });
    }
    Ok(Particles { positions, attributes })
}

/// Hands out runs of the next column, each with the row that it begins with.
fn read_column(
    source: &mut Source<'_>,
    header: &Header,
    mut each: impl FnMut(usize, Records<'_>, Field),
) -> Result<(), Error> {
    let stride = header.scalar.size();
    let field = Field { offset: 0, scalar: header.scalar };
    let mut first = 0;
    source.records(Encoding::Binary(header.endian), &[header.scalar], header.rows, "rows", |bytes, endian| {
        let records = Records { bytes, stride, endian };
        each(first, records, field);
        first += records.len();
        Ok(())
    })
}

/// The meaning of the columns after the third.
fn columns(count: usize) -> Groups {
    let group = |name: String, columns: Vec<usize>| Group { original: name.clone(), name, columns };
    let velocity = || group("velocity".into(), vec![3, 4, 5]);
    let attributes = match count {
        4 => vec![group("density".into(), vec![3])],
        6 => vec![velocity()],
        7 => vec![velocity(), group("density".into(), vec![6])],
        _ => (3..count).map(|i| group(format!("column{i}"), vec![i])).collect(),
    };
    Groups { position: Some([0, 1, 2]), attributes }
}

fn read_header(source: &mut Source<'_>) -> Result<Header, Error> {
    let head = source.peek(8)?;
    if !head.starts_with(MAGIC) {
        let what = detect::mismatch("a NumPy array", head);
        return Err(source.fail(what));
    }
    let prefix = source.exact(8, "the header")?;
    let major = prefix[6];
    let length = match major {
        1 => {
            let bytes = source.exact(2, "the header")?;
            u64::from(u16::from_le_bytes([bytes[0], bytes[1]]))
        }
        2 | 3 => {
            let bytes = source.exact(4, "the header")?;
            u64::from(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
        }
        _ => return Err(source.unsupported(format!("NPY version {major} is not known: 1, 2 and 3 are read"))),
    };
    if length > 64 << 10 {
        return Err(source.fail(format!("a header of {length} bytes: the limit is 65536")));
    }
    let text = String::from_utf8_lossy(source.exact(length as usize, "the header")?).into_owned();
    parse_header(source, &text)
}

/// Parses the dictionary `{'descr': '<f4', 'fortran_order': False, 'shape': (10, 3), }`.
fn parse_header(source: &Source<'_>, text: &str) -> Result<Header, Error> {
    let value = |key: &str| {
        let at = text.find(&format!("'{key}'")).or_else(|| text.find(&format!("\"{key}\"")));
        let rest = at.and_then(|at| text[at + key.len() + 2..].trim_start().strip_prefix(':')).map(str::trim_start);
        rest.ok_or_else(|| source.fail(format!("the header has no '{key}'")))
    };
    let (scalar, endian) = parse_type(source, value("descr")?)?;
    let is_fortran = value("fortran_order")?.starts_with("True");
    let shape = value("shape")?;
    let inner = shape.strip_prefix('(').and_then(|s| s.split_once(')')).map(|(inner, _)| inner);
    let Some(inner) = inner else { return Err(source.fail("the header's 'shape' is not a tuple")) };
    let parsed: Result<Vec<u64>, _> =
        inner.split(',').map(str::trim).filter(|s| !s.is_empty()).map(|s| s.trim_end_matches('L').parse()).collect();
    match parsed.as_deref() {
        Ok(&[rows, columns @ 3..=4096]) => Ok(Header { scalar, endian, is_fortran, rows, columns: columns as usize }),
        Ok(shape) => Err(source.unsupported(format!(
            "the array has the shape {shape:?}: particles are N rows of at least 3 columns x, y, z"
        ))),
        Err(_) => Err(source.fail(format!("the header's 'shape' ({inner}) is not made of numbers"))),
    }
}

fn parse_type(source: &Source<'_>, text: &str) -> Result<(Scalar, Endian), Error> {
    if text.starts_with('[') {
        let what = "this is a structured array, which is not read: save the positions by themselves, as N x 3 floats";
        return Err(source.unsupported(what));
    }
    let name = text.get(1..).and_then(|t| t.split_once(['\'', '"'])).map_or("", |(name, _)| name);
    let native = if cfg!(target_endian = "big") { Endian::Big } else { Endian::Little };
    let (endian, rest) = match name.split_at_checked(1) {
        Some(("<", rest)) => (Endian::Little, rest),
        Some((">", rest)) => (Endian::Big, rest),
        Some(("=" | "|", rest)) => (native, rest),
        _ => (native, name),
    };
    match rest {
        "f4" => Ok((Scalar::F32, endian)),
        "f8" => Ok((Scalar::F64, endian)),
        _ => {
            Err(source
                .unsupported(format!("the array holds '{name}': f4 and f8 are read; convert it by .astype('f4')")))
        }
    }
}
