//! Yu & Turk's anisotropic kernels: Σ V_j σ det(G_j) P(‖G_j (x − x̄_j)‖), P(q) = (1 − q²)³ below q = 1, σ = 315/(64π), so that
//! it is about 1 inside and 0 outside. Each particle is an ellipsoid that lies along its neighbours, around a smoothed place.
//!
//! ```text
//! h_i            the kernel's support, l spacings                            V_i from the SPH density with support h_i
//! w_ij           1 − (d/r_i)³ within r_i = 2 h_i
//! x_i^w          Σ w x_j / Σ w                                               x̄_i = x_i + λ a (x_i^w − x_i)
//! a              min(1, Σ_{j≠i} w/4): a particle alone stays where it is
//! C_i            Σ w (x_j − x_i^w)(x_j − x_i^w)ᵀ / Σ w = R diag(σ₁ ≥ σ₂ ≥ σ₃) Rᵀ
//! Σ̃              diag(σ₁, max(σ₂, σ₁/k_r), max(σ₃, σ₁/k_r)) / det^⅓           of more than N_ε neighbours, else k_n 1
//! G_i            1/h_i R Σ̃⁻¹ Rᵀ
//! ```
//!
//! Dividing by det^⅓ takes the place of the paper's k_s = 1400, which depends on its units; an ellipsoid then has the volume of
//! its ball. The longest is k_r^⅔ times as long as a ball is wide: that is the support radius of the lookup; each particle's own
//! reach is kept beside it.
//!
//! Columns: G_xx, G_xy, G_xz, G_yy, G_yz, G_zz, the weight V σ det G, the reach.
//!
//! Source: Yu, Turk, Reconstructing surfaces of particle-based fluids using anisotropic kernels, 2010 and 2013; the factor a
//! after public code that keeps splashes; the normalisation by det^⅓ is ours.

use super::{
    Bounds, Field, Row,
    around::{Around, around},
    kernel::half_spline,
};
use crate::{
    lookup::cells::Cells,
    math::{
        jacobi::{Symmetric, cube_root, eigen},
        simd::{Simd, Unit},
    },
    progress::Control,
};

/// The field and its isovalue.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Anisotropic {
    pub(crate) iso: f32,
    /// Support radius of the lookup over the rest spacing.
    pub(crate) particles_per_support: f32,
    /// The smallest particle's radius over the largest one's.
    pub(crate) smallest: f32,
}

/// Numbers of a particle's surroundings.
pub(crate) const RECORD: usize = 12;
/// Columns of the field.
pub(crate) const COLUMNS: usize = 8;

/// Sums over what is around each particle, in units of the largest 2 h: V's weight, Σw, Σw d, Σw d dᵀ, number.
pub(crate) struct Surroundings<'a> {
    /// ∝ r³.
    pub(crate) masses: &'a [f32],
    /// 1/h², in units of the largest 2 h.
    pub(crate) per_support_sq: &'a [f32],
}

impl Surroundings<'_> {
    /// Writes [`RECORD`] numbers for every particle, in canonical order.
    pub(crate) fn write(&self, unit: Unit, cells: &Cells, control: &Control<'_>, to: &mut Vec<f32>) {
        around(unit, cells, self, Some(self.masses), control, to);
    }
}

/// Sums in lanes.
#[derive(Clone, Copy)]
pub(crate) struct Moments<F> {
    density: F,
    weight: F,
    first: [F; 3],
    second: [F; 6],
    count: F,
}

