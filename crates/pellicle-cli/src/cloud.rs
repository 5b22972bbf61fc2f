//! Particles on their way from a file to the core: positions as the file has them, attributes in single precision.
//!
//! Positions are moved, never copied: they are the largest thing in memory besides the lattice.

use pellicle::{Attribute, Carry, Positions};
use pellicle_io::{AttributeValues, ParticleAttribute, Particles, PositionData};

/// The particles of one frame.
#[derive(Debug)]
pub struct Cloud {
    /// One position per particle.
    pub positions: PositionData,
    /// Values per particle, in the order of the file.
    pub channels: Vec<Channel>,
    /// Each particle's own radius, in world units.
    pub radii: Option<Vec<f32>>,
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
    /// How vertices get them.
    pub carry: Carry,
}

impl From<Particles> for Cloud {
    fn from(particles: Particles) -> Self {
        let channels = particles.attributes.into_iter().map(Channel::from).collect();
        Self { positions: particles.positions, channels, radii: None }
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
        // Whole numbers are ids, types, flags: a mean of them means nothing.
        let carry = match attribute.values {
            AttributeValues::F32(_) | AttributeValues::F64(_) => Carry::Mean,
            _ => Carry::Nearest,
        };
        let values = match attribute.values {
            AttributeValues::F32(values) => values,
            _ => attribute.to_f32().into_owned(),
        };
        Self { name: attribute.name, components: attribute.components, values, carry }
    }
}

impl Cloud {
    /// Number of particles.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Positions for the core.
    pub fn positions(&self) -> Positions<'_> {
        let view = self.positions.view();
        self.radii.as_ref().map_or(view, |radii| view.with_radii(radii))
    }

    /// The particles and their radii, back from where they came.
    pub fn back(mut self) -> (Particles, Option<Vec<f32>>) {
        let radii = self.radii.take();
        (self.into(), radii)
    }

    /// Attributes for the core.
    pub fn attributes(&self) -> Vec<Attribute<'_>> {
        let channels = self.channels.iter();
        channels.map(|c| Attribute { carry: c.carry, ..Attribute::new(&c.name, c.components, &c.values) }).collect()
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
