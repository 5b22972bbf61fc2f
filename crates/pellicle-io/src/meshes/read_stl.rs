//! STL in, binary and text. Corners at equal positions become one vertex, exactly equal ones only, so that a closed mesh is
//! closed in memory. Normals of faces and the 16 bits behind each triangle are passed over: the order of corners tells the
//! outside.
//!
//! Many binary files begin with `solid`, as text does. A file is binary if its size is what its count of triangles asks
//! for; else it is text if it begins with `solid` and its first bytes hold no zero.

use std::path::Path;

use pellicle::Mesh;

use super::assemble::place;
use super::weld::{Coordinate, Welder};
use crate::error::Error;
use crate::particles::PositionData;
use crate::scalar::{Encoding, Endian, Field, Records, Scalar, decode};
use crate::source::Source;

/// Bytes before the first triangle, and of a triangle.
const HEADER: u64 = 84;
const TRIANGLE: usize = 50;
/// Bytes looked at to tell text from binary.
const HEAD: usize = 512;

pub(crate) fn read(path: &Path) -> Result<Mesh, Error> {
    let mut source = Source::open(path)?;
    let len = source.remaining();
    let head = source.peek(HEAD)?;
    let count = head.get(80..84).map(|b| u64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]])));
    let is_exact = count.is_some_and(|count| HEADER + count * TRIANGLE as u64 == len);
    let begins = head.trim_ascii_start();
    let is_solid = begins.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    let has_zeros = head[..head.len().min(HEAD)].contains(&0);
    if !is_exact && is_solid && !has_zeros {
        return read_text(source);
    }
    match count {
        Some(count) => read_binary(source, count),
        None => Err(source.fail(format!("this is no STL file: it has {len} bytes and does not begin with 'solid'"))),
    }
}

fn read_binary(mut source: Source<'_>, count: u64) -> Result<Mesh, Error> {
    source.skip(HEADER, "the header")?;
    let capacity = source.room(count, TRIANGLE as u64, "triangles")?;
    let fields: [Field; 9] = std::array::from_fn(|i| Field { offset: 12 + 4 * i, scalar: Scalar::F32 });
    // Twelve numbers and 16 bits.
    let layout: Vec<Scalar> = [Scalar::F32; 12].into_iter().chain([Scalar::U16]).collect();
    let mut builder = Builder { welder: Welder::<f32>::new(), triangles: Vec::with_capacity(capacity) };
    let mut corners = Vec::new();
    let path = source.path().to_owned();
    source.records(Encoding::Binary(Endian::Little), &layout, count, "triangles", |bytes, endian| {
        corners.clear();
        corners.resize(bytes.len() / TRIANGLE * 9, 0f32);
        decode(&mut corners, Records { bytes, stride: TRIANGLE, endian }, &fields);
        corners
            .as_chunks::<9>()
            .0
            .iter()
            .try_for_each(|&[a, b, c, d, e, f, g, h, i]| builder.triangle([[a, b, c], [d, e, f], [g, h, i]], &path))
    })?;
    let Builder { welder, triangles } = builder;
    Ok(Mesh { vertices: welder.vertices, triangles, ..Mesh::default() })
}

fn read_text(mut source: Source<'_>) -> Result<Mesh, Error> {
    source.set_text(true);
    let mut builder = Builder { welder: Welder::<f64>::new(), triangles: Vec::new() };
    let path = source.path().to_owned();
    let mut corners: Vec<[f64; 3]> = Vec::with_capacity(4);
    let (mut is_open, mut is_ended) = (false, false);
    while let Some(line) = source.line()? {
        let line = String::from_utf8_lossy(line).into_owned();
        let mut words = line.split_ascii_whitespace();
        let keyword = words.next().map(str::to_ascii_lowercase).unwrap_or_default();
        if !keyword.is_empty() {
            is_ended = keyword == "endsolid";
        }
        match keyword.as_str() {
            "vertex" => {
                let numbers = [(); 3].map(|()| words.next().and_then(|word| word.parse::<f64>().ok()));
                let [Some(x), Some(y), Some(z)] = numbers else {
                    return Err(source.fail("three numbers are expected after 'vertex'"));
                };
                corners.push([x, y, z]);
            }
            "facet" | "endfacet" | "endsolid" if is_open && keyword != "endfacet" => {
                return Err(source.fail(format!("'{keyword}' stands where a facet is not complete")));
            }
            "facet" => is_open = true,
            "endfacet" => {
                let Ok(triangle) = <[[f64; 3]; 3]>::try_from(corners.as_slice()) else {
                    return Err(source.fail(format!("a facet has {} vertices, not three", corners.len())));
                };
                builder.triangle(triangle, &path)?;
                corners.clear();
                is_open = false;
            }
            // A file may hold several solids.
            "" | "solid" | "outer" | "endloop" | "endsolid" => {}
            _ => {
                let word: String = keyword.chars().take(40).collect();
                return Err(source.fail(format!("'{word}' does not begin a line of an STL file in text")));
            }
        }
    }
    if !is_ended || !corners.is_empty() {
        return Err(source.fail("the file does not end with 'endsolid': it seems to be cut short"));
    }
    let Builder { welder, triangles } = builder;
    let (origin, vertices) = place(PositionData::F64(welder.vertices));
    Ok(Mesh { origin, vertices, triangles, ..Mesh::default() })
}

/// A mesh in the making.
struct Builder<T> {
    welder: Welder<T>,
    triangles: Vec<[u32; 3]>,
}

impl<T: Coordinate> Builder<T> {
    fn triangle(&mut self, corners: [[T; 3]; 3], path: &Path) -> Result<(), Error> {
        match corners.map(|corner| self.welder.vertex(corner)) {
            [Some(a), Some(b), Some(c)] => {
                self.triangles.push([a, b, c]);
                Ok(())
            }
            _ => {
                let (needed, available) = (u64::from(u32::MAX) + 1, u64::from(u32::MAX));
                let what = "vertices with 32-bit indices";
                Err(Error::TooLarge { path: path.into(), what, needed, available })
            }
        }
    }
}
