//! Fields of the user's own: what one particle brings, in plain numbers.
//!
//! Source: Rosenberg & Birdwell, Real-time particle isosurface extraction, 2008, section 7, whose custom field routine
//! modulates the strength of particles.

use super::Blend;
use crate::{
    field::falloff::Triquet,
    lookup::columns::{Near, Placed, Want},
    math::simd::Simd,
};

/// A field of the user's: the sum of what each particle within reach brings to a corner.
///
/// For [`Engine::update_custom`](crate::realtime::Engine::update_custom) and, with levels of detail,
/// [`update_custom_with_levels`](crate::realtime::Engine::update_custom_with_levels).
///
/// Nothing is assumed of it, so [`Seeds::Complete`](crate::realtime::Seeds::Complete) evaluates every corner that a
/// particle reaches, one particle at a time: it is slower than the built-in fields. It is asked on all threads of the pool, and
/// must not wait for other tasks of that pool.
/// What it brings should be 0 where `rest` is 0, or the surface has steps at the particles' reach.
///
/// ```
/// use pellicle::{Mesh, realtime::{CustomField, Engine, Params}};
///
/// /// Metaballs of which every third takes away.
/// struct WithHoles;
///
/// impl CustomField for WithHoles {
///     fn value(&self, particle: usize, rest: f32) -> f32 {
///         if particle % 3 == 2 { -rest * rest } else { rest * rest / 4.0 }
///     }
///
///     fn slope(&self, particle: usize, rest: f32) -> f32 {
///         if particle % 3 == 2 { -2.0 * rest } else { rest / 2.0 }
///     }
/// }
///
/// let (mut engine, mut mesh) = (Engine::new(Params::new(3.0, 0.5))?, Mesh::default());
/// let particles = [[0.0f32; 3], [1.0, 0.0, 0.0], [0.5, 0.9, 0.0]];
/// engine.update_custom(&particles, &WithHoles, &mut mesh)?;
/// assert!(pellicle::mesh::Report::of(&mesh).closed_manifold());
/// # Ok::<(), pellicle::Error>(())
/// ```
pub trait CustomField: Sync {
    /// What a particle, by its index in the caller's order, brings where `rest` = 1 − (d/R)² is left of its reach: 1 at
    /// the particle, 0 at its reach. Strengths of particles multiply it.
    fn value(&self, particle: usize, rest: f32) -> f32;

    /// Derivative of [`value`](Self::value) by `rest`, for normals.
    fn slope(&self, particle: usize, rest: f32) -> f32;
}

/// A user's field as the march asks for it.
pub(crate) struct Custom<'a, F>(pub(crate) &'a F);

impl<F: CustomField> Blend for Custom<'_, F> {
    const WANT: Want = Want { varied: true, who: true };
    type Falloff = Triquet;

    fn falloff(&self) -> Option<&Triquet> {
        None
    }

    #[inline(always)]
    fn value<S: Simd>(&self, _: S, near: &Near, particles: &[Placed]) -> f32 {
        near.rests().iter().zip(near.who()).fold(0.0, |sum, (&rest, who)| {
            let particle = &particles[who];
            sum + particle.strength * self.0.value(particle.index as usize, rest)
        })
    }

    #[inline(always)]
    fn slopes<S: Simd>(&self, _: S, near: &Near, particles: &[Placed], to: &mut Vec<f32>) {
        to.clear();
        to.extend(near.rests().iter().zip(near.who()).map(|(&rest, who)| {
            let particle = &particles[who];
            let slope = self.0.slope(particle.index as usize, rest);
            particle.strength * slope / (particle.reach * particle.reach)
        }));
    }
}
