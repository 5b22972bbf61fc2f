//! The cubic spline kernel, in the form that vectors want.
//!
//! With s the distance over the support radius h, the spline is W = 8/(π h³) · (1 − 6s² + 6s³) below s = ½ and
//! 8/(π h³) · 2(1 − s)³ up to s = 1. Half of the bracket is
//!
//! ```text
//! g(s) = min(a³, ½ − 3 a s²)      with a = max(1 − s, 0)
//! ```
//!
//! since the two branches differ by 4(½ − s)³, which changes sign where they meet; beyond the support a is 0 and so is g,
//! exactly. The factor in front never matters: densities divide it away (see [`density`](super::density)).
//!
//! Source: Monaghan, Smoothed particle hydrodynamics, 1992; the form with `min` is derived here and tested against the
//! two-branch form.

use crate::math::simd::Simd;

/// g of the squared distance, 16 at a time. g(0) = ½.
#[inline(always)]
pub(crate) fn half_spline<S: Simd>(s: S, dist_sq: S::F) -> S::F {
    let a = s.max(s.sub(s.splat(1.0), s.sqrt(dist_sq)), s.splat(0.0));
    let outer = s.mul(s.mul(a, a), a);
    let inner = s.sub(s.splat(0.5), s.mul(s.mul(s.splat(3.0), a), dist_sq));
    s.min(outer, inner)
}

/// −g′(s)/s of the squared distance: times the distance vector it is the gradient's opposite.
///
/// 6 − 9s below s = ½, 3(1 − s)²/s beyond.
#[inline(always)]
pub(crate) fn half_spline_slope<S: Simd>(s: S, dist_sq: S::F) -> S::F {
    let dist = s.sqrt(dist_sq);
    let a = s.max(s.sub(s.splat(1.0), dist), s.splat(0.0));
    let inner = s.sub(s.splat(6.0), s.mul(s.splat(9.0), dist));
    // Kept away from 0, where the other branch holds.
    let outer = s.div(s.mul(s.splat(3.0), s.mul(a, a)), s.max(dist, s.splat(0.25)));
    s.select(s.gt(s.splat(0.5), dist), inner, outer)
}

/// g in plain form: the specification.
#[cfg(test)]
pub(crate) fn half_spline_scalar(dist_sq: f32) -> f32 {
    let a = (1.0 - dist_sq.sqrt()).max(0.0);
    (a * a * a).min(0.5 - 3.0 * a * dist_sq)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::simd::Portable;

    fn textbook(s: f64) -> f64 {
        if s < 0.5 { 0.5 * (1.0 - 6.0 * s * s + 6.0 * s * s * s) } else { (1.0 - s).max(0.0).powi(3) }
    }

    #[test]
    fn equals_the_two_branches_and_vanishes_beyond_the_support() {
        for i in 0..=4000 {
            let s = f64::from(i) / 2000.0;
            let d = (s * s) as f32;
            assert!((f64::from(half_spline_scalar(d)) - textbook(s)).abs() < 3e-7, "{s}");
            assert_eq!(half_spline(Portable, [d; 16])[3].to_bits(), half_spline_scalar(d).to_bits());
            if s > 1.0 {
                assert_eq!(half_spline_scalar(d), 0.0);
            }
        }
        assert_eq!(half_spline_scalar(0.0), 0.5);
    }

    #[test]
    fn integrates_to_one_with_its_factor() {
        let n = 20_000;
        let sum: f64 = (0..n)
            .map(|i| (f64::from(i) + 0.5) / f64::from(n))
            .map(|s| 4.0 * std::f64::consts::PI * s * s * textbook(s))
            .sum();
        assert!((sum / f64::from(n) * 16.0 / std::f64::consts::PI - 1.0).abs() < 1e-6);
    }

    #[test]
    fn slope_is_the_derivative() {
        for i in 1..1000 {
            let s = f64::from(i) / 900.0;
            let e = 1e-5;
            let derivative = (textbook(s + e) - textbook(s - e)) / (2.0 * e);
            let slope = f64::from(half_spline_slope(Portable, [(s * s) as f32; 16])[0]);
            assert!((slope * s + derivative).abs() < 1e-4, "{s}: {slope} {derivative}");
        }
    }
}
