//! Binary glTF in: all meshes of the scene, each moved as its nodes say, joined to one. So it comes in metres, with y up.
//!
//! Read are triangles, strips and fans, indexed or not; points give vertices without triangles; lines are passed over.
//! Numbers may be integers, as in `KHR_mesh_quantization`. Normals, COLOR_0 and attributes with an underscore are kept
//! where every part of the mesh has them; attributes are not turned with the nodes, tangents, texture coordinates, skins
//! and shapes are passed over.

use std::path::Path;

use pellicle::{Mesh, VertexAttribute};
use serde_json::Value;

use super::assemble::Bounds;
use super::glb::{Accessor, Glb};
use crate::error::Error;
use crate::formats::names;
use crate::scalar::Scalar;

/// Bytes that a scene may unfold to, besides its file's: a mesh may be shown many times.
const FREE_BYTES: u64 = 64 << 20;
/// Beyond them, the mesh may be larger than the file by this factor.
const RATIO: u64 = 8;
/// Fewer numbered scalars do not make a vector: those are written as one attribute.
const LEAST_PARTS: usize = 5;

/// A linear map and a translation.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Transform {
    /// Rows.
    linear: [[f64; 3]; 3],
    translation: [f64; 3],
}

const IDENTITY: Transform =
    Transform { linear: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], translation: [0.0; 3] };

/// A primitive as one node shows it.
struct Part<'a> {
    transform: Transform,
    positions: Accessor<'a>,
    normals: Option<Accessor<'a>>,
    indices: Option<Accessor<'a>>,
    mode: u64,
    /// Names in the file, sorted.
    attributes: Vec<(&'a str, Accessor<'a>)>,
}

pub(crate) fn read(path: &Path) -> Result<Mesh, Error> {
    let glb = Glb::open(path)?;
    let mut parts = Vec::new();
    let mut bytes = 0;
    for (transform, number) in instances(&glb)? {
        let mesh = glb.object("meshes", number)?;
        for primitive in mesh["primitives"].as_array().map_or(&[][..], Vec::as_slice) {
            let Some(part) = part(&glb, primitive, transform)? else { continue };
            bytes += part.bytes();
            let limit = FREE_BYTES + RATIO * glb.len;
            if bytes > limit {
                return Err(glb.unsupported(format!(
                    "its meshes, each as often as it is shown, take more than {limit} bytes: join or decimate them first"
                )));
            }
            parts.push(part);
        }
    }
    join(&glb, &parts)
}

/// The meshes that the scene shows, with the way each is moved.
fn instances(glb: &Glb) -> Result<Vec<(Transform, &Value)>, Error> {
    let nodes = glb.list("nodes");
    let roots: Vec<&Value> = if glb.list("scenes").is_empty() {
        return Ok(glb.list("nodes").iter().filter_map(|n| n.get("mesh")).map(|m| (IDENTITY, m)).collect());
    } else {
        let first = Value::from(0);
        let scene = glb.object("scenes", glb.json.get("scene").unwrap_or(&first))?;
        scene["nodes"].as_array().map_or(&[][..], Vec::as_slice).iter().collect()
    };
    let mut is_visited = vec![false; nodes.len()];
    let mut found = Vec::new();
    let mut stack: Vec<(Transform, &Value)> = roots.into_iter().rev().map(|node| (IDENTITY, node)).collect();
    while let Some((parent, number)) = stack.pop() {
        let node = glb.object("nodes", number)?;
        let visited = number.as_u64().and_then(|n| is_visited.get_mut(n as usize));
        if visited.is_none_or(|visited| std::mem::replace(visited, true)) {
            return Err(glb.fail(format!("node {number} is a child twice: nodes must be a tree")));
        }
        let transform = parent.then(local(glb, node)?);
        if let Some(mesh) = node.get("mesh") {
            found.push((transform, mesh));
        }
        let children = node["children"].as_array().map_or(&[][..], Vec::as_slice);
        stack.extend(children.iter().rev().map(|child| (transform, child)));
    }
    Ok(found)
}

