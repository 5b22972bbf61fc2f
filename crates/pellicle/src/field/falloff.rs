//! How the contribution of one particle falls with distance: the radial functions that additive fields sum.
//!
//! With q = (d/R)², where d is the distance and R the particle's own radius of influence, everything is written in terms
//! of u = 1 − q: 1 at the particle, 0 at its reach. A value is 0 at u = 0 and never falls with u, so that bounds on the
//! distance are bounds on the value. Slopes are derivatives by u.
//!
//! ```text
//! Triquet          u²/4                          (s⁴/4 − s²/2 + 1/4)
//! Wyvill           u² (5 + 4u)/9                 (1 − 4/9 s⁶ + 17/9 s⁴ − 22/9 s²)
//! inverse square   ρ² u/(1 − u)                  ρ² (1/s² − 1), ρ the particle's radius in units of R; held below s = 1/32
//! spline           the cubic spline, half of it  see [`kernel`](super::kernel)
//! ```
//!
//! Source: Triquet, Meseure, Chaillou, Fast polygonization of implicit surfaces, 2001; Wyvill, McPheeters, Wyvill, Data
//! structure for soft objects, 1986; Uralsky, Practical metaballs and implicit surfaces, 2006, whose field has no
//! cut-off: here it is shifted to reach 0 at R. The forms in u are this project's.

use super::kernel::{half_spline, half_spline_slope};
use crate::math::simd::Simd;
#[cfg(test)]
use crate::math::simd::{LANES, Portable};

/// A radial function, 16 at a time.
pub trait Falloff: Copy + Send + Sync {
    /// Value of u = 1 − (d/R)², which is at least 0; exactly 0 there.
    fn value<S: Simd>(&self, s: S, u: S::F) -> S::F;
    /// Its derivative by u, at least 0; at u = 0 exactly 0, where nothing is reached any more.
    fn slope<S: Simd>(&self, s: S, u: S::F) -> S::F;
}

/// (1 − s²)²/4.
#[derive(Debug, Clone, Copy)]
pub struct Triquet;

/// 1 − 4/9 s⁶ + 17/9 s⁴ − 22/9 s².
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wyvill;

/// ρ² (1/s² − 1).
#[derive(Debug, Clone, Copy)]
pub(crate) struct InverseSquare {
    /// ρ²: square of a particle's radius over its reach.
    pub(crate) radius_sq: f32,
}

/// Half of the bracket of the cubic spline, ½ at the particle.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spline;

impl Falloff for Triquet {
    #[inline(always)]
    fn value<S: Simd>(&self, s: S, u: S::F) -> S::F {
        s.mul(s.mul(u, u), s.splat(0.25))
    }

    #[inline(always)]
    fn slope<S: Simd>(&self, s: S, u: S::F) -> S::F {
        s.mul(u, s.splat(0.5))
    }
}

impl Falloff for Wyvill {
    #[inline(always)]
    fn value<S: Simd>(&self, s: S, u: S::F) -> S::F {
        s.mul(s.mul(u, u), s.add(s.splat(5.0 / 9.0), s.mul(u, s.splat(4.0 / 9.0))))
    }

    #[inline(always)]
    fn slope<S: Simd>(&self, s: S, u: S::F) -> S::F {
        s.mul(u, s.add(s.splat(10.0 / 9.0), s.mul(u, s.splat(12.0 / 9.0))))
    }
}

/// Any of them, chosen at run time: one branch for 16 values, in place of a copy of the march for each function.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Any {
    Triquet,
    Wyvill,
    InverseSquare(InverseSquare),
    Spline,
}

impl Falloff for Any {
    #[inline(always)]
    fn value<S: Simd>(&self, s: S, u: S::F) -> S::F {
        match self {
            Self::Triquet => Triquet.value(s, u),
            Self::Wyvill => Wyvill.value(s, u),
            Self::InverseSquare(f) => f.value(s, u),
            Self::Spline => Spline.value(s, u),
        }
    }

    #[inline(always)]
    fn slope<S: Simd>(&self, s: S, u: S::F) -> S::F {
        match self {
            Self::Triquet => Triquet.slope(s, u),
            Self::Wyvill => Wyvill.slope(s, u),
            Self::InverseSquare(f) => f.slope(s, u),
            Self::Spline => Spline.slope(s, u),
        }
    }
}

