//! `--scale F`: particles in other units, such as millimetres in a file to metres in a scene.
//!
//! What is a length, or a length per time, scales along: positions, and the attributes that [`SCALED`] names. Everything
//! else (densities, normals, colours, ids) stays as it is.

use pellicle::Mesh;
use pellicle_io::{AttributeValues, ParticleAttribute, Particles, PositionData};
use rayon::prelude::*;

/// The attributes that scale with the positions, by the names that readers translate to.
pub const SCALED: [&str; 3] = ["velocity", "acceleration", "radius"];

/// Multiplies positions and the attributes that scale with them, each in its own precision; integers become `f64`.
/// `factor` is finite and greater than 0. What overflows becomes infinite, which later steps refuse by name.
pub fn scale(particles: &mut Particles, factor: f64) {
    match &mut particles.positions {
        PositionData::F32(positions) => scale_f32(positions.as_flattened_mut(), factor),
        PositionData::F64(positions) => scale_f64(positions.as_flattened_mut(), factor),
    }
    let scaled = particles.attributes.iter_mut().filter(|a| SCALED.contains(&a.name.as_str()));
    scaled.for_each(|attribute| scale_attribute(attribute, factor));
}

/// The same for a mesh.
pub fn scale_mesh(mesh: &mut Mesh, factor: f64) {
    mesh.origin = mesh.origin.map(|x| x * factor);
    scale_f32(mesh.vertices.as_flattened_mut(), factor);
    let scaled = mesh.attributes.iter_mut().filter(|a| SCALED.contains(&a.name.as_str()));
    scaled.for_each(|attribute| scale_f32(&mut attribute.values, factor));
}

fn scale_attribute(attribute: &mut ParticleAttribute, factor: f64) {
    let scaled = match &mut attribute.values {
        AttributeValues::F32(values) => return scale_f32(values, factor),
        AttributeValues::F64(values) => return scale_f64(values, factor),
        AttributeValues::I32(values) => values.iter().map(|&v| f64::from(v) * factor).collect(),
        // Beyond 2⁵³ it rounds, as any product would.
        AttributeValues::I64(values) => values.iter().map(|&v| v as f64 * factor).collect(),
    };
    attribute.values = AttributeValues::F64(scaled);
}

fn scale_f32(values: &mut [f32], factor: f64) {
    // Rounded once, from the exact product or next to it.
    values.par_iter_mut().with_min_len(1 << 14).for_each(|v| *v = (f64::from(*v) * factor) as f32);
}

fn scale_f64(values: &mut [f64], factor: f64) {
    values.par_iter_mut().with_min_len(1 << 14).for_each(|v| *v *= factor);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn attribute(name: &str, values: AttributeValues) -> ParticleAttribute {
        ParticleAttribute { name: name.into(), components: 1, values }
    }

    #[test]
    fn lengths_and_speeds_scale_and_nothing_else() {
        let mut particles = Particles {
            positions: PositionData::F32(vec![[1.0, -2.0, 3.0]]),
            attributes: vec![
                attribute("velocity", AttributeValues::F64(vec![4.0])),
                attribute("radius", AttributeValues::F32(vec![0.1])),
                attribute("acceleration", AttributeValues::I32(vec![3])),
                attribute("density", AttributeValues::F32(vec![1000.0])),
                attribute("id", AttributeValues::I64(vec![7])),
            ],
        };
        scale(&mut particles, 0.5);
        assert_eq!(particles.positions, PositionData::F32(vec![[0.5, -1.0, 1.5]]));
        let values: Vec<_> = particles.attributes.iter().map(|a| a.values.clone()).collect();
        assert_eq!(
            values,
            [
                AttributeValues::F64(vec![2.0]),
                AttributeValues::F32(vec![0.05]),
                AttributeValues::F64(vec![1.5]),
                AttributeValues::F32(vec![1000.0]),
                AttributeValues::I64(vec![7]),
            ]
        );
    }

    #[test]
    fn positions_keep_their_precision() {
        let mut particles =
            Particles { positions: PositionData::F64(vec![[1e-300, 1.0, 2.0]]), attributes: Vec::new() };
        scale(&mut particles, 1e-3);
        assert_eq!(particles.positions, PositionData::F64(vec![[1e-300 * 1e-3, 1e-3, 2e-3]]));
    }
}
