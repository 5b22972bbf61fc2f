//! Legacy VTK particles: the points of a POLYDATA or UNSTRUCTURED_GRID and their POINT_DATA. The points of meshes are
//! read here too.

use std::path::Path;

use super::{AttributeValues, ParticleAttribute, Particles, PositionData, ReadOptions};
use crate::error::Error;
use crate::formats::names;
use crate::formats::vtk::{Array, Content, Reader, Section};
use crate::scalar::{Field, Records, Scalar};

pub(crate) fn read(path: &Path, options: &ReadOptions) -> Result<Particles, Error> {
    options.single(path, "legacy VTK")?;
    let mut reader = Reader::open(path)?;
    if !matches!(reader.dataset(), "POLYDATA" | "UNSTRUCTURED_GRID") {
        let what = format!(
            "a legacy VTK dataset {}: particles are read from POLYDATA and UNSTRUCTURED_GRID",
            reader.dataset()
        );
        return Err(reader.source().unsupported(what));
    }
    let mut positions: Option<PositionData> = None;
    let mut attributes = Vec::new();
    let mut names: Vec<(String, String)> = Vec::new();
    while let Some(section) = reader.next()? {
        match section {
            Section::Points { .. } if positions.is_some() => {
                return Err(reader.source().fail("there are POINTS a second time"));
            }
            Section::Points { count, scalar } => positions = Some(read_points(&mut reader, count, scalar)?),
            Section::Cells(cells) => reader.skip_cells(cells)?,
            Section::CellTypes { count } => reader.skip_cell_types(count)?,
            Section::Array(array) => {
                let points = positions.as_ref().map(PositionData::len);
                if let Some(attribute) = read_array(&mut reader, &array, points, options, &mut names)? {
                    attributes.push(attribute);
                }
            }
        }
    }
    let Some(positions) = positions else { return Err(reader.source().fail("there are no POINTS")) };
    options.check(path, names.iter().map(|(name, original)| (name.as_str(), original.as_str())))?;
    Ok(Particles { positions, attributes })
}

/// Reads the points, which come next.
pub(crate) fn read_points(reader: &mut Reader, count: u64, scalar: Scalar) -> Result<PositionData, Error> {
    let mut positions = PositionData::of([scalar], reader.room(scalar, 3, count, "points")?);
    let size = scalar.size();
    let fields = [0, size, 2 * size].map(|offset| Field { offset, scalar });
    reader.read(scalar, 3, count, "points", |bytes, endian| {
        positions.append(Records { bytes, stride: 3 * size, endian }, &fields);
        Ok(())
    })?;
    Ok(positions)
}

/// Reads an array if it is asked for, and passes over it otherwise.
pub(crate) fn read_array(
    reader: &mut Reader,
    array: &Array,
    points: Option<usize>,
    options: &ReadOptions,
    names: &mut Vec<(String, String)>,
) -> Result<Option<ParticleAttribute>, Error> {
    let (Content::Numbers(scalar), true, 1..) = (array.content, array.is_of_points, array.components) else {
        reader.skip_array(array)?;
        return Ok(None);
    };
    let name = names::canonical(&array.name, array.components);
    names.push((name.clone(), array.name.clone()));
    if !options.wants(&name, &array.name) {
        reader.skip_array(array)?;
        return Ok(None);
    }
    if Some(array.tuples) != points.map(|points| points as u64) {
        let what =
            format!("the array '{}' is for {} points, the file has {}", array.name, array.tuples, points.unwrap_or(0));
        return Err(reader.source().fail(what));
    }
    let components = array.components;
    let capacity = reader.room(scalar, components, array.tuples, "tuples")?;
    let mut values = AttributeValues::of([scalar], capacity * components);
    let size = scalar.size();
    let fields: Vec<Field> = (0..components).map(|i| Field { offset: i * size, scalar }).collect();
    reader.read(scalar, components, array.tuples, &array.name, |bytes, endian| {
        values.append(Records { bytes, stride: components * size, endian }, &fields);
        Ok(())
    })?;
    if let (true, AttributeValues::F32(parts)) = (array.is_color_text, &values) {
        // As VTK does, so that a colour is the same however the file is written.
        values = AttributeValues::I32(parts.iter().map(|v| (v * 255.0).round().clamp(0.0, 255.0) as i32).collect());
    }
    Ok(Some(ParticleAttribute { name, components, values }))
}
