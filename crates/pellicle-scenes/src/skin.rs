//! The monster's skin: texture coordinates around and along its limbs.
//!
//! At a lattice corner the particles' directions across the limb and their lengths along it are blended by what each brings
//! to the field, and so is the way from the limb's axis to the corner. At a vertex the angle between the two is the first
//! coordinate, in turns; the length is the second.
//!
//! Source: Rosenberg & Birdwell, "Real-time particle isosurface extraction", 2008, section 7: "cylindrically textured by
//! interpolating per particle basis vectors and length coordinates onto the surface using a custom field calculation
//! routine"; the angle from the blended way outward is ours.

use pellicle::realtime::{Neighbours, Skin};

use crate::arithmetic::turns_of;
use crate::{Balls, Limb};

/// Of the particles of a frame; [`take`](Self::take) the next frame's before each update.
#[derive(Debug, Clone, Default)]
pub struct LimbSkin {
    limbs: Vec<Limb>,
    strengths: Vec<f32>,
}

/// What is blended at a corner.
#[derive(Debug, Clone, Copy, Default)]
pub struct Wrap {
    /// From the limb to the corner.
    out: [f32; 3],
    side: [f32; 3],
    up: [f32; 3],
    along: f32,
}

impl LimbSkin {
    /// Goes over to another frame. Particles without limbs have no skin.
    pub fn take(&mut self, balls: &Balls) {
        self.limbs.clone_from(&balls.limbs);
        self.strengths.clone_from(&balls.strengths);
    }
}

impl Skin for LimbSkin {
    type Corner = Wrap;
    /// Turns around the limb, and length along it in units of the world.
    type Vertex = [f32; 2];

    fn corner(&self, near: Neighbours<'_>) -> Wrap {
        let (mut wrap, mut total) = (Wrap::default(), 0.0);
        for neighbour in near {
            let Some(limb) = self.limbs.get(neighbour.particle) else { continue };
            let weight = self.strengths[neighbour.particle] * neighbour.rest * neighbour.rest;
            for a in 0..3 {
                wrap.out[a] += weight * neighbour.away[a];
                wrap.side[a] += weight * limb.side[a];
                wrap.up[a] += weight * limb.up[a];
            }
            wrap.along += weight * limb.along;
            total += weight;
        }
        // The angle does not depend on lengths.
        wrap.along /= f32::max(total, f32::MIN_POSITIVE);
        wrap
    }

    fn vertex(&self, ends: [Wrap; 2], t: f32) -> [f32; 2] {
        let between = |a: f32, b: f32| a + t * (b - a);
        let blend = |of: fn(&Wrap) -> [f32; 3]| -> [f32; 3] {
            let (a, b) = (of(&ends[0]), of(&ends[1]));
            std::array::from_fn(|k| between(a[k], b[k]))
        };
        let (out, side, up) = (blend(|w| w.out), blend(|w| w.side), blend(|w| w.up));
        let dot = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        [turns_of(dot(out, up), dot(out, side)), between(ends[0].along, ends[1].along)]
    }
}
