//! How crowded a particle is: what smoothing goes by.
//!
//! ```text
//! n_i = Σ_{j≠i} (1 − |x_i − x_j|²/h²)₊
//! ```
//!
//! without unit, 0 for a lone particle, about 13 within a fluid whose spacing is half of h.
//!
//! Source: Löschner, Böttcher, Jeske, Bender, Weighted Laplacian Smoothing for Surface Reconstruction of Particle-based
//! Fluids, 2023, section 4.

use super::around::{Around, around};
use crate::{
    Control, Error, Lanes, Positions, Stage,
    lattice::Lattice,
    lookup::cells::Cells,
    math::simd::{Simd, Unit},
};

/// The sum above.
struct Crowding;

impl Around for Crowding {
    const OUT: usize = 1;
    type Sums<S: Simd> = S::F;

    #[inline(always)]
    fn zero<S: Simd>(&self, s: S) -> S::F {
        s.splat(0.0)
    }

    #[inline(always)]
    fn add<S: Simd>(&self, s: S, sums: &mut S::F, _d: [S::F; 3], dist_sq: S::F, _mass: S::F, _own: usize) {
        *sums = s.add(*sums, s.max(s.sub(s.splat(1.0), dist_sq), s.splat(0.0)));
    }

    /// The particle itself brought 1.
    #[inline(always)]
    fn finish<S: Simd>(&self, s: S, sums: S::F, _own: usize, to: &mut [f32]) {
        to[0] = (s.sum(sums) - 1.0).max(0.0);
    }
}

/// How crowded each particle is, in the caller's order; `support` is h, in world units. Runs in the current rayon pool.
///
/// ```
/// let positions = [[0.0f32, 0.0, 0.0], [0.05, 0.0, 0.0], [9.0, 0.0, 0.0]];
/// let n = pellicle::crowding((&positions).into(), 0.1, &pellicle::Control::default())?;
/// assert!((n[0] - 0.75).abs() < 1e-5 && n[2] == 0.0);
/// # Ok::<(), pellicle::Error>(())
/// ```
///
/// # Errors
/// [`Error::Parameter`] for a support that is not positive, [`Error::NotFinite`] and [`Error::OutsideLattice`] for the
/// first particle that cannot be placed, [`Error::Count`] for more than a `u32` counts, [`Error::Cancelled`].
pub fn crowding(positions: Positions<'_>, support: f64, control: &Control<'_>) -> Result<Vec<f32>, Error> {
    if !(support.is_normal() && support > 0.0) {
        return Err(Error::Parameter { name: "support", value: support, must: "greater than 0" });
    }
    control.begin(Stage::Sort)?;
    let mut cells = Cells::default();
    cells.build(positions, Lattice { spacing: support, support })?;
    control.begin(Stage::Density)?;
    let unit = Unit::new(Lanes::Auto).expect("every machine has one");
    let mut sorted = Vec::new();
    around(unit, &cells, &Crowding, None, control, &mut sorted);
    control.check()?;
    let mut to = vec![0.0; cells.len()];
    for (&index, &sum) in cells.order().iter().zip(&sorted) {
        to[index as usize] = sum;
    }
    Ok(to)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equals_the_sum_over_all_pairs() {
        let positions: Vec<[f64; 3]> =
            (0..500).map(|i| [i * 37 % 101, i * 53 % 97, i * i % 89].map(|v| f64::from(v) * 0.01)).collect();
        let found = crowding((&positions).into(), 0.3, &Control::default()).unwrap();
        for (i, (a, found)) in positions.iter().zip(found).enumerate() {
            let others = positions.iter().enumerate().filter(|&(j, _)| j != i);
            let dist_sq = others.map(|(_, b)| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>());
            let want: f64 = dist_sq.map(|d| (1.0 - d / 0.09).max(0.0)).sum();
            assert!((f64::from(found) - want).abs() < 1e-4 * (1.0 + want), "{i}: {found} {want}");
        }
    }

    #[test]
    fn nothing_and_nonsense() {
        let none: &[[f32; 3]] = &[];
        assert!(crowding(none.into(), 1.0, &Control::default()).unwrap().is_empty());
        assert!(matches!(crowding(none.into(), f64::NAN, &Control::default()), Err(Error::Parameter { .. })));
    }
}
