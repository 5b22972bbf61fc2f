//! SPH densities, as what the colour field needs of them.
//!
//! With equal masses m and the kernel W = 16/(π h³) g (see [`kernel`](super::kernel)), the volume of particle j is
//! V_j = m/ρ_j = 1/Σ_k W(x_j − x_k), itself included, so the colour field Σ V_j W is Σ_j g(x − x_j)/G_j with
//! G_j = Σ_k g(x_j − x_k): mass, rest density and the kernel's factor cancel. This stage computes the weights 1/G_j.
//!
//! G_j ≥ ½, so weights are finite and at most 2.
//!
//! Where particles have radii of their own, particle j has the mass m_j ∝ r_j³ and the support h_j ∝ r_j. Its density is summed
//! with its own support, ρ_j = Σ_k m_k W(x_j − x_k, h_j), and the weight that stands before g((x − x_j)/h_j) is
//! m_j/Σ_k m_k g((x_j − x_k)/h_j): h_j³ cancels, too. A lone particle's field is 1 at its middle, whatever its radius.
//!
//! Source: Müller, Charypar, Gross, Particle-based fluid simulation for interactive applications, 2003, equations 3, 15.

use super::{
    around::{Around, around},
    kernel::half_spline,
};
use crate::{
    lookup::cells::Cells,
    math::simd::{Simd, Unit},
    progress::Control,
};

/// Writes the weight 1/G of every particle, in canonical order, with zeros behind.
pub(crate) fn weights(unit: Unit, cells: &Cells, control: &Control<'_>, to: &mut Vec<f32>) {
    around(unit, cells, &Equal, None, control, to);
}

/// Particles of one mass and one support.
struct Equal;

impl Around for Equal {
    const OUT: usize = 1;
    type Sums<S: Simd> = S::F;

    #[inline(always)]
    fn zero<S: Simd>(&self, s: S) -> S::F {
        s.splat(0.0)
    }

    #[inline(always)]
    fn add<S: Simd>(&self, s: S, sums: &mut S::F, _d: [S::F; 3], dist_sq: S::F, _mass: S::F, _own: usize) {
        *sums = s.add(*sums, half_spline(s, dist_sq));
    }

    #[inline(always)]
    fn finish<S: Simd>(&self, s: S, sums: S::F, _own: usize, to: &mut [f32]) {
        to[0] = 1.0 / s.sum(sums);
    }
}

/// Particles with masses, and with supports as one over the square of each, in support units.
pub(crate) struct Own<'a> {
    pub(crate) masses: &'a [f32],
    pub(crate) per_support_sq: &'a [f32],
}

impl Own<'_> {
    /// Writes the weight of every particle, in canonical order, with zeros behind.
    pub(crate) fn weights(&self, unit: Unit, cells: &Cells, control: &Control<'_>, to: &mut Vec<f32>) {
        around(unit, cells, self, Some(self.masses), control, to);
    }
}

impl Around for Own<'_> {
    const OUT: usize = 1;
    type Sums<S: Simd> = S::F;

    #[inline(always)]
    fn zero<S: Simd>(&self, s: S) -> S::F {
        s.splat(0.0)
    }

    #[inline(always)]
    fn add<S: Simd>(&self, s: S, sums: &mut S::F, _d: [S::F; 3], dist_sq: S::F, mass: S::F, own: usize) {
        let scaled = s.mul(dist_sq, s.splat(self.per_support_sq[own]));
        *sums = s.add(*sums, s.mul(mass, half_spline(s, scaled)));
    }

    #[inline(always)]
    fn finish<S: Simd>(&self, s: S, sums: S::F, own: usize, to: &mut [f32]) {
        to[0] = self.masses[own] / s.sum(sums);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{field::kernel::half_spline_scalar, lattice::Lattice, math::simd::Portable};

    #[test]
    fn weights_are_one_over_the_sum_over_all_particles() {
        let positions: Vec<[f32; 3]> = (0..1500)
            .map(|i| {
                [
                    (i % 11) as f32 * 0.31 - 2.0,
                    (i / 11 % 11) as f32 * 0.29,
                    (i / 121) as f32 * 0.33 + (i % 7) as f32 * 0.01,
                ]
            })
            .collect();
        let lattice = Lattice { spacing: 0.1, support: 0.8 };
        let mut cells = Cells::default();
        cells.build((&positions).into(), lattice).unwrap();
        let mut found = Vec::new();
        weights(Unit::Portable(Portable), &cells, &Control::default(), &mut found);
        for (i, &index) in cells.order().iter().enumerate() {
            let at = positions[index as usize];
            let sum: f64 = positions
                .iter()
                .map(|p| (0..3).map(|a| f64::from(p[a] - at[a]).powi(2)).sum::<f64>() / 0.64)
                .map(|d| f64::from(half_spline_scalar(d as f32)))
                .sum();
            assert!((f64::from(found[i]) * sum - 1.0).abs() < 1e-5, "particle {index}: {} {}", found[i], 1.0 / sum);
        }
    }
}
