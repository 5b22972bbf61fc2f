//! Particles on their way from a file to the core: positions as the file has them, attributes in single precision.
//!
//! Positions are moved, never copied: they are the largest thing in memory besides the lattice.

use pellicle::{Attribute, Carry, Ghosts, Params, Positions, Walls};
use pellicle_io::{AttributeValues, ParticleAttribute, Particles, PositionData};

use crate::resolve::NORMAL_VELOCITY;

/// The particles of one frame.
#[derive(Debug)]
pub struct Cloud {
    /// One position per particle.
    pub positions: PositionData,
    /// Values per particle, in the order of the file.
    pub channels: Vec<Channel>,
    /// Each particle's own radius, in world units.
    pub radii: Option<Vec<f32>>,
    /// How many of the last are images of others in walls.
    pub ghosts: usize,
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
        Self { positions: particles.positions, channels, radii: None, ghosts: 0 }
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
    /// Number of particles, images among them.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Positions for the core.
    pub fn positions(&self) -> Positions<'_> {
        let view = self.positions.view();
        self.radii.as_ref().map_or(view, |radii| view.with_radii(radii))
    }

    /// Adds the speed of the surface along its normal, made of the velocity, which stays if it `is_wanted` itself.
    pub fn add_normal_velocity(&mut self, is_wanted: bool) {
        let Some(at) = self.channels.iter().position(|c| c.name == "velocity" && c.components == 3) else { return };
        let values = if is_wanted { self.channels[at].values.clone() } else { self.channels.remove(at).values };
        let name = NORMAL_VELOCITY.to_owned();
        self.channels.push(Channel { name, components: 3, values, carry: Carry::NormalSpeed });
    }

    /// Adds the images of particles near walls, with what they carry.
    pub fn mirror(&mut self, walls: &Walls, params: &Params) {
        let Ghosts { positions, of } = walls.ghosts(self.positions(), params);
        match &mut self.positions {
            PositionData::F32(all) => all.extend(positions.iter().map(|p| p.map(|x| x as f32))),
            PositionData::F64(all) => all.extend(positions),
        }
        for Channel { values, components, .. } in &mut self.channels {
            let n = *components;
            for &i in &of {
                values.extend_from_within(i as usize * n..(i as usize + 1) * n);
            }
        }
        if let Some(radii) = &mut self.radii {
            radii.extend(of.iter().map(|&i| radii[i as usize]).collect::<Vec<f32>>());
        }
        self.ghosts += of.len();
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
