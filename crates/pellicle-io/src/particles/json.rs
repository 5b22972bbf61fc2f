//! Particles in JSON, in the shapes that scripts write:
//!
//! - an array of positions `[[x, y, z], …]`, with further columns as in NPY files, or flat `[x, y, z, x, …]`;
//! - an array of objects `[{"x": …, "y": …, "z": …, "vx": …}, …]` or `[{"position": [x, y, z], "velocity": […]}, …]`,
//!   whose members are those of the first one;
//! - an object of arrays `{"positions": […], "velocity": […], "density": […]}`, each nested or flat, or with `x`, `y` and
//!   `z`; positions go by the usual names.
//!
//! `array` names the place of the positions, or of an array or object as above, by keys and indices with `/` between
//! them: `frames/3/positions`. What is next to the positions are attributes. Numbers are kept in double precision,
//! attributes of nothing but integers as such; `null` is NaN. The file is read as a stream: only the numbers that are
//! asked for are kept. It may be compressed by gzip.
//!
//! Source: RFC 8259.

use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use flate2::read::GzDecoder;
use serde::de::DeserializeSeed;

use super::json_nodes::{Column, Node, Numbers, Seed};
use super::{AttributeValues, ParticleAttribute, Particles, PositionData, ReadOptions, npy};
use crate::error::{Error, Place};
use crate::formats::detect::GZIP;
use crate::formats::names::{self, Group};
use crate::source;

/// Numbers that a flat attribute may have for each particle.
const MAX_COMPONENTS: usize = 16;

pub(crate) fn read(path: &Path, options: &ReadOptions) -> Result<Particles, Error> {
    options.refuse_frame(path, "JSON (name a part of it by its path instead, such as frames/3)")?;
    let fail = |source| Error::Read { path: path.into(), source };
    let (mut file, len) = source::open(path)?;
    let mut head = Vec::new();
    (&mut file).take(3).read_to_end(&mut head).map_err(fail)?;
    let mark = if head.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
    file.seek(SeekFrom::Start(mark)).map_err(fail)?;
    let stream: Box<dyn Read> = if head.starts_with(&GZIP) {
        Box::new(GzDecoder::new(file).take(source::inflated_limit(len)))
    } else {
        Box::new(file)
    };
    let keys: Vec<&str> = options.array.iter().flat_map(|array| array.split('/')).filter(|k| !k.is_empty()).collect();
    let mut reader = serde_json::Deserializer::from_reader(BufReader::with_capacity(256 << 10, stream));
    let node = Seed { keys: &keys, options }.deserialize(&mut reader).map_err(|error| explain(path, error))?;
    reader.end().map_err(|error| explain(path, error))?;
    assemble(path, node, keys.last().copied(), options)
}

fn explain(path: &Path, error: serde_json::Error) -> Error {
    if error.is_io()
        && error.io_error_kind().is_some_and(|kind| {
            kind != io::ErrorKind::InvalidInput
                && kind != io::ErrorKind::InvalidData
                && kind != io::ErrorKind::UnexpectedEof
        })
    {
        return Error::Read { path: path.into(), source: error.into() };
    }
    let place = if error.line() > 0 { Place::Line(error.line() as u64) } else { Place::Whole };
    Error::Format { path: path.into(), place, what: format!("the JSON is not as expected: {error}") }
}

fn assemble(path: &Path, node: Node, key: Option<&str>, options: &ReadOptions) -> Result<Particles, Error> {
    match node {
        Node::Numbers(numbers) => {
            let column = Column { name: "positions".into(), numbers };
            from_columns(path, vec![column], Vec::new(), Some("positions"), options)
        }
        Node::Columns { columns, seen, positions_named } => {
            let name = if positions_named { key } else { None };
            from_columns(path, columns, seen, name, options)
        }
        Node::Other(what) => Err(unsupported(path, what)),
    }
}

fn unsupported(path: &Path, what: impl Into<String>) -> Error {
    Error::Unsupported { path: path.into(), what: what.into() }
}

/// The attributes of a file and their names there.
type Found = Vec<(ParticleAttribute, String)>;

fn from_columns(
    path: &Path,
    mut columns: Vec<Column>,
    seen: Vec<String>,
    wanted: Option<&str>,
    options: &ReadOptions,
) -> Result<Particles, Error> {
    let is_it = |column: &Column| wanted.map_or_else(|| names::is_position(&column.name), |name| column.name == name);
    let (positions, mut attributes) = if let Some(at) = columns.iter().position(is_it) {
        let column = columns.remove(at);
        let what = format!("'{}'", column.name);
        positions(column.numbers).map_err(|why| unsupported(path, format!("{what} holds no positions: {why}")))?
    } else {
        (joined(path, &mut columns, &seen)?, Vec::new())
    };
    attributes.append(&mut others(columns, positions.len()));
    let unread = seen.iter().filter(|name| !attributes.iter().any(|(_, original)| original == *name));
    let found = attributes.iter().map(|(a, original)| (a.name.as_str(), original.as_str()));
    // Names of what is no attribute, such as text, must not pass for one, but help to find a slip of the pen.
    if let Err(error) = options.check(path, found) {
        return Err(match error {
            Error::NoAttribute { path, name, mut available } => {
                available.extend(unread.filter(|n| **n != name && !available.contains(n)).cloned().collect::<Vec<_>>());
                Error::NoAttribute { path, name, available }
            }
            other => other,
        });
    }
    attributes.retain(|(a, original)| options.wants(&a.name, original));
    let attributes = attributes.into_iter().map(|(attribute, _)| attribute).collect();
    Ok(Particles { positions: PositionData::F64(positions), attributes })
}

