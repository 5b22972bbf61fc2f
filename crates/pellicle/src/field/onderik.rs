//! Onderik's field: r̄ g − |x − x̄| with a centre weighted by volumes, where g falls to 0 as the fluid around grows thin.
//! Positive inside, in particle spacings. No eigenvalues are needed.
//!
//! The weights are q_j = V_j k_j with V_j = 1/Σ_k k(x_j − x_k), of the same kernel and support, so that w = Σ q_j is without
//! unit: about 1 in a fluid and ½ at its surface. With u = (w_max − w)/(w_max − w_min), w clamped, g = (1 − u²)².
//!
//! Source: Onderik, Chládek, Ďurikovič, SPH with small scale details and improved surface reconstruction, 2011; the choice of
//! V_j and the clamp are ours; negated, so that inside is greater.

use super::{
    Bounds, Field, Row,
    around::{Around, around},
    centre::{self, Brings, Centre, Spread},
};
use crate::{
    lookup::cells::Cells,
    lookup::gather::MAX_COLUMNS,
    math::simd::{Simd, Unit},
    progress::Control,
};

/// The field and its isovalue. Column 0 is the volume V_j, 1 the radius, where particles bring theirs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Onderik<const RADII: bool> {
    /// Isovalue in spacings; 0 is the surface of the paper.
    pub(crate) iso: f32,
    /// Radius of all particles in support units, where they bring none.
    pub(crate) radius: f32,
    /// Where Σ q is so little, the radius is 0.
    pub(crate) w_min: f32,
    /// Where Σ q is so much, the radius counts in full.
    pub(crate) w_max: f32,
    /// Support radius over the rest spacing of the particles.
    pub(crate) particles_per_support: f32,
}

/// Writes V of every particle, in canonical order, with zeros behind.
pub(crate) fn volumes(unit: Unit, cells: &Cells, control: &Control<'_>, to: &mut Vec<f32>) {
    around(unit, cells, &Volumes, None, control, to);
}

struct Volumes;

impl Around for Volumes {
    const OUT: usize = 1;
    type Sums<S: Simd> = S::F;

    #[inline(always)]
    fn zero<S: Simd>(&self, s: S) -> S::F {
        s.splat(0.0)
    }

    #[inline(always)]
    fn add<S: Simd>(&self, s: S, sums: &mut S::F, _d: [S::F; 3], dist_sq: S::F, _mass: S::F, _own: usize) {
        *sums = s.add(*sums, centre::weight(s, dist_sq, Brings::default()));
    }

    #[inline(always)]
    fn finish<S: Simd>(&self, s: S, sums: S::F, _own: usize, to: &mut [f32]) {
        to[0] = 1.0 / s.sum(sums);
    }
}

impl<const RADII: bool> Onderik<RADII> {
    #[inline(always)]
    fn brings(row: Row<'_>) -> Brings {
        Brings::of(row, true, RADII)
    }

    /// u and g of w.
    #[inline(always)]
    fn factor<S: Simd>(&self, s: S, w: S::F) -> [S::F; 2] {
        let per_unit = 1.0 / (self.w_max - self.w_min);
        let lack = s.mul(s.sub(s.splat(self.w_max), w), s.splat(per_unit));
        let u = s.min(s.max(lack, s.splat(0.0)), s.splat(1.0));
        let root = s.sub(s.splat(1.0), s.mul(u, u));
        [u, s.mul(root, root)]
    }
}

impl<const RADII: bool> Field for Onderik<RADII> {
    const COLUMNS: usize = 1 + RADII as usize;
    const PLANES: usize = 4;
    const PROVES: bool = true;
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
    fn value<S: Simd>(&self, s: S, sums: Centre<S::F>) -> S::F {
        let inverse = sums.inverse_weight(s);
        let (_, length) = sums.offset(s, inverse);
        let [_, factor] = self.factor(s, sums.weight);
        let depth = s.sub(s.mul(sums.mean_radius(s, inverse, RADII, self.radius), factor), length);
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
        let [u, factor] = self.factor(s, slope.centre.weight);
        // dg/dw = 4 u (1 − u²)/(w_max − w_min), ∂w/∂x = −6 S₁.
        let root = s.sub(s.splat(1.0), s.mul(u, u));
        let steep = s.mul(s.splat(-24.0 / (self.w_max - self.w_min)), s.mul(s.mul(u, root), mean));
        let mut gradient = distance;
        for a in 0..3 {
            let of_radius = s.add(s.mul(factor, radius[a]), s.mul(steep, slope.first[a]));
            gradient[a] = s.sub(of_radius, distance[a]);
        }
        gradient
    }

    #[inline(always)]
    fn weight<S: Simd>(&self, s: S, _d: [S::F; 3], dist_sq: S::F, row: Row<'_>) -> S::F {
        centre::weight(s, dist_sq, Self::brings(row))
    }

    #[inline(always)]
    fn pull<S: Simd>(&self, s: S, columns: &[&[f32]; MAX_COLUMNS], at: usize) -> [S::F; 2] {
        let radius = if RADII { Ok(1) } else { Err(self.radius) };
        centre::pull(s, columns, at, Some(0), radius, self.iso / self.particles_per_support)
    }

    fn iso(&self) -> f32 {
        self.iso
    }

    fn bounds(&self) -> Option<Bounds> {
        Some(centre::bounds(self.iso, self.radius, self.particles_per_support))
    }
}
