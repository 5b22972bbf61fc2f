//! Scalar fields made by particles: what is summed, and what the sums mean.
//!
//! One convention: a node is inside when its value is *greater* than the isovalue. Distances are in support units: beyond
//! distance 1 a particle contributes exactly nothing.
//!
//! A field says what a particle brings besides its position (its *columns*), how one particle is added to the sums of 16
//! nodes, and how the sums become a value. Sums may have several channels (a weighted centre needs 4, with its Jacobian
//! 13), columns may be a matrix; `tests` below sketch both. Loops, lookup and lanes are not a field's business.
//!
//! Source: this project; each field names its own.

pub(crate) mod density;
pub(crate) mod falloff;
pub(crate) mod kernel;
pub(crate) mod metaball;
pub(crate) mod sph;
pub(crate) mod volume;

use crate::{lookup::gather::MAX_COLUMNS, math::simd::Simd};

/// One particle's columns.
#[derive(Clone, Copy)]
pub(crate) struct Row<'a> {
    pub(crate) columns: &'a [&'a [f32]; MAX_COLUMNS],
    pub(crate) particle: usize,
}

impl Row<'_> {
    /// Value of column `c`.
    #[inline(always)]
    pub(crate) fn get(&self, c: usize) -> f32 {
        self.columns[c][self.particle]
    }
}

/// Where on the coarse lattice the surface may be. Both in units of the field's value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bounds {
    /// A region whose coarse samples are all below is outside.
    pub(crate) outside_below: f32,
    /// A region whose coarse samples are all above is inside, if it is crowded enough.
    pub(crate) inside_above: f32,
    /// Fewest particles within the support of a region, for each cubic support radius, with which `inside_above` holds.
    pub(crate) crowd: f32,
}

/// A field made by particles.
pub(crate) trait Field: Sync {
    /// Numbers that a particle brings besides its position, at most [`MAX_COLUMNS`].
    const COLUMNS: usize;
    /// Planes of 16 nodes to sum side by side: 4 where that leaves the sums in registers, else 1.
    const PLANES: usize;
    /// Sums of 16 nodes.
    type Sums<S: Simd>: Copy;

    /// Sums of no particle.
    fn zero<S: Simd>(&self, s: S) -> Self::Sums<S>;

    /// Adds one particle to the sums of 16 nodes. `d` is node minus particle, `dist_sq` its square as `(x² + y²) + z²`.
    fn add<S: Simd>(&self, s: S, sums: &mut Self::Sums<S>, d: [S::F; 3], dist_sq: S::F, row: Row<'_>);

    /// The finishing step: values of 16 nodes.
    fn value<S: Simd>(&self, s: S, sums: Self::Sums<S>) -> S::F;

    /// Unit vector against the gradient, which points outward, at 16 points; zero where there is none.
    fn normal<S: Simd>(&self, s: S, gradient: [S::F; 3]) -> [S::F; 3] {
        let length_sq = s.add(
            s.add(s.mul(gradient[0], gradient[0]), s.mul(gradient[1], gradient[1])),
            s.mul(gradient[2], gradient[2]),
        );
        let length = s.sqrt(s.max(length_sq, s.splat(f32::MIN_POSITIVE)));
        gradient.map(|g| s.div(s.sub(s.splat(0.0), g), length))
    }

    /// Adds one particle to the gradient at 16 points, up to a positive factor common to all particles.
    fn add_gradient<S: Simd>(&self, s: S, gradient: &mut [S::F; 3], d: [S::F; 3], dist_sq: S::F, row: Row<'_>);

    /// Isovalue.
    fn iso(&self) -> f32;

    /// Bounds for the narrow band on samples at most half a support radius apart; `None` when there are none.
    fn bounds(&self) -> Option<Bounds>;
}

#[cfg(test)]
mod tests;
