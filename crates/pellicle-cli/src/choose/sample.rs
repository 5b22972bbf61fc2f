//! Particles for the tests of this module.

use pellicle_io::{AttributeValues, ParticleAttribute, Particles, PositionData};

/// Particle i lies at (i, i, i), with the attributes `id` = i and `uv` = (2i, 2i + 1).
pub fn sample(n: u8) -> Particles {
    let attribute = |name: &str, components, values| ParticleAttribute { name: name.into(), components, values };
    Particles {
        positions: PositionData::F64((0..n).map(|i| [f64::from(i); 3]).collect()),
        attributes: vec![
            attribute("id", 1, AttributeValues::I32((0..n).map(i32::from).collect())),
            attribute("uv", 2, AttributeValues::F32((0..2 * n).map(f32::from).collect())),
        ],
    }
}
