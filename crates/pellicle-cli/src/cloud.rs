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

impl From<Cloud> for Particles {
    fn from(cloud: Cloud) -> Self {
        let attribute = |channel: Channel| ParticleAttribute {
            name: channel.name,
            components: channel.components,
            values: AttributeValues::F32(channel.values),
        };
        Self { positions: cloud.positions, attributes: cloud.channels.into_iter().map(attribute).collect() }
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
}
