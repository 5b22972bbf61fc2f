//! PLY particles out: binary little-endian, one element `vertex`. Integers of 64 bits, which PLY has no type for, are
//! written with 32 bits where all fit, else as doubles where those hold them, else left out.

use std::path::Path;

use super::Particles;
use crate::columns::{Points, Records, Values, exceeds_bytes};
use crate::error::Error;
use crate::formats::catalog::Format;
use crate::meshes::WriteOptions;
use crate::meshes::one_line;
use crate::meshes::write_ply::{is_color, property_names};
use crate::output::{Output, Written};
use crate::scalar::{Endian, Scalar};

pub(crate) fn write(path: &Path, particles: &Particles, options: &WriteOptions) -> Result<Written, Error> {
    let mut points = Points::of_particles(particles);
    let mut written = Written::default();
    points.columns.retain_mut(|column| {
        column.values = column.values.shortened().rounded();
        if is_color(column.name, column.components) {
            column.values = column.values.color_bytes();
            if matches!(column.values, Values::UnitDouble(_))
                || matches!(column.values, Values::Unit(v) if exceeds_bytes(v))
            {
                written.narrowed.push(column.name.to_owned());
            }
        }
        let fits = column.values.scalar() != Scalar::I64;
        if !fits {
            written.left_out.push(column.name.to_owned());
        }
        fits
    });
    let mut header = String::from("ply\nformat binary_little_endian 1.0\n");
    for comment in &options.comments {
        header.push_str(&format!("comment {}\n", one_line(comment)));
    }
    header.push_str(&format!("element vertex {}\n", points.count));
    let mut parts = vec![(3, points.positions)];
    let mut property = |name: &str, scalar| header.push_str(&format!("property {} {name}\n", type_name(scalar)));
    ["x", "y", "z"].iter().for_each(|axis| property(axis, points.positions.scalar()));
    let names = points.names(Format::Ply, &[]);
    for (column, name) in points.columns.iter().zip(&names) {
        for name in property_names(name, column.components, false) {
            property(&name, column.values.scalar());
        }
        parts.push((column.components, column.values));
    }
    header.push_str("end_header\n");
    let records = Records::new(parts);
    let len = header.len() as u64 + points.count as u64 * records.stride as u64;
    let mut out = Output::create(path, Some(len))?;
    out.bytes(header.as_bytes())?;
    out.records(&records, points.count, Endian::Little)?;
    out.finish()?;
    Ok(written)
}

fn type_name(scalar: Scalar) -> &'static str {
    match scalar {
        Scalar::F64 => "double",
        Scalar::F32 => "float",
        Scalar::U8 => "uchar",
        _ => "int",
    }
}
