//! Which particles lie at the surface: those that the paper's narrow band starts from.
//!
//! ```text
//! c(x) = Σ_j V_j W(x − x_j, h)         the smoothed colour field, h = 2 spacings
//! surface:  h |∇c(x_i)| > 0.4   or   fewer than 25 neighbours within h
//! ```
//!
//! At a flat surface h |∇c| is 1.4, half a spacing below, where the outermost layer of particles lies, 1.0, and below the
//! next layer's 0.1 but for the disorder of the particles; so 0.4 takes one layer, two where it is rough. The neighbours
//! find splashes, where the gradient vanishes by symmetry.
//!
//! Where particles have radii of their own, h is two of a particle's own spacings.
//!
//! Source: Müller, Charypar, Gross, Particle-based fluid simulation for interactive applications, 2003, section 4.1, and Akinci
//! et al. 2012, section 4, for the neighbours. Neither gives a threshold for the gradient; this one is made free of units. It
//! marks 11 % of a block at rest and 17 % of a pool with a drop falling in, as the paper's tables have it, but a third of a dam break
//! in full splash.

use super::{
    around::{Around, around},
    density,
    kernel::half_spline_slope,
};
use crate::{
    Control, Error, Lanes, Positions, Stage,
    lattice::Lattice,
    lookup::cells::Cells,
    math::simd::{LANES, Simd, Unit},
};

/// Support h of the colour field in particle radii.
pub(crate) const SUPPORT: f64 = 4.0;
/// Least h |∇c| of a surface particle.
const STEEP: f32 = 0.4;
/// Particles with fewer neighbours lie at the surface.
const NEIGHBOURS: f32 = 25.0;

/// The gradient's sum and the number of neighbours.
struct Slope<'a> {
    /// One over the square of each particle's own support, in support units of the lookup; empty where all are 1.
    per_support_sq: &'a [f32],
}

#[derive(Clone, Copy)]
struct Sums<F> {
    slope: [F; 3],
    count: F,
}

impl Around for Slope<'_> {
    const OUT: usize = 1;
    type Sums<S: Simd> = Sums<S::F>;

    #[inline(always)]
    fn zero<S: Simd>(&self, s: S) -> Sums<S::F> {
        Sums { slope: [s.splat(0.0); 3], count: s.splat(0.0) }
    }

    #[inline(always)]
    fn add<S: Simd>(&self, s: S, sums: &mut Sums<S::F>, d: [S::F; 3], dist_sq: S::F, mass: S::F, own: usize) {
        let per_sq = if self.per_support_sq.is_empty() { 1.0 } else { self.per_support_sq[own] };
        let scaled = s.mul(dist_sq, s.splat(per_sq));
        let slope = s.mul(mass, half_spline_slope(s, scaled));
        sums.slope[0] = s.add(sums.slope[0], s.mul(slope, d[0]));
        sums.slope[1] = s.add(sums.slope[1], s.mul(slope, d[1]));
        sums.slope[2] = s.add(sums.slope[2], s.mul(slope, d[2]));
        sums.count = s.add(sums.count, s.select(s.gt(s.splat(1.0), scaled), s.splat(1.0), s.splat(0.0)));
    }

    /// 1 at the surface, 0 elsewhere. With volumes V_j, a support of its own stands in the gradient as h⁻⁴.
    #[inline(always)]
    fn finish<S: Simd>(&self, s: S, sums: Sums<S::F>, own: usize, to: &mut [f32]) {
        let per_sq = if self.per_support_sq.is_empty() { 1.0 } else { self.per_support_sq[own] };
        let [x, y, z] = [s.sum(sums.slope[0]), s.sum(sums.slope[1]), s.sum(sums.slope[2])];
        let steep = (x * x + y * y + z * z).sqrt() * per_sq * per_sq;
        // The particle itself was counted.
        let few = s.sum(sums.count) - 1.0 < NEIGHBOURS;
        to[0] = if steep > STEEP || few { 1.0 } else { 0.0 };
    }
}

