//! Metaballs: Σ s_j w(1 − (d/R_j)²), a radial function of each particle's own reach and strength.
//!
//! With `OWN`, three columns: (R/R_j)², where R ≥ R_j is the support radius, the strength s_j, and the reach; else all are
//! alike and there is none. The functions w are in [`falloff`](super::falloff).
//!
//! Source: Rosenberg & Birdwell, Real-time particle isosurface extraction, 2008, sections 6 and 7 (radii and strengths of
//! particles); the functions as cited in [`falloff`](super::falloff).

use super::{Bounds, Field, Row, falloff::Falloff};
use crate::math::simd::{LANES, Portable, Simd};

/// Metaballs of one function, and their isovalue.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Metaballs<W, const OWN: bool> {
    pub(crate) falloff: W,
    pub(crate) iso: f32,
    /// Support radius over the rest spacing, of each particle.
    pub(crate) particles_per_support: f32,
    /// The smallest support, in support units; 1 where all are alike.
    pub(crate) smallest: f32,
    /// About what the field is in bulk.
    pub(crate) bulk: f32,
}

impl<W: Falloff, const OWN: bool> Metaballs<W, OWN> {
    /// 1 − (d/R_j)², at least 0.
    #[inline(always)]
    fn rest<S: Simd>(s: S, dist_sq: S::F, row: Row<'_>) -> S::F {
        let q = if OWN { s.mul(dist_sq, s.splat(row.get(0))) } else { dist_sq };
        s.max(s.sub(s.splat(1.0), q), s.splat(0.0))
    }
}

impl<W: Falloff, const OWN: bool> Field for Metaballs<W, OWN> {
    const COLUMNS: usize = if OWN { 3 } else { 0 };
    const PLANES: usize = 4;
    const ADDITIVE: bool = true;
    const REACH: Option<usize> = if OWN { Some(2) } else { None };
    type Sums<S: Simd> = S::F;
    type Slope<S: Simd> = [S::F; 3];
    type Bend<S: Simd> = ();

    #[inline(always)]
    fn zero<S: Simd>(&self, s: S) -> S::F {
        s.splat(0.0)
    }

    #[inline(always)]
    fn add_kernels<S: Simd>(&self, s: S, sums: &mut S::F, d: [S::F; 3], [dist_sq, _]: [S::F; 2], row: Row<'_>) {
        *sums = s.add(*sums, self.weight(s, d, dist_sq, row));
    }

    #[inline(always)]
    fn value<S: Simd>(&self, _: S, sums: S::F) -> S::F {
        sums
    }

    #[inline(always)]
    fn flat<S: Simd>(&self, s: S) -> [S::F; 3] {
        [s.splat(0.0); 3]
    }

    #[inline(always)]
    fn add_slope<S: Simd>(&self, s: S, gradient: &mut [S::F; 3], d: [S::F; 3], dist_sq: S::F, row: Row<'_>) {
        let u = Self::rest(s, dist_sq, row);
        // A function may end with a slope; beyond its reach there is none.
        let factor = s.splat(if OWN { row.get(0) * row.get(1) } else { 1.0 });
        let slope = s.select(s.gt(u, s.splat(0.0)), s.mul(factor, self.falloff.slope(s, u)), s.splat(0.0));
        for a in 0..3 {
            gradient[a] = s.sub(gradient[a], s.mul(slope, d[a]));
        }
    }

    #[inline(always)]
    fn bend<S: Simd>(&self, _: S, _: &[S::F; 3]) {}

    #[inline(always)]
    fn gradient<S: Simd>(&self, _: S, slope: [S::F; 3], (): ()) -> [S::F; 3] {
        slope
    }

    #[inline(always)]
    fn weight<S: Simd>(&self, s: S, _d: [S::F; 3], dist_sq: S::F, row: Row<'_>) -> S::F {
        let value = self.falloff.value(s, Self::rest(s, dist_sq, row));
        if OWN { s.mul(s.splat(row.get(1)), value) } else { value }
    }

    fn iso(&self) -> f32 {
        self.iso
    }

