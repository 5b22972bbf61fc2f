//! NumPy arrays: N × k numbers, of which the first three columns are the position; or structured arrays with fields
//! `x y z` or `pos`.
//!
//! Columns: x y z, then for k = 4 density, for k = 6 velocity, for k = 7 velocity and density; for any other k the
//! further ones are named `column3` and so on. The fields of structured arrays are named as in the file; text in them is
//! passed over. Floats of 2, 4 and 8 bytes, integers and logical values, either byte order, C and Fortran order.
//! `f32` and `f64` triples in C order, the common case, are read in place.

use std::path::Path;

use super::npy_header::{self, Header};
use super::{AttributeValues, ParticleAttribute, Particles, PositionData, ReadOptions, xyz};
use crate::error::Error;
use crate::formats::names::{self, Group, Groups};
use crate::scalar::{Encoding, Endian, Field, Records, Scalar};
use crate::source::{self, Source};
use crate::table::{Layout, Table};

/// More numbers per particle than this, for no more particles than these, are taken for a transposed array.
const FEW_ROWS: u64 = 7;
const MAX_COLUMNS: u64 = 32;

pub(crate) fn read(path: &Path, options: &ReadOptions) -> Result<Particles, Error> {
    options.single(path, "a NumPy array")?;
    let mut source = Source::open(path)?;
    let header = npy_header::read(&mut source)?;
    read_particles(&mut source, &header, options)
}

/// Reads particles out of the array whose header has been read.
pub(super) fn read_particles(
    source: &mut Source<'_>,
    header: &Header,
    options: &ReadOptions,
) -> Result<Particles, Error> {
    let rows = source.room(header.rows, header.stride() as u64, "rows")?;
    let path = source.path().to_owned();
    if header.is_structured {
        return read_structured(source, header, rows, options);
    }
    let part = &header.parts[0];
    let Some(scalar) = part.scalar.filter(|_| header.shape.len() == 2 && header.columns >= 3) else {
        return Err(source.unsupported(format!(
            "the array has the shape {:?}: particles are N rows of at least 3 columns x, y, z",
            header.shape
        )));
    };
    // A few rows of many columns are the coordinates of many particles, one after the other.
    if header.rows <= FEW_ROWS && header.columns as u64 > MAX_COLUMNS {
        return Err(source.unsupported(format!(
            "the array has the shape {:?}, which looks transposed: save array.T, with a row for each particle",
            header.shape
        )));
    }
    let groups = columns(header.columns);
    options.check(&path, groups.attributes.iter().map(|g| (g.name.as_str(), g.original.as_str())))?;
    let is_simple = header.columns == 3 && part.endian == Endian::Little && !source.is_inflating();
    if is_simple && !header.is_fortran && matches!(scalar, Scalar::F32 | Scalar::F64) {
        let (file, _) = source::open(&path)?;
        let positions = xyz::read_positions(&path, &file, source.offset(), rows, scalar == Scalar::F64)?;
        return Ok(Particles { positions, attributes: Vec::new() });
    }
    if header.is_fortran {
        return read_columns(source, header, rows, &groups, options);
    }
    let layout = vec![scalar; header.columns];
    let mut table = Table::new(&path, &layout, [0, 1, 2], &groups, options, rows)?;
    source.records(Encoding::Binary(part.endian), &layout, header.rows, "rows", |bytes, endian| {
        table.append(bytes, endian);
        Ok(())
    })?;
    Ok(table.finish())
}

/// Records with fields of their own names.
fn read_structured(
    source: &mut Source<'_>,
    header: &Header,
    rows: usize,
    options: &ReadOptions,
) -> Result<Particles, Error> {
    if header.shape.len() != 1 {
        let what = format!("the structured array has the shape {:?}: it must have one dimension", header.shape);
        return Err(source.unsupported(what));
    }
    let mut layout = Layout::default();
    let mut scalar_names = Vec::new();
    let mut scalar_columns = Vec::new();
    let mut groups = Groups { position: None, attributes: Vec::new() };
    let mut endian = None;
    for part in &header.parts {
        let Some(scalar) = part.scalar else {
            layout.skip(part.size * part.count);
            continue;
        };
        if scalar.size() > 1 && *endian.get_or_insert(part.endian) != part.endian {
            return Err(source.unsupported("the fields have different byte orders: convert it by .astype"));
        }
        let columns: Vec<usize> = (0..part.count).map(|_| layout.push(scalar)).collect();
        match (columns.as_slice(), names::is_position(&part.name)) {
            (&[column], _) => {
                scalar_names.push(part.name.clone());
                scalar_columns.push(column);
            }
            (&[x, y, z], true) if groups.position.is_none() => groups.position = Some([x, y, z]),
            ([], _) => {}
            _ => groups.attributes.push(Group {
                name: names::canonical(&part.name, columns.len()),
                original: part.name.clone(),
                columns,
            }),
        }
    }
    let mut scalars = names::group(&scalar_names);
    for column in scalars.attributes.iter_mut().flat_map(|g| &mut g.columns) {
        *column = scalar_columns[*column];
    }
    groups.attributes.append(&mut scalars.attributes);
    groups.attributes.sort_by_key(|group| group.columns[0]);
    let Some(position) = groups.position.or(scalars.position.map(|p| p.map(|i| scalar_columns[i]))) else {
        let names: Vec<&str> = header.parts.iter().map(|p| p.name.as_str()).collect();
        return Err(source.unsupported(format!("no fields are named x, y, z or pos, but: {}", names.join(", "))));
    };
    let path = source.path().to_owned();
    let stride = layout.stride();
    let mut table = Table::with_layout(&path, &layout, position, &groups, options, rows)?;
    source.raw_records(stride, header.rows, "rows", |bytes| {
        table.append(bytes, endian.unwrap_or(Endian::Little));
        Ok(())
    })?;
    Ok(table.finish())
}