/// Finds surface particles among particles sorted with the support [`SUPPORT`]; keeps its memory.
#[derive(Default)]
pub(crate) struct Finder {
    volumes: Vec<f32>,
    /// 1 for a surface particle, else 0, in canonical order.
    pub(crate) found: Vec<f32>,
}

impl Finder {
    /// Columns that it keeps of each particle, those of radii of their own included.
    pub(crate) const COLUMNS: usize = 5;

    /// Writes [`found`](Self::found). `shares` are the particles' supports over the largest one, in canonical order, where they
    /// differ.
    pub(crate) fn find(&mut self, unit: Unit, cells: &Cells, shares: Option<&[f32]>, control: &Control<'_>) {
        let mut per_support_sq = Vec::new();
        if let Some(shares) = shares {
            let padding = [0.0; LANES];
            let masses: Vec<f32> = shares.iter().map(|v| v * v * v).chain(padding).collect();
            per_support_sq = shares.iter().map(|v| 1.0 / (v * v)).chain(padding).collect();
            let own = density::Own { masses: &masses, per_support_sq: &per_support_sq };
            own.weights(unit, cells, control, &mut self.volumes);
            // A weight is the volume over h³.
            self.volumes.iter_mut().zip(&masses).for_each(|(volume, cube)| *volume *= cube);
        } else {
            density::weights(unit, cells, control, &mut self.volumes);
        }
        around(unit, cells, &Slope { per_support_sq: &per_support_sq }, Some(&self.volumes), control, &mut self.found);
    }
}

