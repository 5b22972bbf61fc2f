//! The particles' distances to the surface, with which [`ZhuBridson`](super::zhu_bridson::ZhuBridson) is the field of Adams:
//! d̄ − |x − x̄|, flat even where radii vary, since far inside d̄ and the distance to the centre grow together.
//!
//! Adams et al. carry the distances from step to step. A single frame has no steps, so they are estimated from the particles
//! around, by what would be seen in a half-space of fluid. There, at depth z (in support radii), with the kernel (1 − s²)³,
//!
//! ```text
//! the centre is off by   o(z) = (1 − z²)⁵ / (10 (128/315 + P(z)))          P(z) = z − 4z³/3 + 6z⁵/5 − 4z⁷/7 + z⁹/9
//! the kernel's sum is    f(z) = ½ + 315/256 P(z)  of that in bulk
//! ```
//!
//! Both are inverted; the lesser of the two depths counts, at least half a spacing and at most the support. The first does not
//! depend on how dense the fluid is, but takes a lone particle and the middle of a sheet for bulk; the second tells them apart.
//! What it is not: exact near curved surfaces, where it is off by about the depth squared over the radius of curvature.
//!
//! Source: Adams, Pauly, Keiser, Guibas, Adaptively sampled particle fluids, 2007, section 5, for the field; the estimate is
//! derived here.

use super::{
    around::{Around, around},
    centre::{Brings, Centre, kernels},
};
use crate::{
    lookup::cells::Cells,
    math::simd::{Simd, Unit},
    progress::Control,
};

/// Steps of each table.
const STEPS: usize = 512;
/// The kernel's sum at the surface of a half-space, over π/4 and the density.
const HALF: f64 = 128.0 / 315.0;

/// Tables of depth by what is seen.
pub(crate) struct Depths {
    /// By the centre's offset, from 0 to that at the surface.
    by_offset: Vec<f32>,
    /// By the kernel's sum over that in bulk, from ½ to 1.
    by_sum: Vec<f32>,
    /// The kernel's sum in bulk.
    bulk: f32,
    /// Least depth in support units, where particles bring no radius.
    least: f32,
    radii: Option<Vec<f32>>,
}

/// P(z).
fn integral(z: f64) -> f64 {
    let q = z * z;
    z * (1.0 - q * (4.0 / 3.0 - q * (6.0 / 5.0 - q * (4.0 / 7.0 - q / 9.0))))
}

/// o(z).
fn offset(z: f64) -> f64 {
    (1.0 - z * z).powi(5) / (10.0 * (HALF + integral(z)))
}

/// Depths at even steps of a quantity that falls (or rises) with depth, from `at(0)` to `at(1)`.
fn table(at: impl Fn(f64) -> f64) -> Vec<f32> {
    let (first, last) = (at(0.0), at(1.0));
    (0..=STEPS)
        .map(|i| {
            let wanted = first + (last - first) * i as f64 / STEPS as f64;
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..50 {
                let middle = 0.5 * (low + high);
                let is_before = (at(middle) < wanted) == (first < last);
                *(if is_before { &mut low } else { &mut high }) = middle;
            }
            low as f32
        })
        .collect()
}

/// The table at a place from 0 to 1.
fn look_up(table: &[f32], place: f32) -> f32 {
    let x = place.clamp(0.0, 1.0) * STEPS as f32;
    let i = (x as usize).min(STEPS - 1);
    table[i] + (x - i as f32) * (table[i + 1] - table[i])
}

impl Depths {
    /// For a support of so many spacings. `radii` are the particles' own, in support units and canonical order: half of the
    /// least depth of each.
    pub(crate) fn new(particles_per_support: f64, radii: Option<Vec<f32>>) -> Self {
        Self {
            by_offset: table(offset),
            by_sum: table(integral),
            bulk: (0.5 * std::f64::consts::PI * HALF * particles_per_support.powi(3)) as f32,
            least: (0.5 / particles_per_support) as f32,
            radii,
        }
    }

    /// Writes the depth of every particle in support units, in canonical order, with zeros behind.
    pub(crate) fn write(&self, unit: Unit, cells: &Cells, control: &Control<'_>, to: &mut Vec<f32>) {
        around(unit, cells, self, None, control, to);
    }

    /// The depth where the centre is off by so much and the kernel's sum is so much.
    fn depth(&self, off: f32, sum: f32) -> f32 {
        let by_offset = look_up(&self.by_offset, 1.0 - off / offset(0.0) as f32);
        let by_sum = look_up(&self.by_sum, 2.0 * (sum / self.bulk) - 1.0);
        by_offset.min(by_sum)
    }
}

impl Around for Depths {
    const OUT: usize = 1;
    type Sums<S: Simd> = Centre<S::F>;

    #[inline(always)]
    fn zero<S: Simd>(&self, s: S) -> Centre<S::F> {
        Centre::zero(s)
    }

    #[inline(always)]
    fn add<S: Simd>(&self, s: S, sums: &mut Centre<S::F>, d: [S::F; 3], dist_sq: S::F, _mass: S::F, _own: usize) {
        sums.add(s, d, kernels(s, dist_sq, Brings::default()), Brings::default());
    }

    #[inline(always)]
    fn finish<S: Simd>(&self, s: S, sums: Centre<S::F>, own: usize, to: &mut [f32]) {
        let (sum, moment) = sums.total(s);
        let off_sq = moment.iter().map(|m| m / sum).map(|v| v * v).sum::<f32>();
        let least = self.radii.as_ref().map_or(self.least, |radii| radii[own]);
        to[0] = self.depth(off_sq.sqrt(), sum).max(least);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn in_a_half_space_of_fluid_the_depth_is_found() {
        // Midpoint sums over a fine half-space stand for the integrals.
        let depths = Depths::new(4.0, None);
        let n = 60;
        for z in [0.05, 0.125, 0.3, 0.5, 0.75] {
            let (mut sum, mut moment) = (0.0, 0.0);
            for i in 0..n * n * n {
                let p = [i % n, i / n % n, i / (n * n)].map(|v| (f64::from(v) + 0.5) / f64::from(n) * 2.0 - 1.0);
                let square: f64 = p.iter().map(|v| v * v).sum();
                // Fluid below the surface, which lies z above the particle.
                if p[2] < z && square < 1.0 {
                    sum += (1.0 - square).powi(3);
                    moment += p[2] * (1.0 - square).powi(3);
                }
            }
            let density = 64.0 * (2.0 / f64::from(n)).powi(3);
            let found = depths.depth((moment / sum).abs() as f32, (sum * density) as f32);
            assert!((f64::from(found) - z).abs() < 0.02, "{z}: {found}");
        }
    }

    #[test]
    fn a_lone_particle_is_half_a_spacing_deep_and_bulk_is_as_deep_as_the_support() {
        let depths = Depths::new(4.0, None);
        assert_eq!(depths.depth(0.0, 1.0), 0.0);
        assert!(depths.depth(0.0, 2.0 * depths.bulk) > 0.999);
        assert_eq!(depths.least, 0.125);
    }
}