/// The transform of a node: a matrix, or translation, rotation and scale.
fn local(glb: &Glb, node: &Value) -> Result<Transform, Error> {
    if let Some(m) = numbers::<16>(glb, node, "matrix")? {
        let linear = [0, 1, 2].map(|row| [0, 1, 2].map(|column| m[4 * column + row]));
        return Ok(Transform { linear, translation: [m[12], m[13], m[14]] });
    }
    let translation = numbers(glb, node, "translation")?.unwrap_or([0.0; 3]);
    let scale = numbers(glb, node, "scale")?.unwrap_or([1.0; 3]);
    let Some([x, y, z, w]) = numbers::<4>(glb, node, "rotation")? else {
        let diagonal = [[scale[0], 0.0, 0.0], [0.0, scale[1], 0.0], [0.0, 0.0, scale[2]]];
        return Ok(Transform { linear: diagonal, translation });
    };
    // Files round a unit quaternion to single precision; a length beside 1 would be a scale.
    let length = x * x + y * y + z * z + w * w;
    if !(0.25..4.0).contains(&length) {
        return Err(glb.fail(format!("a rotation is [{x}, {y}, {z}, {w}], not a unit quaternion")));
    }
    let s = 2.0 / length;
    let rotation = [
        [1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)],
        [s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x)],
        [s * (x * z - w * y), s * (y * z + w * x), 1.0 - s * (x * x + y * y)],
    ];
    let linear = rotation.map(|row| [row[0] * scale[0], row[1] * scale[1], row[2] * scale[2]]);
    Ok(Transform { linear, translation })
}

/// An array of `N` finite numbers, if it is there.
fn numbers<const N: usize>(glb: &Glb, node: &Value, name: &str) -> Result<Option<[f64; N]>, Error> {
    let value = &node[name];
    if value.is_null() {
        return Ok(None);
    }
    let found: Option<Vec<f64>> = value.as_array().and_then(|list| list.iter().map(Value::as_f64).collect());
    let found = found.and_then(|list| <[f64; N]>::try_from(list).ok());
    found.map(Some).ok_or_else(|| glb.fail(format!("the {name} of a node is not {N} numbers")))
}

/// A primitive with its accessors, all for the same number of vertices; `None` if it is of lines.
fn part<'a>(glb: &'a Glb, primitive: &'a Value, transform: Transform) -> Result<Option<Part<'a>>, Error> {
    let mode = if primitive["mode"].is_null() { 4 } else { primitive["mode"].as_u64().unwrap_or(u64::MAX) };
    match mode {
        0 | 4..=6 => {}
        1..=3 => return Ok(None),
        _ => return Err(glb.fail(format!("a primitive has the mode {}", primitive["mode"]))),
    }
    if !primitive["extensions"]["KHR_draco_mesh_compression"].is_null() {
        let what = "its meshes use KHR_draco_mesh_compression, which is not read: save it without";
        return Err(glb.unsupported(what));
    }
    let semantics = &primitive["attributes"];
    let positions = match semantics.get("POSITION") {
        Some(number) => glb.accessor(number)?,
        None => return Err(glb.fail("a primitive has no POSITION")),
    };
    let vector = |accessor: &Accessor<'_>, name: &str| match accessor.components {
        3 => Ok(()),
        _ => Err(glb.fail(format!("{name} is not of type VEC3"))),
    };
    vector(&positions, "POSITION")?;
    let normals = semantics.get("NORMAL").map(|number| glb.accessor(number)).transpose()?;
    normals.iter().try_for_each(|normals| vector(normals, "NORMAL"))?;
    let indices = primitive.get("indices").map(|number| glb.accessor(number)).transpose()?;
    if indices
        .as_ref()
        .is_some_and(|i| i.components != 1 || !matches!(i.scalar, Scalar::U8 | Scalar::U16 | Scalar::U32))
    {
        return Err(glb.fail("the indices of a primitive are not single unsigned integers"));
    }
    let mut attributes = Vec::new();
    for (name, number) in semantics.as_object().into_iter().flatten() {
        if name == "COLOR_0" || name.starts_with('_') {
            attributes.push((name.as_str(), glb.accessor(number)?));
        }
    }
    attributes.sort_by_key(|attribute| attribute.0);
    for (name, found) in normals.iter().map(|n| ("NORMAL", n)).chain(attributes.iter().map(|(name, a)| (*name, a))) {
        if found.count != positions.count {
            let what = format!("{name} is for {} vertices, POSITION for {}", found.count, positions.count);
            return Err(glb.fail(what));
        }
    }
    Ok(Some(Part { transform, positions, normals, indices, mode, attributes }))
}