/// Whether each particle lies at the surface, in the caller's order: its smoothed colour field is steep, or it has fewer than
/// 25 neighbours within 4 particle radii. `radius` is the particle radius, half of the spacing at rest, in world units; radii that
/// the particles bring are left aside. Runs in the current rayon pool.
///
/// It is what [`Band::Paper`](crate::Band::Paper) starts from.
///
/// ```
/// // The outside of a block of 12 × 12 × 12 particles.
/// let block = |i: i32| [i % 12, i / 12 % 12, i / 144];
/// let positions: Vec<[f32; 3]> = (0..1728).map(|i| block(i).map(|v| v as f32 * 0.1)).collect();
/// let surface = pellicle::surface_particles((&positions).into(), 0.05, &pellicle::Control::default())?;
/// for (i, at) in (0..1728).map(block).enumerate() {
///     assert_eq!(surface[i], at.iter().any(|&v| v == 0 || v == 11));
/// }
/// # Ok::<(), pellicle::Error>(())
/// ```
///
/// # Errors
/// [`Error::Parameter`] for a radius that is not positive, [`Error::NotFinite`] and [`Error::OutsideLattice`] for the
/// first particle that cannot be placed, [`Error::Count`] for more than a `u32` counts, [`Error::Cancelled`].
pub fn surface_particles(positions: Positions<'_>, radius: f64, control: &Control<'_>) -> Result<Vec<bool>, Error> {
    let support = SUPPORT * radius;
    if !(radius > 0.0 && support.is_normal() && (1.0 / support).is_normal()) {
        return Err(Error::Parameter { name: "radius", value: radius, must: "greater than 0" });
    }
    control.begin(Stage::Sort)?;
    let mut cells = Cells::default();
    cells.build(positions, Lattice { spacing: support, support })?;
    control.begin(Stage::SurfaceParticles)?;
    let unit = Unit::new(Lanes::Auto).expect("every machine has one");
    let mut finder = Finder::default();
    finder.find(unit, &cells, None, control);
    control.check()?;
    let mut to = vec![false; cells.len()];
    for (&index, &found) in cells.order().iter().zip(&finder.found) {
        to[index as usize] = found > 0.0;
    }
    Ok(to)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In double precision, pair by pair, with a support for each particle.
    fn plainly(positions: &[[f64; 3]], supports: &[f64]) -> Vec<(f64, usize)> {
        let spline = |s: f64| if s < 0.5 { 0.5 - 3.0 * s * s + 3.0 * s.powi(3) } else { (1.0 - s).max(0.0).powi(3) };
        let slope = |s: f64| if s < 0.5 { 9.0 * s - 6.0 } else { -3.0 * (1.0 - s).max(0.0).powi(2) / s };
        let off = |i: usize, j: usize| -> [f64; 3] { std::array::from_fn(|a| positions[i][a] - positions[j][a]) };
        let length = |d: [f64; 3]| d.iter().map(|v| v * v).sum::<f64>().sqrt();
        let all = 0..positions.len();
        // Mass over density, up to the factor that is one for all.
        let volume = |j: usize| {
            let h = supports[j];
            h.powi(6) / all.clone().map(|k| supports[k].powi(3) * spline(length(off(j, k)) / h)).sum::<f64>()
        };
        let volumes: Vec<f64> = all.clone().map(volume).collect();
        let judge = |i: usize| {
            let (h, mut sum, mut near) = (supports[i], [0.0; 3], 0);
            for j in all.clone().filter(|&j| j != i) {
                let (d, s) = (off(i, j), length(off(i, j)) / h);
                near += usize::from(s < 1.0);
                sum = std::array::from_fn(|a| sum[a] + volumes[j] * slope(s) * d[a]);
            }
            (length(sum) / h.powi(4), near)
        };
        all.clone().map(judge).collect()
    }

    fn scattered() -> Vec<[f64; 3]> {
        let jitter = |i: i32| f64::from(i.wrapping_mul(1_103_515_245).wrapping_add(12_345) >> 8 & 0xffff) / 65536.0;
        let place = |i: i32| [i % 12, i / 12 % 10, i / 120];
        (0..1200)
            .map(|i| std::array::from_fn(|a| f64::from(place(i)[a]) * 0.1 + 0.06 * jitter(3 * i + a as i32)))
            .collect()
    }

    #[test]
    fn equals_the_sums_over_all_pairs() {
        let positions = scattered();
        let found = surface_particles((&positions).into(), 0.05, &Control::default()).unwrap();
        let mut marked = 0;
        for (i, (steep, near)) in plainly(&positions, &vec![0.2; positions.len()]).into_iter().enumerate() {
            if (steep - 0.4).abs() > 1e-4 {
                assert_eq!(found[i], steep > 0.4 || near < 25, "{i}: {steep} {near}");
            }
            marked += usize::from(found[i]);
        }
        assert!(marked > 300 && marked < 1100, "{marked}: some of each kind");
    }

    #[test]
    fn radii_of_their_own_scale_support_and_mass() {
        let positions = scattered();
        let supports: Vec<f64> = positions.iter().map(|p| 0.15 + 0.08 * p[0]).collect();
        let largest = supports.iter().copied().fold(0.0, f64::max);
        let mut cells = Cells::default();
        cells.build((&positions).into(), Lattice { spacing: 0.1, support: largest }).unwrap();
        let shares: Vec<f32> = cells.order().iter().map(|&i| (supports[i as usize] / largest) as f32).collect();
        let mut finder = Finder::default();
        let unit = Unit::new(Lanes::Portable).unwrap();
        finder.find(unit, &cells, Some(&shares), &Control::default());
        let want = plainly(&positions, &supports);
        for (place, &i) in cells.order().iter().enumerate() {
            let (steep, near) = want[i as usize];
            if (steep - 0.4).abs() > 1e-4 {
                assert_eq!(finder.found[place] > 0.0, steep > 0.4 || near < 25, "{i}: {steep} {near}");
            }
        }
    }

    #[test]
    fn nothing_and_nonsense() {
        let none: &[[f32; 3]] = &[];
        assert!(surface_particles(none.into(), 1.0, &Control::default()).unwrap().is_empty());
        for radius in [0.0, -1.0, f64::NAN, 1e-320] {
            let result = surface_particles(none.into(), radius, &Control::default());
            assert!(matches!(result, Err(Error::Parameter { .. })), "{radius}");
        }
    }
}
