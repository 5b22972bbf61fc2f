//! Binary glTF 2.0 out: one mesh of one primitive under one node.
//!
//! glTF is in metres with y up. The vertices stay as they are in memory, offsets in single precision; the node's
//! translation is the mesh's origin, its rotation turns z up to y up, its scale turns units into metres. So nothing is
//! rounded. Attributes that glTF knows become NORMAL and COLOR_0, others get an underscore and upper case (`_VELOCITY`);
//! those of more than four components become one accessor a component. A mesh without triangles is one of points;
//! without vertices, which glTF cannot express, the node is without mesh.
//!
//! ```text
//! glTF, 2, length | length, JSON, text, spaces | length, BIN, positions, columns, indices        each u32, aligned to 4
//! ```
//!
//! Source: "glTF 2.0 Specification", The Khronos Group, 2021.

use std::path::Path;

use pellicle::Mesh;
use rayon::prelude::*;
use serde_json::{Value, json};

use super::{Up, WriteOptions, check_indices};
use crate::columns::{Points, Values};
use crate::error::Error;
use crate::formats::catalog::Format;
use crate::output::{Output, Written};
use crate::scalar::{Endian, Scalar};

/// The length of the whole file is a number of 32 bits.
const MAX_LENGTH: u64 = u32::MAX as u64;
/// Vertices that a thread looks at together.
const PART: usize = 1 << 14;
/// `componentType`, `target` and `mode` as OpenGL numbers them.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;
const POINTS: u32 = 0;
const TRIANGLES: u32 = 4;

pub(crate) fn write(path: &Path, mesh: &Mesh, options: &WriteOptions) -> Result<Written, Error> {
    check_indices(path, mesh)?;
    // The largest index of 32 bits would mean the restart of a primitive.
    let (needed, available) = (mesh.vertices.len() as u64, u64::from(u32::MAX));
    if needed > available {
        return Err(Error::TooLarge { path: path.into(), what: "vertices with 32-bit indices", needed, available });
    }
    let mut points = Points { positions: Values::F32(mesh.vertices.as_flattened()), ..Points::of_mesh(mesh) };
    let names = points.names(Format::Glb, &["POSITION"]);
    check_finite(path, &points)?;
    let mut binary = Binary::default();
    let document = if points.count == 0 {
        points.columns.clear();
        // A scene without nodes is valid, but not all programs know.
        let node = json!({"name": "surface"});
        json!({"asset": asset(options), "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [node]})
    } else {
        describe(mesh, &points, &names, options, &mut binary)
    };
    let mut text = document.to_string();
    while text.len() % 4 != 0 {
        text.push(' ');
    }
    let length = 12 + 8 + text.len() as u64 + if binary.length > 0 { 8 + binary.length } else { 0 };
    if length > MAX_LENGTH {
        let what = "bytes in a binary glTF file";
        return Err(Error::TooLarge { path: path.into(), what, needed: length, available: MAX_LENGTH });
    }
    let mut out = Output::create(path, Some(length))?;
    // All lengths are below that of the file.
    for part in [b"glTF", &2u32.to_le_bytes(), &(length as u32).to_le_bytes()] {
        out.bytes(part)?;
    }
    out.bytes(&(text.len() as u32).to_le_bytes())?;
    out.bytes(b"JSON")?;
    out.bytes(text.as_bytes())?;
    if binary.length > 0 {
        out.bytes(&(binary.length as u32).to_le_bytes())?;
        out.bytes(b"BIN\0")?;
    }
    for part in &binary.parts {
        match *part {
            Part::Whole(values) => out.array(values, Endian::Little)?,
            Part::Component { values, component, of } => {
                out.tasks(values.len() / of, 4, |range, to| {
                    to.clear();
                    to.extend(range.flat_map(|i| values[i * of + component].to_le_bytes()));
                })?;
            }
        }
    }
    out.finish()?;
    Ok(Written::default())
}

fn asset(options: &WriteOptions) -> Value {
    let mut asset = json!({"version": "2.0", "generator": concat!("pellicle ", env!("CARGO_PKG_VERSION"))});
    if !options.comments.is_empty() {
        asset["extras"] = json!({"comments": options.comments});
    }
    asset
}

/// A piece of the binary chunk.
enum Part<'a> {
    Whole(Values<'a>),
    /// One component of an attribute that has too many for one accessor.
    Component {
        values: &'a [f32],
        component: usize,
        of: usize,
    },
}

/// The binary chunk in the making, with the accessors and views into it.
#[derive(Default)]
struct Binary<'a> {
    parts: Vec<Part<'a>>,
    accessors: Vec<Value>,
    views: Vec<Value>,
    length: u64,
}

impl<'a> Binary<'a> {
    /// Appends an array of numbers of 4 bytes; returns its accessor's number.
    fn push(&mut self, part: Part<'a>, count: usize, kind: &str, target: u32) -> usize {
        let (component_type, bytes) = match part {
            Part::Whole(values) if values.scalar() == Scalar::U32 => (UNSIGNED_INT, values.bytes()),
            Part::Whole(values) => (FLOAT, values.bytes()),
            Part::Component { .. } => (FLOAT, 4 * count as u64),
        };
        let view = json!({"buffer": 0, "byteOffset": self.length, "byteLength": bytes, "target": target});
        let number = self.accessors.len();
        self.accessors
            .push(json!({"bufferView": number, "componentType": component_type, "count": count, "type": kind}));
        self.views.push(view);
        self.length += bytes;
        self.parts.push(part);
        number
    }
}

fn describe<'a>(
    mesh: &'a Mesh,
    points: &Points<'a>,
    names: &[String],
    options: &WriteOptions,
    binary: &mut Binary<'a>,
) -> Value {
    let mut attributes = serde_json::Map::new();
    let position = binary.push(Part::Whole(points.positions), points.count, "VEC3", ARRAY_BUFFER);
    let [min, max] = bounds(&mesh.vertices);
    binary.accessors[position]["min"] = json!(min);
    binary.accessors[position]["max"] = json!(max);
    attributes.insert("POSITION".into(), json!(position));
    for (column, name) in points.columns.iter().zip(names) {
        let kind = match column.components {
            1 => "SCALAR",
            2 => "VEC2",
            3 => "VEC3",
            4 => "VEC4",
            of => {
                let Values::F32(values) = column.values else { continue };
                for component in 0..of {
                    let part = Part::Component { values, component, of };
                    let number = binary.push(part, points.count, "SCALAR", ARRAY_BUFFER);
                    attributes.insert(format!("{name}_{component}"), json!(number));
                }
                continue;
            }
        };
        let number = binary.push(Part::Whole(column.values), points.count, kind, ARRAY_BUFFER);
        attributes.insert(name.clone(), json!(number));
    }
    let mut primitive = json!({"attributes": attributes, "mode": POINTS});
    if !mesh.triangles.is_empty() {
        let part = Part::Whole(Values::U32(mesh.triangles.as_flattened()));
        let number = binary.push(part, 3 * mesh.triangles.len(), "SCALAR", ELEMENT_ARRAY_BUFFER);
        primitive["indices"] = json!(number);
        primitive["mode"] = json!(TRIANGLES);
    }
    json!({
        "asset": asset(options),
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [node(mesh.origin, options)],
        "meshes": [{"name": "surface", "primitives": [primitive]}],
        "accessors": binary.accessors,
        "bufferViews": binary.views,
        "buffers": [{"byteLength": binary.length}],
    })
}

