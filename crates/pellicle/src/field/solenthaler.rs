//! Solenthaler's field: r̄ f − |x − x̄|, where f falls to 0 as the centre moves faster than x, so that no blobs arise in
//! hollows and between splashes. Positive inside, in particle spacings.
//!
//! How fast the centre moves is the largest real part EV of the eigenvalues of J = ∂x̄/∂x, which is not symmetric:
//! f = 1 − (1 − γ)³ with γ = (t_high − EV)/(t_high − t_low), clamped to 0..1. That is the paper's γ³ − 3γ² + 3γ, and 1 below
//! t_low. The largest real part is continuous, so the field is, too.
//!
//! The gradient needs that of EV: Σ_ab ∂EV/∂J_ab ∂J_ab/∂x, whose second derivatives of the kernel are summed in a second
//! pass, contracted with ∂EV/∂J: three sums, not eighteen.
//!
//! Source: Solenthaler, Schläfli, Pajarola, A unified particle model for fluid–solid interactions, 2007, section 5, with
//! the t_high of Akinci et al. 2012, equations 1 to 5; negated, so that inside is greater. The clamp and the derivative of
//! EV are derived here.

use super::{
    Bounds, Field, Row,
    centre::{self, Brings, Spread},
};
use crate::lookup::gather::MAX_COLUMNS;
use crate::math::{
    eigen::{Largest, Matrix, largest_real_part},
    simd::Simd,
};

/// The field and its isovalue.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Solenthaler<const RADII: bool> {
    /// Isovalue in spacings; 0 is the surface of the paper.
    pub(crate) iso: f32,
    /// Radius of all particles in support units, where they bring none.
    pub(crate) radius: f32,
    /// Below this EV the radius counts in full.
    pub(crate) t_low: f32,
    /// From this EV on the radius is 0.
    pub(crate) t_high: f32,
    /// Support radius over the rest spacing of the particles.
    pub(crate) particles_per_support: f32,
}

impl<const RADII: bool> Solenthaler<RADII> {
    #[inline(always)]
    fn brings(row: Row<'_>) -> Brings {
        Brings::of(row, false, RADII)
    }

    /// 1 − γ and f of EV.
    #[inline(always)]
    fn factor<S: Simd>(&self, s: S, ev: S::F) -> [S::F; 2] {
        let per_unit = 1.0 / (self.t_high - self.t_low);
        let excess = s.mul(s.sub(ev, s.splat(self.t_low)), s.splat(per_unit));
        let rest = s.min(s.max(excess, s.splat(0.0)), s.splat(1.0));
        [rest, s.sub(s.splat(1.0), s.mul(s.mul(rest, rest), rest))]
    }
}

/// Second derivatives of the centre, contracted with those of EV.
#[derive(Clone, Copy)]
pub(crate) struct Bend<F> {
    largest: Largest<F>,
    by_entry: Matrix<F>,
    off: [F; 3],
    sums: [F; 3],
}

impl<const RADII: bool> Field for Solenthaler<RADII> {
    const COLUMNS: usize = RADII as usize;
    const PLANES: usize = 1;
    const PROVES: bool = true;
    const BENDS: bool = true;
    type Sums<S: Simd> = Spread<S::F>;
    type Slope<S: Simd> = Spread<S::F>;
    type Bend<S: Simd> = Bend<S::F>;

    #[inline(always)]
    fn zero<S: Simd>(&self, s: S) -> Spread<S::F> {
        Spread::zero(s)
    }

    #[inline(always)]
    fn kernels<S: Simd>(&self, s: S, dist_sq: S::F, row: Row<'_>) -> [S::F; 2] {
        centre::kernels(s, dist_sq, Self::brings(row))
    }

    #[inline(always)]
    fn add_kernels<S: Simd>(&self, s: S, sums: &mut Spread<S::F>, d: [S::F; 3], kernels: [S::F; 2], row: Row<'_>) {
        sums.add(s, d, kernels, Self::brings(row));
    }

