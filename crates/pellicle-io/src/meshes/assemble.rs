//! What the mesh readers share: polygons to triangles, and positions to an origin with offsets.

use pellicle::{Carry, Mesh, VertexAttribute};

use crate::particles::{AttributeValues, ParticleAttribute, Particles, PositionData};

/// Appends a polygon as a fan of triangles around its first corner, which is right for convex ones. `vertices` is how
/// many there are. The error says what is wrong with the polygon.
pub(super) fn push_polygon(triangles: &mut Vec<[u32; 3]>, corners: &[i64], vertices: u64) -> Result<(), String> {
    if corners.len() < 3 {
        return Err(format!("a face has {} corners, not three or more", corners.len()));
    }
    let index = |corner: i64| match u32::try_from(corner) {
        Ok(index) if u64::from(index) < vertices => Ok(index),
        _ => Err(format!("a face refers to vertex {corner}, but there are {vertices}, counted from 0")),
    };
    let first = index(corners[0])?;
    let mut previous = index(corners[1])?;
    for &corner in &corners[2..] {
        let next = index(corner)?;
        triangles.push([first, previous, next]);
        previous = next;
    }
    Ok(())
}

/// A mesh from its points, as a particle reader has read them, and its triangles.
pub(super) fn mesh(points: Particles, triangles: Vec<[u32; 3]>) -> Mesh {
    let (origin, vertices) = place(points.positions);
    let mut mesh = Mesh { origin, vertices, triangles, ..Mesh::default() };
    for attribute in points.attributes.into_iter().map(ParticleAttribute::with_unit_colors) {
        let ParticleAttribute { name, components, .. } = &attribute;
        if name == "normal" && *components == 3 && mesh.normals.is_empty() {
            mesh.normals = attribute.to_f32().as_chunks().0.to_vec();
            continue;
        }
        let (name, components) = (name.clone(), *components);
        // Whole numbers are ids, types, flags: a mean of them means nothing.
        let carry = match attribute.values {
            AttributeValues::F32(_) | AttributeValues::F64(_) => Carry::Mean,
            _ => Carry::Nearest,
        };
        let values = match attribute.values {
            AttributeValues::F32(values) => values,
            _ => attribute.to_f32().into_owned(),
        };
        mesh.attributes.push(VertexAttribute { name, components, values, carry });
    }
    mesh
}

/// An origin and offsets from it in single precision. The origin is zero wherever that costs no more than a bit or two
/// of precision; else it is a round number amid the points.
pub(super) fn place(positions: PositionData) -> ([f64; 3], Vec<[f32; 3]>) {
    let positions = match positions {
        PositionData::F32(positions) => return ([0.0; 3], positions),
        PositionData::F64(positions) => positions,
    };
    let origin = choose_origin(&positions);
    let offset = |p: &[f64; 3]| [0, 1, 2].map(|axis| (p[axis] - origin[axis]) as f32);
    (origin, positions.iter().map(offset).collect())
}

fn choose_origin(positions: &[[f64; 3]]) -> [f64; 3] {
    let is_single = |v: f64| f64::from(v as f32) == v || v.is_nan();
    if positions.as_flattened().iter().all(|&v| is_single(v)) {
        return [0.0; 3];
    }
    let mut bounds = Bounds::default();
    positions.iter().for_each(|&position| bounds.add(position));
    bounds.origin()
}

/// A box around the finite coordinates of points.
pub(super) struct Bounds {
    min: [f64; 3],
    max: [f64; 3],
}

impl Default for Bounds {
    fn default() -> Bounds {
        Bounds { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3] }
    }
}

impl Bounds {
    pub(super) fn add(&mut self, position: [f64; 3]) {
        for axis in (0..3).filter(|&axis| position[axis].is_finite()) {
            self.min[axis] = self.min[axis].min(position[axis]);
            self.max[axis] = self.max[axis].max(position[axis]);
        }
    }

    /// The origin for offsets in single precision: zero, or a round number amid the points where they lie far from it.
    pub(super) fn origin(&self) -> [f64; 3] {
        let Bounds { min, max } = *self;
        let extent = (0..3).map(|axis| max[axis] - min[axis]).fold(0.0, f64::max);
        // The largest power of two that is not larger: an origin in its multiples leaves the last bits as they are.
        let step = f64::from_bits(extent.to_bits() & 0x7ff0_0000_0000_0000);
        [0, 1, 2].map(|axis| {
            let farthest = min[axis].abs().max(max[axis].abs());
            let center = min[axis] + (max[axis] - min[axis]) / 2.0;
            if !center.is_finite() || farthest <= 4.0 * extent {
                0.0
            } else if step == 0.0 {
                center
            } else {
                (center / step).round() * step
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_far_away_keep_their_distances() {
        let far = [4.0e6, -5.0e6, 0.0];
        let points: Vec<[f64; 3]> = (0..10).map(|i| [far[0] + 0.001 * f64::from(i), far[1], 0.1]).collect();
        let (origin, offsets) = place(PositionData::F64(points.clone()));
        for (point, offset) in points.iter().zip(&offsets) {
            for axis in 0..3 {
                assert!((origin[axis] + f64::from(offset[axis]) - point[axis]).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn points_near_the_origin_or_in_single_precision_stay_as_they_are() {
        let near = vec![[0.1, 0.2, 0.3], [1.1, 1.2, 1.3]];
        assert_eq!(place(PositionData::F64(near)), ([0.0; 3], vec![[0.1, 0.2, 0.3], [1.1, 1.2, 1.3]]));
        let far = vec![[4.0e6, 0.0, 0.0], [4.0e6, 1.0, f64::INFINITY]];
        assert_eq!(place(PositionData::F64(far)).0, [0.0; 3]);
        assert_eq!(place(PositionData::F64(Vec::new())), ([0.0; 3], Vec::new()));
    }

    #[test]
    fn polygons_become_fans_and_wrong_corners_are_told() {
        let mut triangles = Vec::new();
        assert_eq!(push_polygon(&mut triangles, &[4, 3, 2, 1], 5), Ok(()));
        assert_eq!(triangles, [[4, 3, 2], [4, 2, 1]]);
        for bad in [&[0, 1][..], &[0, 1, 5], &[0, -1, 2], &[0, 1, 1 << 40]] {
            assert!(push_polygon(&mut triangles, bad, 5).is_err());
        }
    }
}