/// Translation, rotation and scale are applied in reverse: first the scale, last the translation.
fn node(origin: [f64; 3], options: &WriteOptions) -> Value {
    let mut node = json!({"mesh": 0, "name": "surface"});
    let scale = options.metres_per_unit;
    let [x, y, z] = origin.map(|v| v * scale);
    let translation = match options.up {
        Up::Y => [x, y, z],
        Up::Z => {
            let half = std::f64::consts::FRAC_1_SQRT_2;
            node["rotation"] = json!([-half, 0.0, 0.0, half]);
            [x, z, -y]
        }
    };
    if origin != [0.0; 3] {
        node["translation"] = json!(translation);
    }
    if scale != 1.0 {
        node["scale"] = json!([scale, scale, scale]);
    }
    node
}

/// The smallest box. Minus zero counts as zero, so that the order of the threads does not show.
fn bounds(vertices: &[[f32; 3]]) -> [[f32; 3]; 2] {
    let none = || [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];
    let join = |[a, b]: [[f32; 3]; 2], [c, d]: [[f32; 3]; 2]| {
        [[0, 1, 2].map(|axis| a[axis].min(c[axis])), [0, 1, 2].map(|axis| b[axis].max(d[axis]))]
    };
    let of_part = |part: &[[f32; 3]]| part.iter().fold(none(), |bounds, v| join(bounds, [v.map(|x| x + 0.0); 2]));
    vertices.par_chunks(PART).map(of_part).reduce(none, join)
}

/// glTF forbids NaN and infinite numbers.
fn check_finite(path: &Path, points: &Points<'_>) -> Result<(), Error> {
    let columns = points.columns.iter().map(|column| (column.name, column.components, column.values));
    for (name, components, values) in columns.chain([("position", 3, points.positions)]) {
        if let Some(at) = values.first_not_finite() {
            let what = format!(
                "the {name} of vertex {} is NaN or infinite, which glTF cannot hold: write .ply, or leave it out",
                at / components
            );
            return Err(Error::Unsupported { path: path.into(), what });
        }
    }
    Ok(())
}
