//! PLY meshes in: `vertex` and `face` elements in any encoding; other elements are passed over.

use std::path::Path;

use pellicle::Mesh;

use super::assemble::{self, push_polygon};
use crate::error::Error;
use crate::formats::ply::{self, Element, Property};
use crate::particles::{self, AttributeChoice, ReadOptions};
use crate::scalar::{Encoding, Endian, Scalar};
use crate::source::Source;

/// Bytes of a triangle as nearly all programs write it: its number of corners, and three indices of 32 bits.
const TRIANGLE: usize = 13;

pub(crate) fn read(path: &Path) -> Result<Mesh, Error> {
    let mut source = Source::open(path)?;
    let header = ply::read_header(&mut source)?;
    let Some(vertices) = header.elements.iter().find(|e| e.name == "vertex").map(|e| e.count) else {
        return Err(source.fail("the header declares no element 'vertex'"));
    };
    if header.elements.iter().any(|e| e.name == "tristrips") {
        return Err(
            source.unsupported("the triangles are in strips, which are not read: save the mesh with single faces")
        );
    }
    let options = ReadOptions { attributes: AttributeChoice::All, ..ReadOptions::default() };
    let (mut points, mut triangles) = (None, Vec::new());
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" if points.is_none() => {
                points = Some(particles::ply::read_vertices(&mut source, &header, element, &options)?);
            }
            "face" => read_faces(&mut source, header.encoding, element, vertices, &mut triangles)?,
            _ => ply::skip_element(&mut source, header.encoding, element)?,
        }
    }
    match points {
        Some(points) => Ok(assemble::mesh(points, triangles)),
        None => Err(source.fail("the header declares no element 'vertex'")),
    }
}

fn read_faces(
    source: &mut Source<'_>,
    encoding: Encoding,
    element: &Element,
    vertices: u64,
    triangles: &mut Vec<[u32; 3]>,
) -> Result<(), Error> {
    let is_corners = |p: &Property| matches!(p, Property::List { name, .. } if matches!(name.as_str(), "vertex_indices" | "vertex_index"));
    let Some(corners) = element.properties.iter().position(is_corners) else {
        return Err(source.fail("the faces have no list 'vertex_indices' or 'vertex_index'"));
    };
    source.room(element.count, element.least_bytes(encoding), "faces")?;
    triangles.reserve_exact(element.count.min(source.remaining() / TRIANGLE as u64) as usize);
    let done = read_plain_triangles(source, encoding, element, vertices, triangles)?;
    let rest = Element { count: element.count - done, ..element.clone() };
    ply::walk(source, encoding, &rest, Some(corners), |source, record| {
        push_polygon(triangles, record.items, vertices).map_err(|what| source.fail(what))
    })
}

/// Reads faces as long as they are triangles in the most common layout; returns how many.
fn read_plain_triangles(
    source: &mut Source<'_>,
    encoding: Encoding,
    element: &Element,
    vertices: u64,
    triangles: &mut Vec<[u32; 3]>,
) -> Result<u64, Error> {
    let common = [Scalar::I32, Scalar::U32];
    let is_common = matches!(element.properties.as_slice(),
        [Property::List { length: Scalar::U8, item, .. }] if common.contains(item));
    if !is_common || encoding != Encoding::Binary(Endian::Little) {
        return Ok(0);
    }
    let mut done = 0;
    while done < element.count {
        let bytes = source.peek(64 << 10)?;
        let left = usize::try_from(element.count - done).unwrap_or(usize::MAX);
        let before = triangles.len();
        for record in bytes.as_chunks::<TRIANGLE>().0.iter().take(left) {
            let [3, a0, a1, a2, a3, b0, b1, b2, b3, c0, c1, c2, c3] = *record else { break };
            let triangle = [[a0, a1, a2, a3], [b0, b1, b2, b3], [c0, c1, c2, c3]].map(u32::from_le_bytes);
            // A wrong index is left to the reader of single faces, which tells it.
            if triangle.iter().any(|&index| u64::from(index) >= vertices) {
                break;
            }
            triangles.push(triangle);
        }
        let count = triangles.len() - before;
        if count == 0 {
            break;
        }
        source.advance(count * TRIANGLE);
        done += count as u64;
    }
    Ok(done)
}
