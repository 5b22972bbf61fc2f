//! Scalar fields made by particles: what is summed, and what the sums mean.
//!
//! One convention: a node is inside when its value is *greater* than the isovalue. Distances are in support units: beyond
//! distance 1 a particle contributes exactly nothing.
//!
//! A field says what a particle brings besides its position (its *columns*), how one particle is added to the sums of 16
//! nodes, and how the sums become a value. Sums may have several channels (a weighted centre has 4, with its Jacobian 13),
//! columns may be a matrix. Loops, lookup and lanes are not a field's business.
//!
//! Source: this project; each field names its own.

pub(crate) mod adams;
pub(crate) mod anisotropic;
mod around;
pub(crate) mod balls;
pub(crate) mod centre;
pub(crate) mod crowding;
pub(crate) mod density;
pub(crate) mod falloff;
pub(crate) mod function;
pub(crate) mod kernel;
pub(crate) mod metaball;
pub(crate) mod noise;
pub(crate) mod onderik;
#[cfg(test)]
pub(crate) mod scalar;
pub(crate) mod solenthaler;
pub(crate) mod sph;
pub(crate) mod surface_particles;
pub(crate) mod volume;
pub(crate) mod warp;
pub(crate) mod zhu_bridson;

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
    /// Farthest that coarse samples may lie apart, in support units.
    pub(crate) apart: f64,
    /// A region whose coarse samples are all below is outside. Nothing is where a field [proves](Field::PROVES) it.
    pub(crate) outside_below: f32,
    /// A region whose coarse samples are all above is inside, if it is crowded enough.
    pub(crate) inside_above: f32,
    /// Fewest particles within the support of a region, for each cubic support radius, with which `inside_above` holds, where the field
    /// does not [tell](Field::WEIGHS) itself.
    pub(crate) crowd: f32,
}

/// A field made by particles.
pub(crate) trait Field: Send + Sync {
    /// Numbers that a particle brings besides its position, at most [`MAX_COLUMNS`].
    const COLUMNS: usize;
    /// Planes of 16 nodes to sum side by side: 4 where that leaves the sums in registers, else 1, and bricks are always filled by eighths.
    const PLANES: usize;
    /// The column with the square of how far each particle reaches, in support units, a little rounded up; `None` where all
    /// reach one support radius.
    const REACH: Option<usize> = None;
    /// Whether the field measures the distance to a weighted centre, so that places are proven to be outside by what
    /// [`pull`](Self::pull) tells: see [`fill::prove`](crate::fill::prove).
    const PROVES: bool = false;
    /// Whether [`is_dense`](Self::is_dense) tells, node by node.
    const WEIGHS: bool = false;
    /// Whether the value is a sum over the particles and [`gradient`](Self::gradient) that of what each brings.
    const ADDITIVE: bool = false;
    /// Whether the gradient needs a second pass over the particles.
    const BENDS: bool = false;
    /// Sums of 16 nodes.
    type Sums<S: Simd>: Copy;
    /// Sums of 16 points, from which the gradient is made.
    type Slope<S: Simd>: Copy;
    /// Sums of a second pass, where one is needed; else `()`.
    type Bend<S: Simd>: Copy;

    /// Sums of no particle.
    fn zero<S: Simd>(&self, s: S) -> Self::Sums<S>;

    /// What [`add_kernels`](Self::add_kernels) takes of one particle, so that it can be computed ahead: the adding then waits for nothing.
    /// Of most fields the square of the distance, twice.
    #[inline(always)]
    fn kernels<S: Simd>(&self, _s: S, dist_sq: S::F, _row: Row<'_>) -> [S::F; 2] {
        [dist_sq; 2]
    }

    /// Adds one particle of these [`kernels`](Self::kernels) to the sums of 16 nodes. `d` is node minus particle.
    fn add_kernels<S: Simd>(&self, s: S, sums: &mut Self::Sums<S>, d: [S::F; 3], kernels: [S::F; 2], row: Row<'_>);

    /// Both in one step; `dist_sq` is the square of `d` as `(x² + y²) + z²`.
    #[inline(always)]
    fn add<S: Simd>(&self, s: S, sums: &mut Self::Sums<S>, d: [S::F; 3], dist_sq: S::F, row: Row<'_>) {
        self.add_kernels(s, sums, d, self.kernels(s, dist_sq, row), row);
    }

    /// At which of 16 nodes the particles lie so dense that samples are to be trusted; of fields that don't tell it is left to the
    /// [crowd](Bounds::crowd).
    #[inline(always)]
    fn is_dense<S: Simd>(&self, _s: S, _sums: &Self::Sums<S>) -> u16 {
        u16::MAX
    }

    /// The finishing step: values of 16 nodes.
    fn value<S: Simd>(&self, s: S, sums: Self::Sums<S>) -> S::F;

    /// Slope of no particle.
    fn flat<S: Simd>(&self, s: S) -> Self::Slope<S>;

    /// Adds one particle to the slope at 16 points.
    fn add_slope<S: Simd>(&self, s: S, slope: &mut Self::Slope<S>, d: [S::F; 3], dist_sq: S::F, row: Row<'_>);

    /// What the second pass starts from.
    fn bend<S: Simd>(&self, s: S, slope: &Self::Slope<S>) -> Self::Bend<S>;

    /// Adds one particle in the second pass.
    #[inline(always)]
    fn add_bend<S: Simd>(&self, _s: S, _bend: &mut Self::Bend<S>, _d: [S::F; 3], _dist_sq: S::F, _row: Row<'_>) {}

    /// The gradient, up to a positive factor.
    fn gradient<S: Simd>(&self, s: S, slope: Self::Slope<S>, bend: Self::Bend<S>) -> [S::F; 3];

    /// How much a particle counts at 16 points when attributes are interpolated; greater than 0 within its reach.
    fn weight<S: Simd>(&self, s: S, d: [S::F; 3], dist_sq: S::F, row: Row<'_>) -> S::F;

    /// Factor of the weight (1 − d²)³, and radius less isovalue in support units, of 16 particles from `at` on. A field that
    /// [proves](Self::PROVES) promises to be at most the weighted mean of these less the distance to that of the places.
    #[inline(always)]
    fn pull<S: Simd>(&self, s: S, _columns: &[&[f32]; MAX_COLUMNS], _at: usize) -> [S::F; 2] {
        [s.splat(0.0); 2]
    }

    /// Isovalue.
    fn iso(&self) -> f32;

    /// Bounds for the narrow band; `None` when there are none.
    fn bounds(&self) -> Option<Bounds>;
}

/// Unit vectors against gradients, which point outward; zero where there is none.
#[inline(always)]
pub(crate) fn normal<S: Simd>(s: S, gradient: [S::F; 3]) -> [S::F; 3] {
    let length_sq =
        s.add(s.add(s.mul(gradient[0], gradient[0]), s.mul(gradient[1], gradient[1])), s.mul(gradient[2], gradient[2]));
    let length = s.sqrt(s.max(length_sq, s.splat(f32::MIN_POSITIVE)));
    let zero = s.splat(0.0);
    let [x, y, z] = gradient;
    [s.div(s.sub(zero, x), length), s.div(s.sub(zero, y), length), s.div(s.sub(zero, z), length)]
}

#[cfg(test)]
mod tests;