/// Square of the distance, in reaches, below which the inverse square is held.
const HELD: f32 = 1.0 / 1024.0;

impl Falloff for InverseSquare {
    #[inline(always)]
    fn value<S: Simd>(&self, s: S, u: S::F) -> S::F {
        let q = s.max(s.sub(s.splat(1.0), u), s.splat(HELD));
        s.mul(s.splat(self.radius_sq), s.div(s.min(u, s.splat(1.0 - HELD)), q))
    }

    #[inline(always)]
    fn slope<S: Simd>(&self, s: S, u: S::F) -> S::F {
        let q = s.sub(s.splat(1.0), u);
        let held = s.max(q, s.splat(HELD));
        let slope = s.div(s.splat(self.radius_sq), s.mul(held, held));
        s.select(s.gt(s.splat(HELD), q), s.splat(0.0), s.select(s.gt(u, s.splat(0.0)), slope, s.splat(0.0)))
    }
}

impl Falloff for Spline {
    #[inline(always)]
    fn value<S: Simd>(&self, s: S, u: S::F) -> S::F {
        half_spline(s, s.sub(s.splat(1.0), u))
    }

    #[inline(always)]
    fn slope<S: Simd>(&self, s: S, u: S::F) -> S::F {
        // −g′(s)/s is twice the derivative by u, since du = −2 s ds.
        s.mul(s.splat(0.5), half_spline_slope(s, s.sub(s.splat(1.0), u)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(f: impl Falloff, u: f64) -> f64 {
        f64::from(f.value(Portable, [u as f32; LANES])[5])
    }

    fn each(check: impl Fn(&str, &dyn Fn(f64) -> f64, &dyn Fn(f64) -> f64, &dyn Fn(f64) -> f64)) {
        fn run<F: Falloff>(
            f: F,
            name: &str,
            textbook: &dyn Fn(f64) -> f64,
            check: &impl Fn(&str, &dyn Fn(f64) -> f64, &dyn Fn(f64) -> f64, &dyn Fn(f64) -> f64),
        ) {
            check(name, &|u| value(f, u), &|u| f64::from(f.slope(Portable, [u as f32; LANES])[0]), textbook);
        }
        run(Triquet, "Triquet", &|s| s.powi(4) / 4.0 - s * s / 2.0 + 0.25, &check);
        let wyvill = |s: f64| 1.0 - 4.0 / 9.0 * s.powi(6) + 17.0 / 9.0 * s.powi(4) - 22.0 / 9.0 * s.powi(2);
        run(Wyvill, "Wyvill", &wyvill, &check);
        let inverse = |s: f64| 0.09 * (1.0 / s.max(1.0 / 32.0).powi(2) - 1.0);
        run(InverseSquare { radius_sq: 0.09 }, "inverse square", &inverse, &check);
        let spline = |s: f64| if s < 0.5 { 0.5 - 3.0 * s * s + 3.0 * s.powi(3) } else { (1.0 - s).powi(3) };
        run(Spline, "spline", &spline, &check);
    }

    #[test]
    fn values_are_the_textbooks_and_end_at_exactly_zero() {
        each(|name, value, _, textbook| {
            for i in 0..=1000 {
                let s = f64::from(i) / 1000.0;
                let want = textbook(s);
                // Close to a particle the inverse square feels the rounding of u.
                let tolerance = 2e-6 * want.abs().max(1.0) + 1e-7 * want.abs() / (s * s).max(1e-3);
                assert!((value(1.0 - s * s) - want).abs() <= tolerance, "{name} at {s}");
            }
            assert_eq!(value(0.0), 0.0, "{name}");
        });
    }

    #[test]
    fn slopes_are_derivatives_and_values_never_fall() {
        each(|name, value, slope, textbook| {
            assert_eq!(slope(0.0), 0.0, "{name}");
            let mut last = 0.0;
            for i in 1..=990 {
                let u = f64::from(i) / 1000.0;
                let e = 1e-6;
                let by_difference = (textbook((1.0 - u - e).sqrt()) - textbook((1.0 - u + e).sqrt())) / (2.0 * e);
                assert!((slope(u) - by_difference).abs() < 1e-3 * by_difference.abs().max(1.0), "{name} at {u}");
                assert!(slope(u) >= 0.0 && value(u) >= last, "{name} falls at {u}");
                last = value(u);
            }
        });
    }
}