impl Around for Surroundings<'_> {
    const OUT: usize = RECORD;
    type Sums<S: Simd> = Moments<S::F>;

    #[inline(always)]
    fn zero<S: Simd>(&self, s: S) -> Moments<S::F> {
        let zero = s.splat(0.0);
        Moments { density: zero, weight: zero, first: [zero; 3], second: [zero; 6], count: zero }
    }

    #[inline(always)]
    fn add<S: Simd>(&self, s: S, sums: &mut Moments<S::F>, d: [S::F; 3], dist_sq: S::F, mass: S::F, own: usize) {
        let in_h = s.mul(dist_sq, s.splat(self.per_support_sq[own]));
        sums.density = s.add(sums.density, s.mul(mass, half_spline(s, in_h)));
        let in_r = s.mul(in_h, s.splat(0.25));
        let w = s.max(s.sub(s.splat(1.0), s.mul(in_r, s.sqrt(in_r))), s.splat(0.0));
        sums.weight = s.add(sums.weight, w);
        let weighted = [s.mul(w, d[0]), s.mul(w, d[1]), s.mul(w, d[2])];
        for a in 0..3 {
            sums.first[a] = s.add(sums.first[a], weighted[a]);
        }
        let mut i = 0;
        for a in 0..3 {
            for b in a..3 {
                sums.second[i] = s.add(sums.second[i], s.mul(weighted[a], d[b]));
                i += 1;
            }
        }
        let is_near = s.gt(w, s.splat(0.0));
        sums.count = s.add(sums.count, s.select(is_near, s.splat(1.0), s.splat(0.0)));
    }

    #[inline(always)]
    fn finish<S: Simd>(&self, s: S, sums: Moments<S::F>, own: usize, to: &mut [f32]) {
        to[0] = self.masses[own] / s.sum(sums.density);
        to[1] = s.sum(sums.weight);
        (0..3).for_each(|a| to[2 + a] = s.sum(sums.first[a]));
        (0..6).for_each(|a| to[5 + a] = s.sum(sums.second[a]));
        to[11] = s.sum(sums.count);
    }
}

/// How ellipsoids are made of surroundings.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shapes {
    /// λ.
    pub(crate) smoothing: f64,
    /// k_r.
    pub(crate) max_stretch: f64,
    /// k_n.
    pub(crate) isolated_scale: f64,
    /// N_ε.
    pub(crate) min_neighbors: f64,
}

impl Shapes {
    /// How far an ellipsoid reaches at most, in h.
    pub(crate) fn longest(&self) -> f64 {
        cube_root(self.max_stretch * self.max_stretch).max(self.isolated_scale).max(1.0) * 1.000_1
    }

    /// How far a particle is moved, in units of the largest 2 h.
    pub(crate) fn shift(&self, record: &[f32]) -> [f64; 3] {
        let weight = f64::from(record[1]);
        // Itself weighs 1.
        let others = (0.25 * (weight - 1.0)).clamp(0.0, 1.0);
        std::array::from_fn(|a| -self.smoothing * others * f64::from(record[2 + a]) / weight)
    }

    /// The columns of a particle whose h is so many units of lookup.
    pub(crate) fn columns(&self, record: &[f32], h: f64) -> [f32; COLUMNS] {
        let (scales, axes) = self.ellipsoid(record);
        let per_h = scales.map(|v| 1.0 / (h * v));
        let entry = |a: usize, b: usize| (0..3).map(|k| per_h[k] * axes[k][a] * axes[k][b]).sum::<f64>() as f32;
        // V is 16/π of its weight, in h³; σ det G beside it.
        let weight = f64::from(record[0]) * (315.0 / 1024.0) / (scales[0] * scales[1] * scales[2]);
        let reach = h * scales.iter().copied().fold(0.0, f64::max);
        let matrix = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].map(|(a, b)| entry(a, b));
        let [xx, xy, xz, yy, yz, zz] = matrix;
        [xx, xy, xz, yy, yz, zz, weight as f32, (reach * reach * 1.000_01) as f32]
    }

    /// Half axes in h, and their directions.
    fn ellipsoid(&self, record: &[f32]) -> ([f64; 3], [[f64; 3]; 3]) {
        let record: [f64; RECORD] = std::array::from_fn(|i| f64::from(record[i]));
        let mean: [f64; 3] = std::array::from_fn(|a| record[2 + a] / record[1]);
        let [xx, xy, xz, yy, yz, zz]: [f64; 6] = std::array::from_fn(|i| {
            let (a, b) = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)][i];
            record[5 + i] / record[1] - mean[a] * mean[b]
        });
        let covariance: Symmetric = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
        let (values, axes) = eigen(covariance);
        // All at one point: no direction stands out. (Sizes are of neighbourhoods: 1e-6 is a thousandth of one.)
        if record[11] - 1.0 <= self.min_neighbors || values[0] < 1e-6 {
            return ([self.isolated_scale; 3], axes);
        }
        let least = values[0] / self.max_stretch;
        let scales = [values[0], values[1].max(least), values[2].max(least)];
        let size = cube_root(scales[0] * scales[1] * scales[2]);
        (scales.map(|v| v / size), axes)
    }
}

