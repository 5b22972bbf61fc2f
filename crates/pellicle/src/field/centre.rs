//! Sums for fields that measure the distance to a weighted centre of the particles around.
//!
//! With d = x − x_j, t = max(1 − d², 0) (lengths in support radii) and weights k_j = m_j t³:
//!
//! ```text
//! x − x̄        = Σ k d / Σ k
//! J = ∂x̄/∂x    = 6/W Σ m t² (x_j − x̄)(x_j − x)ᵀ = 6/W (S₂ − (x − x̄) S₁ᵀ)     S₁ = Σ m t² d,  S₂ = Σ m t² d dᵀ
//! ∂|x − x̄|/∂x  = n − Jᵀ n = n − 6/W (S₂ n − |x − x̄| S₁)                         n = (x − x̄)/|x − x̄|
//! ∂r̄/∂x        = −6/W (Σ m t² r d − r̄ S₁)                                       r̄ = Σ k r / Σ k
//! ```
//!
//! One pass gives all; nothing is lost to cancellation that a field would need, since S₂ and (x − x̄) S₁ᵀ are of one size only
//! where J is small.
//!
//! **Outside, proven.** Each of these fields is at most r̄ − |x − x̄|, from which [`fill::prove`](crate::fill::prove) proves boxes to be
//! outside. Between splashes, where the centre moves fast and thin blobs arise, it cannot, and nodes are evaluated one by one.
//!
//! Source: Zhu, Bridson, Animating sand as a fluid, 2005, for the weighted centre; the Jacobian in this form and the proof
//! are derived here and tested.

use super::Row;
use crate::{lookup::gather::MAX_COLUMNS, math::simd::Simd};

/// Σk, Σk d and Σk r: what the value needs.
#[derive(Clone, Copy)]
pub(crate) struct Centre<F> {
    pub(crate) weight: F,
    moment: [F; 3],
    radius: F,
}

/// A particle's factor of its weight and its radius, where it brings them.
#[derive(Clone, Copy, Default)]
pub(crate) struct Brings {
    pub(crate) mass: Option<f32>,
    pub(crate) radius: Option<f32>,
}

impl Brings {
    /// The columns 0 and 1, or as many of them as there are: first the mass, then the radius.
    #[inline(always)]
    pub(crate) fn of(row: Row<'_>, mass: bool, radius: bool) -> Self {
        Self { mass: mass.then(|| row.get(0)), radius: radius.then(|| row.get(usize::from(mass))) }
    }
}

/// t² and t³, times the mass.
#[inline(always)]
pub(crate) fn kernels<S: Simd>(s: S, dist_sq: S::F, brings: Brings) -> [S::F; 2] {
    let t = s.max(s.sub(s.splat(1.0), dist_sq), s.splat(0.0));
    let mut slope = s.mul(t, t);
    if let Some(mass) = brings.mass {
        slope = s.mul(slope, s.splat(mass));
    }
    [slope, s.mul(slope, t)]
}

/// The weight k of a particle.
#[inline(always)]
pub(crate) fn weight<S: Simd>(s: S, dist_sq: S::F, brings: Brings) -> S::F {
    kernels(s, dist_sq, brings)[1]
}

impl<F: Copy> Centre<F> {
    #[inline(always)]
    pub(crate) fn zero<S: Simd<F = F>>(s: S) -> Self {
        let zero = s.splat(0.0);
        Self { weight: zero, moment: [zero; 3], radius: zero }
    }

    /// Adds a particle of these [`kernels`].
    #[inline(always)]
    pub(crate) fn add<S: Simd<F = F>>(&mut self, s: S, d: [F; 3], [_, k]: [F; 2], brings: Brings) {
        self.weight = s.add(self.weight, k);
        for a in 0..3 {
            self.moment[a] = s.add(self.moment[a], s.mul(k, d[a]));
        }
        if let Some(radius) = brings.radius {
            self.radius = s.add(self.radius, s.mul(k, s.splat(radius)));
        }
    }

    /// Σk and Σk d over all lanes.
    #[inline(always)]
    pub(crate) fn total<S: Simd<F = F>>(&self, s: S) -> (f32, [f32; 3]) {
        let m = &self.moment;
        (s.sum(self.weight), [s.sum(m[0]), s.sum(m[1]), s.sum(m[2])])
    }

