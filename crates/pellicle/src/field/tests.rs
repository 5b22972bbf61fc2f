//! Two fields to come, sketched against the interface: it must carry a weighted centre with its Jacobian (13 channels, a
//! finishing step with eigenvalues) and a matrix per particle. The sketches are checked against direct sums.

use super::*;
use crate::math::simd::Portable;

/// Solenthaler 2007 in the small: −(|x − x̄| − r f(EV)), with the Jacobian of x̄ summed beside x̄ itself.
struct Solenthaler {
    radius: f32,
}

/// Σk, Σk d and Σ(1−s²)² d dᵀ, Σ(1−s²)² d, Σ(1−s²)²: what the centred Jacobian needs, in one pass.
#[derive(Clone, Copy)]
struct Centre<F> {
    weight: F,
    moment: [F; 3],
    slope: F,
    slope_moment: [F; 3],
    slope_square: [[F; 3]; 3],
}

impl Field for Solenthaler {
    const COLUMNS: usize = 0;
    const PLANES: usize = 1;
    type Sums<S: Simd> = Centre<S::F>;

    fn zero<S: Simd>(&self, s: S) -> Centre<S::F> {
        let zero = s.splat(0.0);
        Centre { weight: zero, moment: [zero; 3], slope: zero, slope_moment: [zero; 3], slope_square: [[zero; 3]; 3] }
    }

    fn add<S: Simd>(&self, s: S, sums: &mut Centre<S::F>, d: [S::F; 3], dist_sq: S::F, _: Row<'_>) {
        let t = s.max(s.sub(s.splat(1.0), dist_sq), s.splat(0.0));
        let slope = s.mul(t, t);
        let weight = s.mul(slope, t);
        sums.weight = s.add(sums.weight, weight);
        sums.slope = s.add(sums.slope, slope);
        for a in 0..3 {
            sums.moment[a] = s.add(sums.moment[a], s.mul(weight, d[a]));
            sums.slope_moment[a] = s.add(sums.slope_moment[a], s.mul(slope, d[a]));
            for b in 0..3 {
                sums.slope_square[a][b] = s.add(sums.slope_square[a][b], s.mul(slope, s.mul(d[a], d[b])));
            }
        }
    }

    fn value<S: Simd>(&self, s: S, sums: Centre<S::F>) -> S::F {
        // d is node minus particle, so x − x̄ = Σk d / Σk; J's trace over 3 stands in for its largest eigenvalue here.
        let weight = s.max(sums.weight, s.splat(f32::MIN_POSITIVE));
        let off = sums.moment.map(|m| s.div(m, weight));
        let mut trace = s.splat(0.0);
        for a in 0..3 {
            // Σ(1−s²)² (x_a − d − x̄)(−d) with x_j − x̄ = off − d.
            let centred = s.sub(sums.slope_square[a][a], s.mul(off[a], sums.slope_moment[a]));
            trace = s.add(trace, centred);
        }
        let stretch = s.div(s.mul(s.splat(2.0), trace), weight);
        let length = s.sqrt(off.into_iter().fold(s.splat(0.0), |sum, v| s.add(sum, s.mul(v, v))));
        let factor = s.select(s.gt(stretch, s.splat(0.4)), s.splat(0.5), s.splat(1.0));
        s.sub(s.mul(s.splat(self.radius), factor), length)
    }

    fn add_gradient<S: Simd>(&self, _: S, _: &mut [S::F; 3], _: [S::F; 3], _: S::F, _: Row<'_>) {}

    fn iso(&self) -> f32 {
        0.0
    }

    fn bounds(&self) -> Option<Bounds> {
        None
    }
}

/// Yu & Turk 2010 in the small: Σ w_j P(‖G_j d‖), a symmetric matrix and a weight per particle.
struct Anisotropic;

impl Field for Anisotropic {
    const COLUMNS: usize = 7;
    const PLANES: usize = 4;
    type Sums<S: Simd> = S::F;

    fn zero<S: Simd>(&self, s: S) -> S::F {
        s.splat(0.0)
    }

    fn add<S: Simd>(&self, s: S, sums: &mut S::F, d: [S::F; 3], _: S::F, row: Row<'_>) {
        let g: [S::F; 6] = std::array::from_fn(|c| s.splat(row.get(c)));
        let product =
            |i: usize, j: usize, k: usize| s.add(s.add(s.mul(g[i], d[0]), s.mul(g[j], d[1])), s.mul(g[k], d[2]));
        let q = [product(0, 1, 2), product(1, 3, 4), product(2, 4, 5)];
        let q_sq = s.add(s.add(s.mul(q[0], q[0]), s.mul(q[1], q[1])), s.mul(q[2], q[2]));
        let t = s.max(s.sub(s.splat(1.0), q_sq), s.splat(0.0));
        *sums = s.add(*sums, s.mul(s.splat(row.get(6)), s.mul(s.mul(t, t), t)));
    }

