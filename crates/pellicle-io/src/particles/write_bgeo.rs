//! Houdini's classic binary geometry out, version 5; compressed by gzip where the name ends in `.gz`.
//!
//! The format has single precision and integers of 32 bits: doubles are narrowed, integers of 64 bits are written where
//! all fit, else left out. Names are Houdini's: `v`, `N`, `Cd`, `pscale`. There is no room for comments.
//!
//! Source: the format as Disney's Partio reads it (`BGEO.cpp`); Houdini has no specification.

use std::io::{BufWriter, Write};
use std::path::Path;

use flate2::Compression;
use flate2::write::GzEncoder;

use super::Particles;
use crate::columns::{Points, Records, Values};
use crate::error::Error;
use crate::formats::catalog::Format;
use crate::meshes::WriteOptions;
use crate::meshes::temporary::Temporary;
use crate::output::{Output, Written};
use crate::scalar::{Endian, Scalar};

/// Types of attributes.
const FLOAT: u32 = 0;
const INTEGER: u32 = 1;
const VECTOR: u32 = 5;
/// Numbers of one attribute, as far as our own reader goes.
const MAX_COMPONENTS: usize = 4096;
/// Records compressed at a time.
const RUN: usize = 4096;

pub(crate) fn write(path: &Path, particles: &Particles, _options: &WriteOptions) -> Result<Written, Error> {
    let mut points = Points::of_particles(particles);
    let mut written = Written::default();
    if points.positions.scalar() == Scalar::F64 {
        written.narrowed.push("position".into());
        points.positions = points.positions.narrowed();
    }
    points.columns.retain_mut(|column| {
        if column.values.scalar() == Scalar::F64 {
            written.narrowed.push(column.name.to_owned());
        }
        column.values = column.values.narrowed().shortened();
        let fits = column.values.scalar() != Scalar::I64 && column.components <= MAX_COMPONENTS;
        if !fits {
            written.left_out.push(column.name.to_owned());
        }
        fits
    });
    let Ok(count) = i32::try_from(points.count) else {
        let (needed, available) = (points.count as u64, i32::MAX as u64);
        return Err(Error::TooLarge { path: path.into(), what: "points in a BGEO file", needed, available });
    };
    let header = header(&points, count);
    let ones = Values::Constant(1.0, points.count);
    let columns = points.columns.iter().map(|column| (column.components, column.values));
    let records = Records::new([(3, points.positions), (1, ones)].into_iter().chain(columns).collect());
    // No extra, and the end.
    let end = b"\0\xff";
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("gz")) {
        write_gzip(path, &header, &records, points.count, end)?;
        return Ok(written);
    }
    let len = header.len() as u64 + points.count as u64 * records.stride as u64 + end.len() as u64;
    let mut out = Output::create(path, Some(len))?;
    out.bytes(&header)?;
    out.records(&records, points.count, Endian::Big)?;
    out.bytes(end)?;
    out.finish()?;
    Ok(written)
}

fn header(points: &Points<'_>, count: i32) -> Vec<u8> {
    let mut out = b"BgeoV".to_vec();
    let attributes = i32::try_from(points.columns.len()).unwrap_or(i32::MAX);
    // Version; points, primitives, groups of points and of primitives; attributes of points, vertices, primitives and
    // the whole.
    for number in [5, count, 0, 0, 0, attributes, 0, 0, 0] {
        out.extend_from_slice(&number.to_be_bytes());
    }
    for (column, name) in points.columns.iter().zip(points.names(Format::Bgeo, &["P"])) {
        let name = &name.as_bytes()[..name.floor_char_boundary(usize::from(u16::MAX))];
        out.extend_from_slice(&(name.len() as u16).to_be_bytes());
        out.extend_from_slice(name);
        // At most MAX_COMPONENTS.
        out.extend_from_slice(&(column.components as u16).to_be_bytes());
        let kind = match (column.values.scalar(), column.components) {
            (Scalar::I32, _) => INTEGER,
            // Vectors turn with the geometry; a colour does not.
            (_, 3) if matches!(column.name, "velocity" | "normal" | "force" | "acceleration") => VECTOR,
            _ => FLOAT,
        };
        out.extend_from_slice(&kind.to_be_bytes());
        out.extend(std::iter::repeat_n(0, 4 * column.components));
    }
    out
}

fn write_gzip(path: &Path, header: &[u8], records: &Records<'_>, count: usize, end: &[u8]) -> Result<(), Error> {
    let file = Temporary::create(path)?;
    let put = || {
        let mut encoder = GzEncoder::new(BufWriter::with_capacity(1 << 20, file.file()), Compression::default());
        encoder.write_all(header)?;
        let mut bytes = Vec::new();
        for first in (0..count).step_by(RUN) {
            records.put(first..count.min(first + RUN), Endian::Big, &mut bytes);
            encoder.write_all(&bytes)?;
        }
        encoder.write_all(end)?;
        encoder.finish()?.flush()
    };
    put().map_err(|source| file.fail("write", source))?;
    file.finish()
}