    /// Where the particles weigh seven tenths of what they do in a fluid, or more: as beneath its surface from where samples are
    /// [clear](bounds) of it.
    #[inline(always)]
    pub(crate) fn is_dense<S: Simd<F = F>>(&self, s: S, particles_per_support: f32) -> u16 {
        /// ∫ t³ over the support.
        const FULL: f32 = 0.638_3;
        let n = particles_per_support;
        s.gt(self.weight, s.splat(0.7 * FULL * n * n * n))
    }

    /// 1/Σk; large where no particle is.
    #[inline(always)]
    pub(crate) fn inverse_weight<S: Simd<F = F>>(&self, s: S) -> F {
        s.div(s.splat(1.0), s.max(self.weight, s.splat(1e-30)))
    }

    /// x − x̄ and its length.
    #[inline(always)]
    pub(crate) fn offset<S: Simd<F = F>>(&self, s: S, inverse: F) -> ([F; 3], F) {
        // Written out, here and below: the array's own functions need not be inlined, and then run without the vector unit.
        let m = &self.moment;
        let off = [s.mul(m[0], inverse), s.mul(m[1], inverse), s.mul(m[2], inverse)];
        let length_sq = s.add(s.add(s.mul(off[0], off[0]), s.mul(off[1], off[1])), s.mul(off[2], off[2]));
        (off, s.sqrt(length_sq))
    }

    /// r̄, where particles bring radii, else `radius`.
    #[inline(always)]
    pub(crate) fn mean_radius<S: Simd<F = F>>(&self, s: S, inverse: F, brings: bool, radius: f32) -> F {
        if brings { s.mul(self.radius, inverse) } else { s.splat(radius) }
    }

    /// `depth` where there are particles, and `outside`, the least value, where there are none.
    #[inline(always)]
    pub(crate) fn or_outside<S: Simd<F = F>>(&self, s: S, depth: F, outside: f32) -> F {
        s.select(s.gt(self.weight, s.splat(0.0)), depth, s.splat(outside))
    }
}

/// What [`Field::pull`](super::Field::pull) tells of 16 particles from `at` on: masses from the column `mass`, radii from `radius`, or the
/// common one.
#[inline(always)]
pub(crate) fn pull<S: Simd>(
    s: S,
    columns: &[&[f32]; MAX_COLUMNS],
    at: usize,
    mass: Option<usize>,
    radius: Result<usize, f32>,
    iso: f32,
) -> [S::F; 2] {
    let mass = match mass {
        Some(column) => s.load(&columns[column][at..]),
        None => s.splat(1.0),
    };
    match radius {
        Ok(column) => [mass, s.sub(s.load(&columns[column][at..]), s.splat(iso))],
        Err(radius) => [mass, s.splat(radius - iso)],
    }
}

/// A centre with what its derivatives need.
#[derive(Clone, Copy)]
pub(crate) struct Spread<F> {
    pub(crate) centre: Centre<F>,
    pub(crate) first: [F; 3],
    /// Symmetric: xx, xy, xz, yy, yz, zz.
    second: [F; 6],
    radii: [F; 3],
}

impl<F: Copy> Spread<F> {
    #[inline(always)]
    pub(crate) fn zero<S: Simd<F = F>>(s: S) -> Self {
        let zero = s.splat(0.0);
        Self { centre: Centre::zero(s), first: [zero; 3], second: [zero; 6], radii: [zero; 3] }
    }

    /// Its numbers but for radii: Σk, Σk d, S₁, S₂.
    #[cfg(feature = "internals")]
    #[inline(always)]
    pub(crate) fn channels(&self) -> [F; 13] {
        let Self { centre: Centre { weight, moment: m, .. }, first: f, second: s, .. } = *self;
        [weight, m[0], m[1], m[2], f[0], f[1], f[2], s[0], s[1], s[2], s[3], s[4], s[5]]
    }

    /// Of [`channels`](Self::channels).
    #[cfg(feature = "internals")]
    #[inline(always)]
    pub(crate) fn from_channels<S: Simd<F = F>>(s: S, v: &[F; 13]) -> Self {
        let zero = s.splat(0.0);
        Self {
            centre: Centre { weight: v[0], moment: [v[1], v[2], v[3]], radius: zero },
            first: [v[4], v[5], v[6]],
            second: [v[7], v[8], v[9], v[10], v[11], v[12]],
            radii: [zero; 3],
        }
    }