    fn value<S: Simd>(&self, _: S, sums: S::F) -> S::F {
        sums
    }

    fn add_gradient<S: Simd>(&self, _: S, _: &mut [S::F; 3], _: [S::F; 3], _: S::F, _: Row<'_>) {}

    fn iso(&self) -> f32 {
        0.5
    }

    fn bounds(&self) -> Option<Bounds> {
        None
    }
}

const PARTICLES: [[f32; 3]; 4] = [[0.1, 0.2, 0.0], [-0.3, 0.1, 0.2], [0.0, -0.4, -0.1], [0.5, 0.5, 0.5]];

/// Runs a field at one point over all particles.
fn value_at<F: Field>(field: &F, at: [f32; 3], columns: &[&[f32]; MAX_COLUMNS]) -> f32 {
    let s = Portable;
    let mut sums = field.zero(s);
    for (particle, p) in PARTICLES.iter().enumerate() {
        let d: [_; 3] = std::array::from_fn(|a| s.splat(at[a] - p[a]));
        let dist_sq = s.add(s.add(s.mul(d[0], d[0]), s.mul(d[1], d[1])), s.mul(d[2], d[2]));
        field.add(s, &mut sums, d, dist_sq, Row { columns, particle });
    }
    field.value(s, sums)[5]
}

#[test]
fn a_weighted_centre_with_its_jacobian_fits_the_interface() {
    let field = Solenthaler { radius: 0.3 };
    let at = [0.05, 0.1, 0.02];
    // The centre and its Jacobian's trace by central differences, in double precision.
    let centre = |x: [f64; 3]| {
        let (mut weight, mut sum) = (0.0, [0.0; 3]);
        for p in PARTICLES {
            let k = (1.0 - (0..3).map(|a| (x[a] - f64::from(p[a])).powi(2)).sum::<f64>()).max(0.0).powi(3);
            weight += k;
            (0..3).for_each(|a| sum[a] += k * f64::from(p[a]));
        }
        sum.map(|v| v / weight)
    };
    let x = at.map(f64::from);
    let length = (0..3).map(|a| (x[a] - centre(x)[a]).powi(2)).sum::<f64>().sqrt();
    let trace: f64 = (0..3)
        .map(|a| {
            let (mut low, mut high) = (x, x);
            low[a] -= 1e-6;
            high[a] += 1e-6;
            (centre(high)[a] - centre(low)[a]) / 2e-6
        })
        .sum();
    // Solenthaler's J = 6/W Σ(1−s²)²(x_j−x̄)(x_j−x)ᵀ, so a third of its trace is 2/W Σ….
    let factor = if trace / 3.0 > 0.4 { 0.5 } else { 1.0 };
    let found = value_at(&field, at, &[&[]; MAX_COLUMNS]);
    assert!((f64::from(found) - (0.3 * factor - length)).abs() < 1e-5, "{found} {length} {trace}");
}

#[test]
fn a_matrix_per_particle_fits_the_interface() {
    let columns: Vec<Vec<f32>> =
        (0..7).map(|c| (0..4).map(|p| 0.7 + 0.1 * (c as f32) - 0.05 * (p as f32)).collect()).collect();
    let slices: [&[f32]; MAX_COLUMNS] = std::array::from_fn(|c| columns.get(c).map_or(&[][..], |v| &v[..]));
    let at = [0.1, 0.0, 0.1];
    let mut want = 0.0f64;
    for (p, particle) in PARTICLES.iter().enumerate() {
        let g = |c: usize| f64::from(columns[c][p]);
        let d: [f64; 3] = std::array::from_fn(|a| f64::from(at[a]) - f64::from(particle[a]));
        let rows = [[g(0), g(1), g(2)], [g(1), g(3), g(4)], [g(2), g(4), g(5)]];
        let q_sq: f64 = rows.iter().map(|r| (0..3).map(|a| r[a] * d[a]).sum::<f64>().powi(2)).sum();
        want += g(6) * (1.0 - q_sq).max(0.0).powi(3);
    }
    let found = f64::from(value_at(&Anisotropic, at, &slices));
    assert!((found - want).abs() < 1e-5, "{found} {want}");
}
