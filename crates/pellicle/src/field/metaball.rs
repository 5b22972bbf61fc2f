//! Metaballs: Σ s_j w(1 − (d/R_j)²), a radial function of each particle's own reach and strength.
//!
//! Two columns: (R/R_j)², where R ≥ R_j is the support radius, and the strength s_j. With 1 and 1 this is the plain
//! metaball. The functions w are in [`falloff`](super::falloff).
//!
//! Source: Rosenberg & Birdwell, Real-time particle isosurface extraction, 2008, sections 6 and 7 (radii and strengths of
//! particles); the functions as cited in [`falloff`](super::falloff).

use super::{Bounds, Field, Row, falloff::Falloff};
use crate::math::simd::Simd;

/// Metaballs of one function, and their isovalue.
#[derive(Debug, Clone, Copy)]
#[allow(dead_code, reason = "the bulk road takes it up next")]
pub(crate) struct Metaballs<W> {
    pub(crate) falloff: W,
    pub(crate) iso: f32,
}

impl<W: Falloff> Metaballs<W> {
    /// 1 − (d/R_j)², at least 0.
    #[inline(always)]
    fn rest<S: Simd>(s: S, dist_sq: S::F, row: Row<'_>) -> S::F {
        s.max(s.sub(s.splat(1.0), s.mul(dist_sq, s.splat(row.get(0)))), s.splat(0.0))
    }
}

impl<W: Falloff> Field for Metaballs<W> {
    const COLUMNS: usize = 2;
    const PLANES: usize = 4;
    type Sums<S: Simd> = S::F;

    #[inline(always)]
    fn zero<S: Simd>(&self, s: S) -> S::F {
        s.splat(0.0)
    }

    #[inline(always)]
    fn add<S: Simd>(&self, s: S, sums: &mut S::F, _d: [S::F; 3], dist_sq: S::F, row: Row<'_>) {
        let value = self.falloff.value(s, Self::rest(s, dist_sq, row));
        *sums = s.add(*sums, s.mul(s.splat(row.get(1)), value));
    }

    #[inline(always)]
    fn value<S: Simd>(&self, _: S, sums: S::F) -> S::F {
        sums
    }

    #[inline(always)]
    fn add_gradient<S: Simd>(&self, s: S, gradient: &mut [S::F; 3], d: [S::F; 3], dist_sq: S::F, row: Row<'_>) {
        let u = Self::rest(s, dist_sq, row);
        // A function may end with a slope; beyond its reach there is none.
        let factor = s.splat(row.get(0) * row.get(1));
        let slope = s.select(s.gt(u, s.splat(0.0)), s.mul(factor, self.falloff.slope(s, u)), s.splat(0.0));
        for a in 0..3 {
            gradient[a] = s.sub(gradient[a], s.mul(slope, d[a]));
        }
    }

    fn iso(&self) -> f32 {
        self.iso
    }

    fn bounds(&self) -> Option<Bounds> {
        // Samples half a support apart miss an isolated ball whose surface lies within a third of its reach.
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        field::falloff::{InverseSquare, Triquet, Wyvill},
        lookup::gather::MAX_COLUMNS,
        math::simd::{LANES, Portable},
    };

    /// Value and gradient (up to its factor) at a point, of three particles that differ in reach and strength.
    fn at(field: &impl Field, p: [f64; 3]) -> (f64, [f64; 3]) {
        let particles = [[0.1, 0.2, 0.0], [0.4, -0.1, 0.2], [-0.2, 0.0, 0.5]];
        let (reach, strength) = ([1.0f32, 1.7, 1.2], [1.0f32, 0.6, 2.0]);
        let mut columns: [&[f32]; MAX_COLUMNS] = [&[]; MAX_COLUMNS];
        (columns[0], columns[1]) = (&reach, &strength);
        let (mut sums, mut gradient) = (field.zero(Portable), [[0.0; LANES]; 3]);
        for (particle, x) in particles.iter().enumerate() {
            let d: [f64; 3] = std::array::from_fn(|a| p[a] - x[a]);
            let dist_sq = [d.iter().map(|v| v * v).sum::<f64>() as f32; LANES];
            let (d, row) = (d.map(|v| [v as f32; LANES]), Row { columns: &columns, particle });
            field.add(Portable, &mut sums, d, dist_sq, row);
            field.add_gradient(Portable, &mut gradient, d, dist_sq, row);
        }
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
        check(&Metaballs { falloff: Triquet, iso: 0.2 });
        check(&Metaballs { falloff: Wyvill, iso: 0.5 });
        check(&Metaballs { falloff: InverseSquare { radius_sq: 0.04 }, iso: 1.0 });
    }

    #[test]
    fn a_lone_ball_of_the_paper_has_radius_one() {
        // Support 3, isovalue 0.2: the paper's figure 7.
        let field = Metaballs { falloff: Triquet, iso: 0.2 };
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
