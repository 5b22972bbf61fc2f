//! Zhu & Bridson's field: r̄ − |x − x̄|, the distance to the weighted centre of the particles around, against their mean
//! radius. Positive inside, in particle spacings.
//!
//! With `RADII` a particle brings its own radius r_j, in support units; else all have one. Where no particle is within the
//! support the value is minus the support.
//!
//! Artefacts: where two groups of particles are in reach, the centre jumps from one to the other, and on the way passes x: blobs
//! in hollows and between splashes, that come and go from frame to frame.
//!
//! Source: Zhu, Bridson, Animating sand as a fluid, 2005, section 5; negated, so that inside is greater.

use super::{
    Bounds, Field, Row,
    centre::{self, Brings, Centre, Spread},
};
use crate::{lookup::gather::MAX_COLUMNS, math::simd::Simd};

/// The field and its isovalue.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ZhuBridson<const RADII: bool> {
    /// Isovalue in spacings; 0 is the surface of the paper.
    pub(crate) iso: f32,
    /// Radius of all particles in support units, where they bring none.
    pub(crate) radius: f32,
    /// Support radius over the rest spacing of the particles.
    pub(crate) particles_per_support: f32,
}

impl<const RADII: bool> ZhuBridson<RADII> {
    #[inline(always)]
    fn brings(row: Row<'_>) -> Brings {
        Brings::of(row, false, RADII)
    }
}

impl<const RADII: bool> Field for ZhuBridson<RADII> {
    const COLUMNS: usize = RADII as usize;
    const PLANES: usize = 4;
    const PROVES: bool = true;
    const WEIGHS: bool = true;
    type Sums<S: Simd> = Centre<S::F>;
    type Slope<S: Simd> = Spread<S::F>;
    type Bend<S: Simd> = ();

    #[inline(always)]
    fn zero<S: Simd>(&self, s: S) -> Centre<S::F> {
        Centre::zero(s)
    }

    #[inline(always)]
    fn kernels<S: Simd>(&self, s: S, dist_sq: S::F, row: Row<'_>) -> [S::F; 2] {
        centre::kernels(s, dist_sq, Self::brings(row))
    }

    #[inline(always)]
    fn add_kernels<S: Simd>(&self, s: S, sums: &mut Centre<S::F>, d: [S::F; 3], kernels: [S::F; 2], row: Row<'_>) {
        sums.add(s, d, kernels, Self::brings(row));
    }

    #[inline(always)]
    fn is_dense<S: Simd>(&self, s: S, sums: &Centre<S::F>) -> u16 {
        sums.is_dense(s, self.particles_per_support)
    }

    #[inline(always)]
    fn value<S: Simd>(&self, s: S, sums: Centre<S::F>) -> S::F {
        let inverse = sums.inverse_weight(s);
        let (_, length) = sums.offset(s, inverse);
        let depth = s.sub(sums.mean_radius(s, inverse, RADII, self.radius), length);
        sums.or_outside(s, s.mul(s.splat(self.particles_per_support), depth), -self.particles_per_support)
    }

    #[inline(always)]
    fn flat<S: Simd>(&self, s: S) -> Spread<S::F> {
        Spread::zero(s)
    }

    #[inline(always)]
    fn add_slope<S: Simd>(&self, s: S, slope: &mut Spread<S::F>, d: [S::F; 3], dist_sq: S::F, row: Row<'_>) {
        slope.add_all(s, d, dist_sq, Self::brings(row));
    }

    #[inline(always)]
    fn bend<S: Simd>(&self, _: S, _: &Spread<S::F>) {}

    #[inline(always)]
    fn gradient<S: Simd>(&self, s: S, slope: Spread<S::F>, (): ()) -> [S::F; 3] {
        let inverse = slope.centre.inverse_weight(s);
        let (off, length) = slope.centre.offset(s, inverse);
        let distance = slope.distance_gradient(s, &slope.jacobian(s, off, inverse), off, length);
        let mean = slope.centre.mean_radius(s, inverse, RADII, self.radius);
        let radius = slope.radius_gradient(s, inverse, mean, RADII);
        [s.sub(radius[0], distance[0]), s.sub(radius[1], distance[1]), s.sub(radius[2], distance[2])]
    }

    #[inline(always)]
    fn weight<S: Simd>(&self, s: S, _d: [S::F; 3], dist_sq: S::F, row: Row<'_>) -> S::F {
        centre::weight(s, dist_sq, Self::brings(row))
    }

    #[inline(always)]
    fn pull<S: Simd>(&self, s: S, columns: &[&[f32]; MAX_COLUMNS], at: usize) -> [S::F; 2] {
        let radius = if RADII { Ok(0) } else { Err(self.radius) };
        centre::pull(s, columns, at, None, radius, self.iso / self.particles_per_support)
    }

    fn iso(&self) -> f32 {
        self.iso
    }

    fn bounds(&self) -> Option<Bounds> {
        Some(centre::bounds(self.iso, self.radius, self.particles_per_support))
    }
}