    #[inline(always)]
    fn value<S: Simd>(&self, s: S, sums: Spread<S::F>) -> S::F {
        let inverse = sums.centre.inverse_weight(s);
        let (off, length) = sums.centre.offset(s, inverse);
        let [_, factor] = self.factor(s, largest_real_part(s, &sums.jacobian(s, off, inverse)).value);
        let mean = sums.centre.mean_radius(s, inverse, RADII, self.radius);
        let depth = s.mul(s.splat(self.particles_per_support), s.sub(s.mul(mean, factor), length));
        sums.centre.or_outside(s, depth, -self.particles_per_support)
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
    fn bend<S: Simd>(&self, s: S, slope: &Spread<S::F>) -> Bend<S::F> {
        let inverse = slope.centre.inverse_weight(s);
        let (off, _) = slope.centre.offset(s, inverse);
        let largest = largest_real_part(s, &slope.jacobian(s, off, inverse));
        Bend { largest, by_entry: largest.derivatives(s), off, sums: [s.splat(0.0); 3] }
    }

    /// Adds Σ_ab M_ab ∂²k/∂x_b∂x_c (x_j − x̄)_a = 24 t d_c (d·v) − 6 t² v_c, with v = Mᵀ (x_j − x̄).
    #[inline(always)]
    fn add_bend<S: Simd>(&self, s: S, bend: &mut Bend<S::F>, d: [S::F; 3], dist_sq: S::F, _row: Row<'_>) {
        let from_centre = [s.sub(bend.off[0], d[0]), s.sub(bend.off[1], d[1]), s.sub(bend.off[2], d[2])];
        let m = &bend.by_entry;
        let mut v = from_centre;
        for b in 0..3 {
            let xy = s.add(s.mul(m[0][b], from_centre[0]), s.mul(m[1][b], from_centre[1]));
            v[b] = s.add(xy, s.mul(m[2][b], from_centre[2]));
        }
        let along = s.add(s.add(s.mul(d[0], v[0]), s.mul(d[1], v[1])), s.mul(d[2], v[2]));
        let t = s.max(s.sub(s.splat(1.0), dist_sq), s.splat(0.0));
        let (by_d, by_v) = (s.mul(s.mul(s.splat(24.0), t), along), s.mul(s.mul(s.splat(6.0), t), t));
        for c in 0..3 {
            bend.sums[c] = s.add(bend.sums[c], s.sub(s.mul(by_d, d[c]), s.mul(by_v, v[c])));
        }
    }

    #[inline(always)]
    fn gradient<S: Simd>(&self, s: S, slope: Spread<S::F>, bend: Bend<S::F>) -> [S::F; 3] {
        let inverse = slope.centre.inverse_weight(s);
        let (off, length) = slope.centre.offset(s, inverse);
        let jacobian = slope.jacobian(s, off, inverse);
        let distance = slope.distance_gradient(s, &jacobian, off, length);
        let mean = slope.centre.mean_radius(s, inverse, RADII, self.radius);
        let radius = slope.radius_gradient(s, inverse, mean, RADII);
        let [rest, factor] = self.factor(s, bend.largest.value);
        // The factor's derivative; 0 where γ is clamped at either end.
        let within = s.gt(s.splat(1.0), rest);
        let steep = s.mul(s.splat(-3.0 / (self.t_high - self.t_low)), s.mul(rest, rest));
        let steep = s.mul(mean, s.select(within, steep, s.splat(0.0)));
        // ∂J_ab/∂x_c = 1/W (Σ ∂²k (x_j − x̄)_a − W_b J_ac − W_c J_ab), with the kernel's slope W_b = −6 S₁.
        let m = &bend.by_entry;
        let (first, six) = (&slope.first, s.splat(-6.0));
        let slopes = [s.mul(six, first[0]), s.mul(six, first[1]), s.mul(six, first[2])];
        let mut in_all = s.splat(0.0);
        let mut by_row = [s.splat(0.0); 3];
        for a in 0..3 {
            for b in 0..3 {
                in_all = s.add(in_all, s.mul(m[a][b], jacobian[a][b]));
                by_row[a] = s.add(by_row[a], s.mul(m[a][b], slopes[b]));
            }
        }
        let mut gradient = distance;
        for c in 0..3 {
            let mut sum = s.sub(bend.sums[c], s.mul(slopes[c], in_all));
            for a in 0..3 {
                sum = s.sub(sum, s.mul(by_row[a], jacobian[a][c]));
            }
            let ev = s.mul(sum, inverse);
            gradient[c] = s.sub(s.add(s.mul(steep, ev), s.mul(factor, radius[c])), distance[c]);
        }
        gradient
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