/// Reads an array in Fortran order: all x, then all y, and so on.
fn read_columns(
    source: &mut Source<'_>,
    header: &Header,
    rows: usize,
    groups: &Groups,
    options: &ReadOptions,
) -> Result<Particles, Error> {
    let scalar = header.parts[0].scalar.unwrap_or(Scalar::U8);
    let mut positions = PositionData::of([scalar], rows);
    positions.grow(rows);
    for axis in 0..3 {
        read_column(source, header, scalar, |first, records, field| {
            positions.grow(first + records.len());
            positions.set(first, axis, records, field);
        })?;
    }
    let mut attributes = Vec::new();
    for group in &groups.attributes {
        let components = group.columns.len();
        if !options.wants(&group.name, &group.original) {
            source.skip(header.rows * (scalar.size() * components) as u64, "rows")?;
            continue;
        }
        let values = read_components(source, header, scalar, components)?;
        attributes.push(ParticleAttribute { name: group.name.clone(), components, values });
    }
    Ok(Particles { positions, attributes })
}

/// Reads so many columns of an array in Fortran order.
fn read_components(
    source: &mut Source<'_>,
    header: &Header,
    scalar: Scalar,
    components: usize,
) -> Result<AttributeValues, Error> {
    let mut values = AttributeValues::of([scalar], 0);
    for component in 0..components {
        read_component(source, header, &mut values, (component, components))?;
    }
    Ok(values)
}

/// Reads the next column as component `component.0` of `component.1`. The values must be of a type that holds it.
pub(super) fn read_component(
    source: &mut Source<'_>,
    header: &Header,
    values: &mut AttributeValues,
    component: (usize, usize),
) -> Result<(), Error> {
    let scalar = header.parts[0].scalar.unwrap_or(Scalar::U8);
    read_column(source, header, scalar, |first, records, field| {
        values.grow((first + records.len()) * component.1);
        values.set(first * component.1, component, records, field);
    })
}

/// Hands out runs of the next column, each with the row that it begins with.
fn read_column(
    source: &mut Source<'_>,
    header: &Header,
    scalar: Scalar,
    mut each: impl FnMut(usize, Records<'_>, Field),
) -> Result<(), Error> {
    let field = Field { offset: 0, scalar };
    let mut first = 0;
    source.records(Encoding::Binary(header.parts[0].endian), &[scalar], header.rows, "rows", |bytes, endian| {
        let records = Records { bytes, stride: scalar.size(), endian };
        each(first, records, field);
        first += records.len();
        Ok(())
    })
}

/// Reads all numbers of an array, row by row: an attribute.
pub(super) fn read_values(source: &mut Source<'_>, header: &Header) -> Result<AttributeValues, Error> {
    let rows = source.room(header.rows, header.stride() as u64, "rows")?;
    let part = &header.parts[0];
    let scalar = part.scalar.unwrap_or(Scalar::U8);
    if header.is_fortran && header.columns > 1 {
        return read_components(source, header, scalar, header.columns);
    }
    let layout = vec![scalar; header.columns];
    let fields: Vec<Field> = (0..header.columns).map(|i| Field { offset: i * scalar.size(), scalar }).collect();
    let mut values = AttributeValues::of([scalar], rows * header.columns);
    source.records(Encoding::Binary(part.endian), &layout, header.rows, "rows", |bytes, endian| {
        values.append(Records { bytes, stride: scalar.size() * header.columns, endian }, &fields);
        Ok(())
    })?;
    Ok(values)
}

/// The meaning of the columns after the third.
pub(super) fn columns(count: usize) -> Groups {
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
