//! The SPH colour field: Σ V_j W(|x − x_j|), about 1 inside a fluid and 0 outside, the field that splashsurf uses.
//!
//! One column: the weight 1/G_j of [`density`](super::density), so that the field is Σ_j g(|x − x_j|)/G_j.
//!
//! [`SphOfRadii`] is the same where particles have radii of their own, hence supports of their own.
//!
//! Source: Müller, Charypar, Gross, Particle-based fluid simulation for interactive applications, 2003, section 4 (there
//! the colour is 1 at each particle; the volumes are the same).

use super::{Bounds, Field, Row, kernel};
use crate::math::simd::Simd;

/// The colour field and its isovalue.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sph {
    pub(crate) iso: f32,
    /// Support radius over the rest spacing of the particles.
    pub(crate) particles_per_support: f32,
}

impl Field for Sph {
    const COLUMNS: usize = 1;
    const PLANES: usize = 4;
    const ADDITIVE: bool = true;
    type Sums<S: Simd> = S::F;
    type Slope<S: Simd> = [S::F; 3];
    type Bend<S: Simd> = ();

    #[inline(always)]
    fn zero<S: Simd>(&self, s: S) -> S::F {
        s.splat(0.0)
    }

    #[inline(always)]
    fn add_kernels<S: Simd>(&self, s: S, sums: &mut S::F, _d: [S::F; 3], [dist_sq, _]: [S::F; 2], row: Row<'_>) {
        *sums = s.add(*sums, s.mul(s.splat(row.get(0)), kernel::half_spline(s, dist_sq)));
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
    fn add_slope<S: Simd>(&self, s: S, slope: &mut [S::F; 3], d: [S::F; 3], dist_sq: S::F, row: Row<'_>) {
        let steep = s.mul(s.splat(row.get(0)), kernel::half_spline_slope(s, dist_sq));
        for a in 0..3 {
            slope[a] = s.sub(slope[a], s.mul(steep, d[a]));
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
        s.mul(s.splat(row.get(0)), kernel::half_spline(s, dist_sq))
    }

    fn iso(&self) -> f32 {
        self.iso
    }

    fn bounds(&self) -> Option<Bounds> {
        // No point is farther than 0.433 support radii from the nearest sample. At that distance a lone particle, the
        // sharpest peak there is, is still worth 0.36 of its height, so a third of the isovalue sees a drop even in the
        // middle of a coarse cell. Holes are blunter, because the particles around one fill it in: on the frames tried a
        // margin of 0.2 saw all of them, and no margin on either side lost up to 1 vertex in 190. At low isovalues holes
        // are sharper, hence the least bound. A few particles in a well chosen cage can make a hole that all eight corners
        // miss, so where there are fewer than a quarter of a fluid's, no samples are trusted. A high isovalue leaves
        // nothing above its bound and costs time, not truth.
        Some(Bounds {
            apart: 0.5,
            outside_below: 0.33 * self.iso,
            inside_above: (self.iso + 0.25).max(0.85),
            crowd: 0.25 * self.particles_per_support.powi(3),
        })
    }
}

/// The colour field of particles with their own supports h_j, the largest of which is one support unit.
///
/// Columns: the weight, 1/h², and the reach.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SphOfRadii {
    pub(crate) iso: f32,
    /// Support radius over the rest spacing, of each particle.
    pub(crate) particles_per_support: f32,
    /// The smallest support, in support units.
    pub(crate) smallest: f32,
}

impl Field for SphOfRadii {
    const COLUMNS: usize = 3;
    const PLANES: usize = 4;
    const ADDITIVE: bool = true;
    const REACH: Option<usize> = Some(2);
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
    fn add_slope<S: Simd>(&self, s: S, slope: &mut [S::F; 3], d: [S::F; 3], dist_sq: S::F, row: Row<'_>) {
        let scaled = s.mul(dist_sq, s.splat(row.get(1)));
        let steep = s.mul(s.splat(row.get(0) * row.get(1)), kernel::half_spline_slope(s, scaled));
        for a in 0..3 {
            slope[a] = s.sub(slope[a], s.mul(steep, d[a]));
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
        s.mul(s.splat(row.get(0)), kernel::half_spline(s, s.mul(dist_sq, s.splat(row.get(1)))))
    }

    fn iso(&self) -> f32 {
        self.iso
    }

    fn bounds(&self) -> Option<Bounds> {
        // As above, for the smallest particles there are: samples so close that they see its drop, and a crowd of them.
        let spacing = self.smallest / self.particles_per_support;
        Some(Bounds {
            apart: 0.5 * f64::from(self.smallest),
            outside_below: 0.33 * self.iso,
            inside_above: (self.iso + 0.25).max(0.85),
            crowd: 0.25 / spacing.powi(3),
        })
    }
}
