//! Particles on their way from a file to the core: positions as the file has them, attributes in single precision.
//!
//! Positions are moved, never copied: they are the largest thing in memory besides the lattice.

use pellicle::{Attribute, Positions};
use pellicle_io::{AttributeValues, ParticleAttribute, Particles, PositionData};

/// The particles of one frame.
#[derive(Debug)]
pub struct Cloud {
    /// One position per particle.
    pub positions: PositionData,
    /// Values per particle, in the order of the file.
    pub channels: Vec<Channel>,
}

/// Values per particle, to be carried to the surface.
#[derive(Debug)]
pub struct Channel {
    /// Name of the attribute.
    pub name: String,
    /// Numbers per particle.
    pub components: usize,
    /// `components` values per particle, particle after particle.
    pub values: Vec<f32>,
}

impl From<Particles> for Cloud {
    fn from(particles: Particles) -> Self {
        let channels = particles.attributes.into_iter().map(Channel::from).collect();
        Self { positions: particles.positions, channels }
    }
}

impl From<ParticleAttribute> for Channel {
    fn from(attribute: ParticleAttribute) -> Self {
        let values = match attribute.values {
            AttributeValues::F32(values) => values,
            _ => attribute.to_f32().into_owned(),
        };
        Self { name: attribute.name, components: attribute.components, values }
    }
}

impl Cloud {
    /// Number of particles.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Positions for the core.
    pub fn positions(&self) -> Positions<'_> {
        self.positions.view()
    }

    /// Attributes for the core.
    pub fn attributes(&self) -> Vec<Attribute<'_>> {
        let channels = self.channels.iter();
        channels.map(|c| Attribute { name: &c.name, components: c.components, values: &c.values }).collect()
    }

    /// Bytes that positions and attributes take.
    pub fn bytes(&self) -> u64 {
        let positions = match &self.positions {
            PositionData::F32(p) => size_of_val(&p[..]),
            PositionData::F64(p) => size_of_val(&p[..]),
        };
        let channels: usize = self.channels.iter().map(|c| size_of_val(&c.values[..])).sum();
        (positions + channels) as u64
    }

    /// Leaves out the particles whose position is NaN or infinite, in place; the others keep their order. Returns how
    /// many went.
    pub fn drop_invalid(&mut self) -> usize {
        let finite = |position: [f64; 3]| position.iter().all(|x| x.is_finite());
        let view = self.positions();
        let keep: Vec<bool> = (0..view.len()).map(|i| finite(view.get(i))).collect();
        let dropped = keep.iter().filter(|&&k| !k).count();
        if dropped > 0 {
            match &mut self.positions {
                PositionData::F32(positions) => retain(positions, &keep, 1),
                PositionData::F64(positions) => retain(positions, &keep, 1),
            }
            for channel in &mut self.channels {
                retain(&mut channel.values, &keep, channel.components);
            }
        }
        dropped
    }

    /// The first particle whose position is NaN or infinite.
    pub fn first_invalid(&self) -> Option<(usize, [f64; 3])> {
        let view = self.positions();
        (0..view.len()).map(|i| (i, view.get(i))).find(|(_, p)| !p.iter().all(|x| x.is_finite()))
    }
}

/// Keeps the values, `each` per particle, of the particles that `keep` says.
fn retain<T>(values: &mut Vec<T>, keep: &[bool], each: usize) {
    let mut index = 0;
    values.retain(|_| {
        let kept = keep[index / each];
        index += 1;
        kept
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dropping_keeps_order_and_rows_of_every_channel() {
        let bad = f64::NAN;
        let mut cloud = Cloud {
            positions: PositionData::F64(vec![[0.; 3], [1., bad, 1.], [2.; 3], [f64::INFINITY; 3], [4.; 3]]),
            channels: vec![
                Channel { name: "id".into(), components: 1, values: vec![0., 1., 2., 3., 4.] },
                Channel { name: "uv".into(), components: 2, values: (0..10_u8).map(f32::from).collect() },
            ],
        };
        assert_eq!(cloud.first_invalid().map(|(i, _)| i), Some(1));
        assert_eq!(cloud.drop_invalid(), 2);
        assert_eq!(cloud.positions, PositionData::F64(vec![[0.; 3], [2.; 3], [4.; 3]]));
        assert_eq!(cloud.channels[0].values, [0., 2., 4.]);
        assert_eq!(cloud.channels[1].values, [0., 1., 4., 5., 8., 9.]);
        assert_eq!(cloud.bytes(), 3 * 24 + 3 * 4 + 6 * 4);
        assert_eq!((cloud.drop_invalid(), cloud.first_invalid()), (0, None));
    }
}