/// G d. No closure: it need not be inlined, and then runs without the vector unit's instructions.
#[inline(always)]
fn stretched<S: Simd>(s: S, d: [S::F; 3], row: Row<'_>) -> [S::F; 3] {
    [product(s, d, row, [0, 1, 2]), product(s, d, row, [1, 3, 4]), product(s, d, row, [2, 4, 5])]
}

/// One row of G, in these columns, times d.
#[inline(always)]
fn product<S: Simd>(s: S, d: [S::F; 3], row: Row<'_>, [i, j, k]: [usize; 3]) -> S::F {
    let xy = s.add(s.mul(s.splat(row.get(i)), d[0]), s.mul(s.splat(row.get(j)), d[1]));
    s.add(xy, s.mul(s.splat(row.get(k)), d[2]))
}

/// 1 − ‖q‖², at least 0.
#[inline(always)]
fn rest<S: Simd>(s: S, q: [S::F; 3]) -> S::F {
    let q_sq = s.add(s.add(s.mul(q[0], q[0]), s.mul(q[1], q[1])), s.mul(q[2], q[2]));
    s.max(s.sub(s.splat(1.0), q_sq), s.splat(0.0))
}

impl Field for Anisotropic {
    const COLUMNS: usize = COLUMNS;
    const PLANES: usize = 4;
    const ADDITIVE: bool = true;
    const REACH: Option<usize> = Some(7);
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

    /// −6 V σ det(G) (1 − q²)² G G d, but for the 6.
    #[inline(always)]
    fn add_slope<S: Simd>(&self, s: S, slope: &mut [S::F; 3], d: [S::F; 3], _dist_sq: S::F, row: Row<'_>) {
        let q = stretched(s, d, row);
        let t = rest(s, q);
        let steep = s.mul(s.splat(row.get(6)), s.mul(t, t));
        let twice = stretched(s, q, row);
        for a in 0..3 {
            slope[a] = s.sub(slope[a], s.mul(steep, twice[a]));
        }
    }

    #[inline(always)]
    fn bend<S: Simd>(&self, _: S, _: &[S::F; 3]) {}

    #[inline(always)]
    fn gradient<S: Simd>(&self, _: S, slope: [S::F; 3], (): ()) -> [S::F; 3] {
        slope
    }

    #[inline(always)]
    fn weight<S: Simd>(&self, s: S, d: [S::F; 3], _dist_sq: S::F, row: Row<'_>) -> S::F {
        let t = rest(s, stretched(s, d, row));
        s.mul(s.splat(row.get(6)), s.mul(s.mul(t, t), t))
    }

    fn iso(&self) -> f32 {
        self.iso
    }

    fn bounds(&self) -> Option<Bounds> {
        // The thinnest part of a surface is a sheet of discs, 0.8 spacings to each side; some sample a spacing apart lies within
        // half of that, where it is still worth a tenth of the isovalue. A lone ball of half the size is, too.
        let spacings = f64::from(self.particles_per_support / self.smallest);
        Some(Bounds {
            apart: 1.01 / spacings,
            outside_below: 0.1 * self.iso,
            inside_above: self.iso + 0.3,
            // Most particles reach far less than the support; of a quarter of a fluid's particles a brick sees so many.
            crowd: 0.03 * (spacings as f32).powi(3),
        })
    }
}