impl Part<'_> {
    /// Bytes that it takes in memory, about.
    fn bytes(&self) -> u64 {
        let numbers: usize = self.attributes.iter().map(|(_, accessor)| accessor.components).sum();
        let corners = self.indices.as_ref().map_or(self.positions.count, |indices| indices.count);
        // In a strip every corner makes a triangle.
        (self.positions.count as u64).saturating_mul(24 + 4 * numbers as u64).saturating_add(12 * corners as u64)
    }

    /// Appends the triangles; `first` is the number of the first vertex.
    fn triangles(&self, glb: &Glb, first: u32, to: &mut Vec<[u32; 3]>) -> Result<(), Error> {
        if self.mode == 0 {
            return Ok(());
        }
        let count = self.positions.count;
        let corners = match &self.indices {
            Some(indices) => indices.integers(),
            None => (0..count as i64).collect(),
        };
        if let Some(wrong) = corners.iter().find(|&&corner| corner >= count as i64) {
            return Err(glb.fail(format!("a triangle refers to vertex {wrong}, but there are {count}")));
        }
        let is_mirrored = self.transform.determinant() < 0.0;
        let mut push = |a: i64, b: i64, c: i64| {
            // Below `count`, which was summed in 32 bits.
            let [a, b, c] = [a, b, c].map(|corner| first + corner as u32);
            to.push(if is_mirrored { [a, c, b] } else { [a, b, c] });
        };
        match self.mode {
            4 => corners.as_chunks::<3>().0.iter().for_each(|&[a, b, c]| push(a, b, c)),
            5 => {
                for (i, corner) in corners.windows(3).enumerate() {
                    let (a, b, c) = (corner[0], corner[1 + i % 2], corner[2 - i % 2]);
                    // Triangles without area join strips.
                    if a != b && b != c && c != a {
                        push(a, b, c);
                    }
                }
            }
            _ => {
                if let Some((&hub, rim)) = corners.split_first() {
                    rim.windows(2).for_each(|pair| push(hub, pair[0], pair[1]));
                }
            }
        }
        Ok(())
    }
}