/// Positions, and what the further columns of a row hold.
fn positions(numbers: Numbers) -> Result<(Vec<[f64; 3]>, Found), String> {
    if let Some(problem) = numbers.problem {
        return Err(problem);
    }
    let Numbers { values, width, .. } = numbers;
    match width {
        0 | 3 if values.len() % 3 == 0 => Ok((triples(values), Vec::new())),
        0 => Err(format!("{} numbers are no whole number of triples", values.len())),
        1 | 2 => Err(format!("a row has {width} numbers: x, y and z are needed")),
        _ => {
            let rows = || values.chunks_exact(width);
            let positions = rows().map(|row| [row[0], row[1], row[2]]).collect();
            let attributes = npy::columns(width).attributes.into_iter().map(|Group { name, original, columns }| {
                let values = rows().flat_map(|row| columns.iter().map(|&c| row[c])).collect();
                let components = columns.len();
                (ParticleAttribute { name, components, values: AttributeValues::F64(values) }, original)
            });
            Ok((positions, attributes.collect()))
        }
    }
}

fn triples(mut values: Vec<f64>) -> Vec<[f64; 3]> {
    values.shrink_to_fit();
    bytemuck::allocation::try_cast_vec(values)
        .unwrap_or_else(|(_, values)| values.chunks_exact(3).map(|v| [v[0], v[1], v[2]]).collect())
}

/// Takes x, y and z out of the columns.
fn joined(path: &Path, columns: &mut Vec<Column>, seen: &[String]) -> Result<Vec<[f64; 3]>, Error> {
    let mut axes = Vec::new();
    for axis in ["x", "y", "z"] {
        let is_it =
            |c: &Column| c.name.eq_ignore_ascii_case(axis) && c.numbers.problem.is_none() && c.numbers.width <= 1;
        let Some(at) = columns.iter().position(is_it) else {
            let what = "there are no positions: neither positions, position, points or the like nor x, y and z";
            let list = if seen.is_empty() { "nothing".into() } else { seen.join(", ") };
            return Err(unsupported(path, format!("{what}; there is: {list}. Name their place")));
        };
        axes.push(columns.remove(at).numbers.values);
    }
    let [x, y, z] = axes.as_slice() else { return Ok(Vec::new()) };
    if x.len() != y.len() || x.len() != z.len() {
        let what = format!("x, y and z have {}, {} and {} numbers", x.len(), y.len(), z.len());
        return Err(Error::Format { path: path.into(), place: Place::Whole, what });
    }
    Ok(x.iter().zip(y).zip(z).map(|((&x, &y), &z)| [x, y, z]).collect())
}

/// Attributes out of the columns that fit `count` particles; components with names of their own are joined.
fn others(columns: Vec<Column>, count: usize) -> Found {
    let mut found = Vec::new();
    let mut scalars: Vec<(String, Numbers)> = Vec::new();
    for Column { name, numbers } in columns {
        let width =
            if numbers.width > 0 { numbers.width } else { numbers.values.len().checked_div(count).unwrap_or(1) };
        let fits = count.checked_mul(width).is_some_and(|n| n == numbers.values.len());
        if numbers.problem.is_some() || !fits || !(1..=MAX_COMPONENTS).contains(&width) {
            continue;
        }
        if width == 1 {
            scalars.push((name, numbers));
        } else {
            let translated = names::canonical(&name, width);
            found.push((ParticleAttribute { name: translated, components: width, values: values(numbers) }, name));
        }
    }
    let names: Vec<String> = scalars.iter().map(|(name, _)| name.clone()).collect();
    let mut scalars: Vec<Option<Numbers>> = scalars.into_iter().map(|(_, numbers)| Some(numbers)).collect();
    for Group { name, original, columns } in names::group(&names).attributes {
        let parts: Vec<Numbers> = columns.iter().filter_map(|&c| scalars[c].take()).collect();
        let components = parts.len();
        let values = match parts.len() {
            1 => parts.into_iter().next().map(values),
            _ => {
                let mut joined = Vec::with_capacity(count * components);
                (0..count).for_each(|i| joined.extend(parts.iter().map(|part| part.values[i])));
                Some(AttributeValues::F64(joined))
            }
        };
        found.extend(values.map(|values| (ParticleAttribute { name, components, values }, original)));
    }
    found
}

fn values(numbers: Numbers) -> AttributeValues {
    if numbers.is_integer {
        AttributeValues::I64(numbers.values.into_iter().map(|v| v as i64).collect())
    } else {
        AttributeValues::F64(numbers.values)
    }
}
