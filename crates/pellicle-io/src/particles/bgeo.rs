//! Houdini's classic binary geometry, version 5, as Partio, SPlisHSPlasH and Houdini's `.bhclassic` write it; plain or
//! compressed by gzip.
//!
//! Only the points are read: position (x y z w, of which w is passed over) and point attributes. Attributes of type
//! *index* are numbers into a table of strings; the numbers are kept, the strings are not. Groups, primitives and the
//! attributes of vertices, primitives and the whole follow the points, and are not looked at.
//!
//! Source: the format as Disney's Partio reads it (`BGEO.cpp`); Houdini has no specification.

use std::path::Path;

use flate2::read::GzDecoder;

use super::{Particles, ReadOptions};
use crate::error::Error;
use crate::formats::detect::{self, GZIP};
use crate::formats::foreign;
use crate::formats::names::{self, Group, Groups};
use crate::scalar::{Encoding, Endian, Scalar};
use crate::source::{self, Source};
use crate::table::Table;

/// Attributes that a file may declare, and numbers that one attribute may have: more is damage.
const MAX_ATTRIBUTES: u32 = 4096;

pub(crate) fn read(path: &Path, options: &ReadOptions) -> Result<Particles, Error> {
    options.single(path, "BGEO")?;
    let mut source = Source::open(path)?;
    if source.peek(2)?.starts_with(&GZIP) {
        let (file, len) = source::open(path)?;
        let mut source = Source::inflating(path, GzDecoder::new(file), source::inflated_limit(len));
        return read_points(&mut source, options);
    }
    read_points(&mut source, options)
}

fn read_points(source: &mut Source<'_>, options: &ReadOptions) -> Result<Particles, Error> {
    let header = source.peek(20)?;
    if !header.starts_with(b"BgeoV") {
        if let Some(foreign) = foreign::by_content(header) {
            let refusal = foreign.refusal();
            return Err(source.unsupported(refusal));
        }
        let what = detect::mismatch("a classic BGEO file", header);
        return Err(source.fail(what));
    }
    source.advance(5);
    let version = unsigned(source)?;
    if version != 5 {
        return Err(source.unsupported(format!("BGEO version {version} is not read, only 5")));
    }
    let points = unsigned(source)?;
    // Primitives, point groups, primitive groups: they follow the points.
    source.skip(12, "the header")?;
    let attributes = unsigned(source)?;
    // Attributes of vertices, primitives and the whole.
    source.skip(12, "the header")?;
    if attributes > MAX_ATTRIBUTES {
        return Err(source.fail(format!("{attributes} point attributes: the limit is {MAX_ATTRIBUTES}")));
    }
    // x y z w
    let mut layout = vec![Scalar::F32; 4];
    let mut groups = Groups { position: Some([0, 1, 2]), attributes: Vec::new() };
    for _ in 0..attributes {
        read_definition(source, &mut layout, &mut groups)?;
    }
    let encoding = Encoding::Binary(Endian::Big);
    let capacity = source.room(u64::from(points), Source::least_bytes(encoding, &layout), "points")?;
    let path = source.path().to_owned();
    let mut table = Table::new(&path, &layout, [0, 1, 2], &groups, options, capacity)?;
    source.records(encoding, &layout, u64::from(points), "points", |bytes, endian| {
        table.append(bytes, endian);
        Ok(())
    })?;
    Ok(table.finish())
}

/// Reads the definition of an attribute: name, size, type, defaults.
fn read_definition(source: &mut Source<'_>, layout: &mut Vec<Scalar>, groups: &mut Groups) -> Result<(), Error> {
    const WHAT: &str = "the definition of an attribute";
    let name = read_string(source)?;
    let size = source.exact(2, WHAT)?;
    let size = u16::from_be_bytes([size[0], size[1]]);
    let kind = unsigned(source)?;
    if u32::from(size) > MAX_ATTRIBUTES {
        return Err(source.fail(format!("the attribute '{name}' has {size} components: the limit is {MAX_ATTRIBUTES}")));
    }
    let scalar = match kind {
        0 | 5 => Scalar::F32,
        1 | 4 => Scalar::I32,
        _ => {
            let kind = match kind {
                2 => "string".into(),
                3 => "mixed".into(),
                other => format!("number {other}"),
            };
            return Err(source.unsupported(format!(
                "the attribute '{name}' is of the type {kind}, whose layout is not known here: delete it in Houdini by an \
                 Attribute Delete node, or save the points as .ply. Read are float, integer, vector and index, the usual \
                 way to keep strings"
            )));
        }
    };
    if kind == 4 {
        for _ in 0..unsigned(source)? {
            read_string(source)?;
        }
    } else {
        source.skip(4 * u64::from(size), WHAT)?;
    }
    let first = layout.len();
    layout.extend(std::iter::repeat_n(scalar, usize::from(size)));
    let columns: Vec<usize> = (first..layout.len()).collect();
    if !columns.is_empty() {
        groups.attributes.push(Group { name: names::canonical(&name, columns.len()), original: name, columns });
    }
    Ok(())
}

fn read_string(source: &mut Source<'_>) -> Result<String, Error> {
    let length = source.exact(2, "the length of a string")?;
    let length = usize::from(u16::from_be_bytes([length[0], length[1]]));
    Ok(String::from_utf8_lossy(source.exact(length, "a string")?).into_owned())
}

/// Counts are signed in the format; negative ones are told as what they would be unsigned, and found too large.
fn unsigned(source: &mut Source<'_>) -> Result<u32, Error> {
    let bytes = source.exact(4, "the header")?;
    Ok(u32::from_be_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
}
