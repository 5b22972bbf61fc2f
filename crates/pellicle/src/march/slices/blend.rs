//! What the march asks of a field: its value at a node and, where vertices are made, its outward vector.
//!
//! Source: Rosenberg & Birdwell 2008, section 6, the field routine that look-ups hand particles to; sums in lanes are this
//! project's. The j-th particle of a node goes to lane j mod 16, so that a sum depends on the particles alone.

use crate::{
    field::falloff::Falloff,
    lookup::columns::{Near, Placed, Want},
    math::simd::{LANES, Simd},
};

/// An additive field.
pub(crate) trait Blend: Sync {
    /// What a value needs of a look-up.
    const WANT: Want;
    /// What bounds on the field are made of.
    type Falloff: Falloff;

    /// What a particle of strength 1 brings, if that is never negative and never grows with the distance.
    fn falloff(&self) -> Option<&Self::Falloff>;
    /// Value at a node.
    fn value<S: Simd>(&self, s: S, near: &Near, particles: &[Placed]) -> f32;
    /// Writes what each particle brings to the outward vector, per distance vector: strength · slope / R².
    fn slopes<S: Simd>(&self, s: S, near: &Near, particles: &[Placed], to: &mut Vec<f32>);
}

/// A radial function; `VARIED` where reaches or strengths differ.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Radial<W, const VARIED: bool>(pub(crate) W);

impl<W: Falloff, const VARIED: bool> Blend for Radial<W, VARIED> {
    const WANT: Want = Want { varied: VARIED, who: false };
    type Falloff = W;

    fn falloff(&self) -> Option<&W> {
        Some(&self.0)
    }

    #[inline(always)]
    fn value<S: Simd>(&self, s: S, near: &Near, _: &[Placed]) -> f32 {
        let mut sum = s.splat(0.0);
        for first in (0..near.len()).step_by(LANES) {
            let u = near.group(s, first);
            let value = self.0.value(s, u);
            let value = if VARIED { s.mul(near.strengths(s, first), value) } else { value };
            sum = s.add(sum, value);
        }
        s.sum(sum)
    }

    #[inline(always)]
    fn slopes<S: Simd>(&self, s: S, near: &Near, particles: &[Placed], to: &mut Vec<f32>) {
        to.resize(to.len().max(near.len() + LANES), 0.0);
        for first in (0..near.len()).step_by(LANES) {
            s.store(self.0.slope(s, near.group(s, first)), &mut to[first..]);
        }
        if VARIED {
            for (slope, who) in to.iter_mut().zip(near.who()) {
                let particle = &particles[who];
                *slope *= particle.strength / (particle.reach * particle.reach);
            }
        }
    }
}