/// All parts as one mesh.
fn join(glb: &Glb, parts: &[Part<'_>]) -> Result<Mesh, Error> {
    let mut mesh = Mesh { origin: origin(parts), ..Mesh::default() };
    let total: u64 = parts.iter().map(|part| part.positions.count as u64).sum();
    if total > u64::from(u32::MAX) {
        return Err(glb.fail(format!("{total} vertices, more than 32 bits can number")));
    }
    let has_normals = !parts.is_empty() && parts.iter().all(|part| part.normals.is_some());
    let kept = common_attributes(parts);
    mesh.attributes =
        kept.iter().map(|&(name, components)| VertexAttribute::new(name, components, Vec::new())).collect();
    for part in parts {
        // At most `total`.
        let first = mesh.vertices.len() as u32;
        let Transform { linear, translation } = part.transform;
        let shift = [0, 1, 2].map(|axis| translation[axis] - mesh.origin[axis]);
        let is_plain = linear == IDENTITY.linear && shift == [0.0; 3];
        let place = |v: &[f32; 3]| if is_plain { *v } else { apply(linear, shift, *v).map(|x| x as f32) };
        mesh.vertices.extend(part.positions.floats().as_chunks::<3>().0.iter().map(place));
        if let (Some(normals), true) = (&part.normals, has_normals) {
            let turn = part.transform.normals();
            let place = |n: &[f32; 3]| if linear == IDENTITY.linear { *n } else { unit(apply(turn, [0.0; 3], *n)) };
            mesh.normals.extend(normals.floats().as_chunks::<3>().0.iter().map(place));
        }
        for (attribute, (name, _)) in mesh.attributes.iter_mut().zip(&kept) {
            if let Some((_, accessor)) = part.attributes.iter().find(|(found, _)| found == name) {
                attribute.values.extend(accessor.floats());
            }
        }
        part.triangles(glb, first, &mut mesh.triangles)?;
    }
    mesh.attributes = regroup(std::mem::take(&mut mesh.attributes), mesh.vertices.len());
    Ok(mesh)
}

/// Where offsets count from: the translation, where all parts share it and no more is done to them, so that offsets stay
/// exact; else as for any positions in double precision.
fn origin(parts: &[Part<'_>]) -> [f64; 3] {
    let Some(first) = parts.first() else { return [0.0; 3] };
    if parts.iter().all(|part| part.transform == first.transform) && first.transform.linear == IDENTITY.linear {
        return first.transform.translation;
    }
    let mut bounds = Bounds::default();
    for part in parts {
        let Transform { linear, translation } = part.transform;
        let positions = part.positions.floats();
        positions.as_chunks::<3>().0.iter().for_each(|&v| bounds.add(apply(linear, translation, v)));
    }
    bounds.origin()
}

/// The attributes that every part has, with the same number of components.
fn common_attributes<'a>(parts: &'a [Part<'_>]) -> Vec<(&'a str, usize)> {
    let Some(first) = parts.first() else { return Vec::new() };
    let mut common: Vec<(&str, usize)> = first.attributes.iter().map(|(name, a)| (*name, a.components)).collect();
    common.retain(|(name, components)| {
        parts.iter().all(|p| p.attributes.iter().any(|(n, a)| n == name && a.components == *components))
    });
    common
}

/// Gives attributes their names in memory, and joins numbered scalars to vectors.
fn regroup(attributes: Vec<VertexAttribute>, vertices: usize) -> Vec<VertexAttribute> {
    let numbered = |name: &str| {
        let (base, number) = name.rsplit_once('_')?;
        Some((base.to_owned(), number.parse::<usize>().ok()?))
    };
    let count = |base: &str| {
        let is_there = |i: &usize| attributes.iter().any(|a| a.components == 1 && a.name == format!("{base}_{i}"));
        (0..).take_while(is_there).count()
    };
    let mut out: Vec<VertexAttribute> = Vec::new();
    for attribute in &attributes {
        let vector = numbered(&attribute.name).filter(|_| attribute.components == 1);
        let vector =
            vector.map(|(base, number)| (count(&base), base, number)).filter(|v| v.0 >= LEAST_PARTS && v.2 < v.0);
        let Some((components, base, number)) = vector else {
            let name = names::from_gltf(&attribute.name, attribute.components);
            out.push(VertexAttribute { name, ..attribute.clone() });
            continue;
        };
        let name = names::from_gltf(&base, components);
        let at = out.iter().position(|a| a.name == name && a.components == components).unwrap_or_else(|| {
            out.push(VertexAttribute::new(name, components, vec![0.0; vertices * components]));
            out.len() - 1
        });
        let to = out[at].values.iter_mut().skip(number).step_by(components);
        to.zip(&attribute.values).for_each(|(to, &value)| *to = value);
    }
    out
}

impl Transform {
    /// First `child`, then this one.
    fn then(self, child: Transform) -> Transform {
        let dot = |row: [f64; 3], column: usize| (0..3).map(|k| row[k] * child.linear[k][column]).sum::<f64>();
        let linear = self.linear.map(|row| [dot(row, 0), dot(row, 1), dot(row, 2)]);
        let moved = [0, 1, 2].map(|i| (0..3).map(|k| self.linear[i][k] * child.translation[k]).sum::<f64>());
        let translation = [0, 1, 2].map(|axis| self.translation[axis] + moved[axis]);
        Transform { linear, translation }
    }

    fn determinant(self) -> f64 {
        let m = self.linear;
        (0..3).map(|i| m[0][i] * (m[1][(i + 1) % 3] * m[2][(i + 2) % 3] - m[1][(i + 2) % 3] * m[2][(i + 1) % 3])).sum()
    }

    /// What turns normals: the matrix of cofactors, which is the inverse transposed but for a factor.
    fn normals(self) -> [[f64; 3]; 3] {
        let m = self.linear;
        let sign = if self.determinant() < 0.0 { -1.0 } else { 1.0 };
        [0, 1, 2].map(|i| {
            [0, 1, 2].map(|j| {
                let at = |a: usize, b: usize| m[(i + a) % 3][(j + b) % 3];
                sign * (at(1, 1) * at(2, 2) - at(1, 2) * at(2, 1))
            })
        })
    }
}

fn apply(linear: [[f64; 3]; 3], translation: [f64; 3], v: [f32; 3]) -> [f64; 3] {
    let v = v.map(f64::from);
    [0, 1, 2].map(|i| linear[i][0] * v[0] + linear[i][1] * v[1] + linear[i][2] * v[2] + translation[i])
}

fn unit(v: [f64; 3]) -> [f32; 3] {
    let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length > 0.0 { v.map(|x| (x / length) as f32) } else { [0.0; 3] }
}
