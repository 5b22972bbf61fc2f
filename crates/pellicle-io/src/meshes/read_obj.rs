//! Wavefront OBJ in: positions, faces, normals where each vertex has one of its own number, and colours where each vertex has
//! three numbers behind its position (or six numbers and nothing else). Texture coordinates, materials, groups, lines and free-form curves are passed over.

use std::path::Path;

use pellicle::{Mesh, VertexAttribute};

use super::assemble::{place, push_polygon};
use crate::error::Error;
use crate::particles::PositionData;
use crate::source::Source;

/// Words that a line may begin with and that are passed over.
const IGNORED: [&str; 37] = [
    "vt",
    "vp",
    "l",
    "p",
    "o",
    "g",
    "s",
    "mg",
    "usemtl",
    "mtllib",
    "usemap",
    "maplib",
    "deg",
    "cstype",
    "bmat",
    "step",
    "curv",
    "curv2",
    "surf",
    "parm",
    "trim",
    "hole",
    "scrv",
    "sp",
    "end",
    "con",
    "bevel",
    "c_interp",
    "d_interp",
    "lod",
    "shadow_obj",
    "trace_obj",
    "ctech",
    "stech",
    "call",
    "csh",
    "res",
];

/// A mesh in the making.
#[derive(Default)]
struct Builder {
    positions: Vec<[f64; 3]>,
    normals: Vec<[f32; 3]>,
    /// One per vertex as long as every vertex has one.
    colors: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    /// Whether a corner has another number for its normal than for its vertex, or none.
    has_other_normals: bool,
    /// Largest vertex number of a face and the line it is in; faces may come before their vertices.
    largest: (i64, u64),
    corners: Vec<i64>,
}

pub(crate) fn read(path: &Path) -> Result<Mesh, Error> {
    let mut source = Source::open(path)?;
    source.set_text(true);
    let mut builder = Builder::default();
    let mut number = 0;
    while let Some(line) = source.line()? {
        number += 1;
        let result = match std::str::from_utf8(line) {
            Ok(line) => builder.line(line, number),
            // Names and comments may be in any encoding.
            Err(_) if line.starts_with(b"#") => Ok(()),
            Err(_) => builder.line(&String::from_utf8_lossy(line), number),
        };
        if let Err(what) = result {
            return Err(source.fail(what));
        }
    }
    builder.finish(&source)
}

impl Builder {
    fn line(&mut self, line: &str, number: u64) -> Result<(), String> {
        let line = line.split_once('#').map_or(line, |(line, _)| line);
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            None => Ok(()),
            Some("v") => {
                self.positions.push(numbers(&mut words)?);
                // Behind the position: nothing, a weight, or a colour.
                if self.colors.len() + 1 == self.positions.len()
                    && let Ok(color) = numbers(&mut words)
                {
                    self.colors.push(color.map(|v| v as f32));
                }
                Ok(())
            }
            Some("vn") => {
                self.normals.push(numbers(&mut words)?.map(|v| v as f32));
                Ok(())
            }
            Some("f" | "fo") => self.face(words, number),
            Some(word) if IGNORED.contains(&word) => Ok(()),
            Some(word) => {
                Err(format!("'{}' does not begin a line of an OBJ file", word.chars().take(40).collect::<String>()))
            }
        }
    }

    fn face<'a>(&mut self, words: impl Iterator<Item = &'a str>, number: u64) -> Result<(), String> {
        self.corners.clear();
        for word in words {
            let mut parts = word.split('/');
            let vertex = index(parts.next(), self.positions.len())?;
            if !self.normals.is_empty() && !self.has_other_normals {
                let normal = parts.nth(1).map(|part| index(Some(part), self.normals.len()));
                self.has_other_normals = normal != Some(Ok(vertex));
            }
            if vertex > self.largest.0 {
                self.largest = (vertex, number);
            }
            self.corners.push(vertex);
        }
        push_polygon(&mut self.triangles, &self.corners, u64::from(u32::MAX) + 1)
    }

    fn finish(self, source: &Source<'_>) -> Result<Mesh, Error> {
        let (largest, line) = self.largest;
        if !self.triangles.is_empty() && largest >= self.positions.len() as i64 {
            let (found, count) = (largest + 1, self.positions.len());
            return Err(source.fail(format!("the face in line {line} refers to vertex {found}, but there are {count}")));
        }
        let use_normals = !self.has_other_normals && self.normals.len() == self.positions.len();
        let mut attributes = Vec::new();
        if self.colors.len() == self.positions.len() && !self.colors.is_empty() {
            let values = self.colors.into_flattened();
            attributes.push(VertexAttribute::new("color", 3, values));
        }
        let (origin, vertices) = place(PositionData::F64(self.positions));
        let normals = if use_normals { self.normals } else { Vec::new() };
        Ok(Mesh { origin, vertices, normals, triangles: self.triangles, attributes })
    }
}

fn numbers<'a>(words: &mut impl Iterator<Item = &'a str>) -> Result<[f64; 3], String> {
    let mut out = [0.0; 3];
    for value in &mut out {
        let word = words.next().ok_or("three numbers are expected")?;
        *value =
            word.parse().map_err(|_| format!("'{}' is not a number", word.chars().take(40).collect::<String>()))?;
    }
    Ok(out)
}

/// A number counted from 1, or backwards from -1, as an index from 0.
fn index(word: Option<&str>, count: usize) -> Result<i64, String> {
    let word = word.unwrap_or_default();
    match word.parse::<i64>() {
        Ok(from_start @ 1..) => Ok(from_start - 1),
        Ok(from_end @ ..=-1) => Ok(from_end.saturating_add(count as i64)),
        _ => Err(format!("'{}' is not the number of a vertex", word.chars().take(40).collect::<String>())),
    }
}