    fn bounds(&self) -> Option<Bounds> {
        // Samples are half the smallest support apart, so some sample is within 0.433 of it from a ball's middle: half of what a lone
        // ball is worth there, or of the isovalue, sees them all. Holes are blunter, as in the SPH field: its margin there
        // is six tenths of what lies between the isovalue and bulk.
        let at_sample = self.falloff.value(Portable, [1.0 - 0.75 * 0.25; LANES])[0];
        let inside_above = if self.bulk > self.iso { self.iso + 0.6 * (self.bulk - self.iso) } else { f32::MAX };
        Some(Bounds {
            apart: 0.5 * f64::from(self.smallest),
            outside_below: 0.5 * self.iso.min(at_sample),
            inside_above,
            crowd: 0.25 * (self.particles_per_support / self.smallest).powi(3),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        field::falloff::{InverseSquare, Triquet, Wyvill},
        lookup::gather::MAX_COLUMNS,
    };

    fn of<W: Falloff>(falloff: W, iso: f32) -> Metaballs<W, true> {
        Metaballs { falloff, iso, particles_per_support: 1.5, smallest: 1.0, bulk: 1.0 }
    }

    /// Value and gradient (up to its factor) at a point, of three particles that differ in reach and strength.
    fn at(field: &impl Field, p: [f64; 3]) -> (f64, [f64; 3]) {
        let particles = [[0.1, 0.2, 0.0], [0.4, -0.1, 0.2], [-0.2, 0.0, 0.5]];
        let (reach, strength) = ([1.0f32, 1.7, 1.2], [1.0f32, 0.6, 2.0]);
        let mut columns: [&[f32]; MAX_COLUMNS] = [&[]; MAX_COLUMNS];
        (columns[0], columns[1]) = (&reach, &strength);
        let (mut sums, mut slope) = (field.zero(Portable), field.flat(Portable));
        for (particle, x) in particles.iter().enumerate() {
            let d: [f64; 3] = std::array::from_fn(|a| p[a] - x[a]);
            let dist_sq = [d.iter().map(|v| v * v).sum::<f64>() as f32; LANES];
            let (d, row) = (d.map(|v| [v as f32; LANES]), Row { columns: &columns, particle });
            field.add(Portable, &mut sums, d, dist_sq, row);
            field.add_slope(Portable, &mut slope, d, dist_sq, row);
        }
        let bend = field.bend(Portable, &slope);
        let gradient = field.gradient(Portable, slope, bend);
        (f64::from(field.value(Portable, sums)[0]), gradient.map(|g| f64::from(g[0])))
    }

    #[test]
    fn gradients_are_those_of_finite_differences() {
        fn check(field: &impl Field) {
            for p in [[0.3, 0.3, 0.3], [0.0, -0.4, 0.2], [0.6, 0.1, -0.1]] {
                let (_, gradient) = at(field, p);
                for a in 0..3 {
                    let e = 1e-2;
                    let moved = |by: f64| at(field, std::array::from_fn(|i| p[i] + if i == a { by } else { 0.0 })).0;
                    // Fourth order, so that the step may be large against rounding.
                    let by_difference =
                        (8.0 * (moved(e) - moved(-e)) - (moved(2.0 * e) - moved(-2.0 * e))) / (12.0 * e);
                    // The common factor is 2.
                    assert!(
                        (2.0 * gradient[a] - by_difference).abs() < 2e-3 * by_difference.abs().max(0.2),
                        "axis {a} at {p:?}: {} {by_difference}",
                        2.0 * gradient[a]
                    );
                }
            }
        }
        check(&of(Triquet, 0.2));
        check(&of(Wyvill, 0.5));
        check(&of(InverseSquare { radius_sq: 0.04 }, 1.0));
    }

    #[test]
    fn a_lone_ball_of_the_paper_has_radius_one() {
        // Support 3, isovalue 0.2: the paper's figure 7.
        let field = of(Triquet, 0.2);
        let one = [1.0f32];
        let mut columns: [&[f32]; MAX_COLUMNS] = [&[]; MAX_COLUMNS];
        (columns[0], columns[1]) = (&one, &one);
        let value = |d: f32| {
            let mut sums = field.zero(Portable);
            let row = Row { columns: &columns, particle: 0 };
            field.add(Portable, &mut sums, [[0.0; LANES]; 3], [(d / 3.0).powi(2); LANES], row);
            sums[0]
        };
        assert!(value(0.97) > 0.2 && value(0.98) < 0.2 && value(3.0) == 0.0);
    }
}