    /// Adds a particle of these [`kernels`], all but what the derivative of r̄ needs.
    #[inline(always)]
    pub(crate) fn add<S: Simd<F = F>>(&mut self, s: S, d: [F; 3], [slope, k]: [F; 2], brings: Brings) {
        self.centre.add(s, d, [slope, k], brings);
        let steep = [s.mul(slope, d[0]), s.mul(slope, d[1]), s.mul(slope, d[2])];
        for a in 0..3 {
            self.first[a] = s.add(self.first[a], steep[a]);
        }
        let mut i = 0;
        for a in 0..3 {
            for b in a..3 {
                self.second[i] = s.add(self.second[i], s.mul(steep[a], d[b]));
                i += 1;
            }
        }
    }

    /// Adds a particle, and what the derivative of r̄ needs.
    #[inline(always)]
    pub(crate) fn add_all<S: Simd<F = F>>(&mut self, s: S, d: [F; 3], dist_sq: F, brings: Brings) {
        let [slope, k] = kernels(s, dist_sq, brings);
        self.add(s, d, [slope, k], brings);
        if let Some(radius) = brings.radius {
            let steep = s.mul(slope, s.splat(radius));
            for a in 0..3 {
                self.radii[a] = s.add(self.radii[a], s.mul(steep, d[a]));
            }
        }
    }

    /// J, with x − x̄ and 1/Σk.
    #[inline(always)]
    pub(crate) fn jacobian<S: Simd<F = F>>(&self, s: S, off: [F; 3], inverse: F) -> [[F; 3]; 3] {
        let [xx, xy, xz, yy, yz, zz] = self.second;
        let second = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
        let scale = s.mul(s.splat(6.0), inverse);
        let mut jacobian = second;
        for a in 0..3 {
            for b in 0..3 {
                jacobian[a][b] = s.mul(scale, s.sub(second[a][b], s.mul(off[a], self.first[b])));
            }
        }
        jacobian
    }

    /// ∂|x − x̄|/∂x.
    #[inline(always)]
    pub(crate) fn distance_gradient<S: Simd<F = F>>(
        &self,
        s: S,
        jacobian: &[[F; 3]; 3],
        off: [F; 3],
        length: F,
    ) -> [F; 3] {
        let inverse = s.div(s.splat(1.0), s.max(length, s.splat(1e-12)));
        let n = [s.mul(off[0], inverse), s.mul(off[1], inverse), s.mul(off[2], inverse)];
        let mut gradient = n;
        for b in 0..3 {
            let turned =
                s.add(s.add(s.mul(jacobian[0][b], n[0]), s.mul(jacobian[1][b], n[1])), s.mul(jacobian[2][b], n[2]));
            gradient[b] = s.sub(n[b], turned);
        }
        gradient
    }

    /// ∂r̄/∂x; zero where particles bring no radii.
    #[inline(always)]
    pub(crate) fn radius_gradient<S: Simd<F = F>>(&self, s: S, inverse: F, mean: F, brings: bool) -> [F; 3] {
        if !brings {
            return [s.splat(0.0); 3];
        }
        let scale = s.mul(s.splat(-6.0), inverse);
        let mut gradient = self.radii;
        for a in 0..3 {
            gradient[a] = s.mul(scale, s.sub(self.radii[a], s.mul(mean, self.first[a])));
        }
        gradient
    }
}

/// Bounds for the narrow band, with the radius in support units.
///
/// Outside is proven. Inside is not: in a fluid the value is nearly the radius, since the centre is nearly x, and bends on the
/// scale of the support. Between two samples that are clear of the isovalue by 0.6 radii and two radii apart, the value
/// would have to fall by that and rise again, each over more than half a radius; the frames and cavities tried stay far from
/// it. In [sparse](Centre::is_dense) places, where a few particles
/// move the centre, no sample is trusted.
pub(crate) fn bounds(iso: f32, radius: f32, particles_per_support: f32) -> super::Bounds {
    super::Bounds {
        apart: f64::min(0.51, 2.02 / f64::from(particles_per_support)),
        outside_below: f32::NEG_INFINITY,
        inside_above: iso + 0.6 * (radius * particles_per_support - iso).max(0.0),
        crowd: 0.5 * particles_per_support.powi(3),
    }
}
