//! Every field against its textbook form in double precision: values, and gradients by central differences.

use super::{
    anisotropic::{Anisotropic, RECORD, Shapes},
    onderik::Onderik,
    solenthaler::Solenthaler,
    sph::SphOfRadii,
    zhu_bridson::ZhuBridson,
    *,
};
use crate::math::simd::{LANES, Portable};

/// Particles in support units: two groups, so that centres move fast between them.
pub(super) fn particles() -> Vec<[f64; 3]> {
    let mut state = 3u64;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f64 / f64::from(1 << 24)
    };
    (0..60)
        .map(|i| {
            let group = if i % 2 == 0 { 0.0 } else { 1.1 };
            [group + 0.6 * next(), 0.7 * next(), 0.5 * next()]
        })
        .map(|p| p.map(|v| f64::from(v as f32)))
        .collect()
}

/// Runs a field at one point over all particles.
fn run<F: Field>(field: &F, at: [f64; 3], particles: &[[f64; 3]], columns: &[&[f32]]) -> (f64, [f64; 3]) {
    let s = Portable;
    let columns: [&[f32]; MAX_COLUMNS] = std::array::from_fn(|c| columns.get(c).copied().unwrap_or(&[]));
    let term = |p: &[f64; 3]| {
        let d: [_; 3] = std::array::from_fn(|a| s.splat((at[a] - p[a]) as f32));
        (d, s.add(s.add(s.mul(d[0], d[0]), s.mul(d[1], d[1])), s.mul(d[2], d[2])))
    };
    let (mut sums, mut slope) = (field.zero(s), field.flat(s));
    for (particle, p) in particles.iter().enumerate() {
        let ((d, dist_sq), row) = (term(p), Row { columns: &columns, particle });
        field.add(s, &mut sums, d, dist_sq, row);
        field.add_slope(s, &mut slope, d, dist_sq, row);
    }
    let mut bend = field.bend(s, &slope);
    for (particle, p) in particles.iter().enumerate() {
        let ((d, dist_sq), row) = (term(p), Row { columns: &columns, particle });
        field.add_bend(s, &mut bend, d, dist_sq, row);
    }
    let lane: [f32; LANES] = field.value(s, sums);
    (f64::from(lane[5]), field.gradient(s, slope, bend).map(|g| f64::from(g[9])))
}

/// Compares a field with its textbook form at many points: values within `tolerance`, gradients in direction where they are not
/// small, which a positive factor leaves alone.
#[track_caller]
pub(super) fn agree<F: Field>(
    field: &F,
    particles: &[[f64; 3]],
    columns: &[&[f32]],
    tolerance: f64,
    textbook: impl Fn([f64; 3]) -> f64,
) {
    let mut steep = 0;
    for i in 0..600 {
        let at = [i % 17, i * 7 % 13, i * 5 % 11].map(f64::from);
        let at = [at[0] * 0.12 - 0.2, at[1] * 0.09 - 0.2, at[2] * 0.09 - 0.2];
        let (value, gradient) = run(field, at, particles, columns);
        let want = textbook(at);
        assert!((value - want).abs() < tolerance, "at {at:?}: {value}, {want}");
        let slopes = |e: f64| -> [f64; 3] {
            std::array::from_fn(|a| {
                let moved = |by: f64| std::array::from_fn(|b| at[b] + if a == b { by } else { 0.0 });
                (textbook(moved(e)) - textbook(moved(-e))) / (2.0 * e)
            })
        };
        let (fine, coarse) = (slopes(1e-5), slopes(4e-5));
        let length = |v: [f64; 3]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
        // Where differences do not settle, the field has a kink or a jump.
        let settles = length(std::array::from_fn(|a| fine[a] - coarse[a])) < 1e-3 * length(fine);
        if settles && length(fine) > 0.05 {
            let cosine = (0..3).map(|a| fine[a] * gradient[a]).sum::<f64>() / (length(fine) * length(gradient));
            assert!(cosine > 0.9999, "at {at:?}: cosine {cosine}, {gradient:?}, {fine:?}");
            steep += 1;
        }
    }
    assert!(steep > 150, "{steep} points with a gradient");
}

fn distance_sq(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum()
}

/// Weighted centre, mean radius and total weight, from their definition.
fn centre(
    at: [f64; 3],
    particles: &[[f64; 3]],
    mass: &dyn Fn(usize) -> f64,
    radius: &dyn Fn(usize) -> f64,
) -> ([f64; 3], f64, f64) {
    let (mut weight, mut sum, mut radii) = (0.0, [0.0; 3], 0.0);
    for (j, &p) in particles.iter().enumerate() {
        let k = mass(j) * (1.0 - distance_sq(at, p)).max(0.0).powi(3);
        weight += k;
        radii += k * radius(j);
        (0..3).for_each(|a| sum[a] += k * p[a]);
    }
    (sum.map(|v| v / weight), radii / weight, weight)
}

fn radii(count: usize) -> Vec<f32> {
    (0..count).map(|j| 0.15 + 0.02 * (j % 7) as f32).collect()
}

fn zhu_bridson(at: [f64; 3], particles: &[[f64; 3]], radius: &dyn Fn(usize) -> f64) -> f64 {
    let (middle, radius, weight) = centre(at, particles, &|_| 1.0, radius);
    if weight > 0.0 { 4.0 * (radius - distance_sq(at, middle).sqrt()) } else { -4.0 }
}

#[test]
fn zhu_bridson_is_the_distance_to_the_weighted_centre() {
    let particles = particles();
    let own = radii(particles.len());
    let field = ZhuBridson::<false> { iso: 0.0, radius: 0.25, particles_per_support: 4.0 };
    agree(&field, &particles, &[], 1e-4, |at| zhu_bridson(at, &particles, &|_| 0.25));
    let field = ZhuBridson::<true> { iso: 0.0, radius: 0.25, particles_per_support: 4.0 };
    agree(&field, &particles, &[&own], 1e-4, |at| zhu_bridson(at, &particles, &|j| f64::from(own[j])));
}

/// The largest real part of a matrix's eigenvalues, by bisection for a real one.
fn largest_real_part(j: [[f64; 3]; 3]) -> f64 {
    let trace = j[0][0] + j[1][1] + j[2][2];
    let minor = |a: usize, b: usize| j[a][a] * j[b][b] - j[a][b] * j[b][a];
    let second = minor(0, 1) + minor(0, 2) + minor(1, 2);
    let minors = |c: usize| j[1][(c + 1) % 3] * j[2][(c + 2) % 3] - j[1][(c + 2) % 3] * j[2][(c + 1) % 3];
    let det = (0..3).map(|c| j[0][c] * minors(c)).sum::<f64>();
    let bound = 1.0 + trace.abs().max(second.abs()).max(det.abs());
    let (mut low, mut high) = (-bound, bound);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        *(if ((middle - trace) * middle + second) * middle < det { &mut low } else { &mut high }) = middle;
    }
    let (sum, product) = (trace - low, second - low * (trace - low));
    low.max(0.5 * sum + (0.25 * sum * sum - product).max(0.0).sqrt())
}

fn solenthaler(at: [f64; 3], particles: &[[f64; 3]], radius: &dyn Fn(usize) -> f64, t_high: f64) -> f64 {
    let (middle, radius, weight) = centre(at, particles, &|_| 1.0, radius);
    if weight == 0.0 {
        return -4.0;
    }
    // J as METHODS has it: 6/W Σ (1−s²)² (x_j − x̄)(x_j − x)ᵀ.
    let mut jacobian = [[0.0; 3]; 3];
    for p in particles {
        let slope = 6.0 / weight * (1.0 - distance_sq(at, *p)).max(0.0).powi(2);
        for a in 0..3 {
            for b in 0..3 {
                jacobian[a][b] += slope * (p[a] - middle[a]) * (p[b] - at[b]);
            }
        }
    }
    let gamma = ((t_high - largest_real_part(jacobian)) / (t_high - 0.4)).clamp(0.0, 1.0);
    4.0 * (radius * (gamma.powi(3) - 3.0 * gamma * gamma + 3.0 * gamma) - distance_sq(at, middle).sqrt())
}

#[test]
fn solenthaler_shrinks_the_radius_where_the_centre_moves_fast() {
    let particles = particles();
    let own = radii(particles.len());
    for t_high in [2.0, 3.5] {
        let high = t_high as f32;
        let field =
            Solenthaler::<false> { iso: 0.0, radius: 0.25, t_low: 0.4, t_high: high, particles_per_support: 4.0 };
        agree(&field, &particles, &[], 2e-3, |at| solenthaler(at, &particles, &|_| 0.25, t_high));
        let field =
            Solenthaler::<true> { iso: 0.0, radius: 0.25, t_low: 0.4, t_high: high, particles_per_support: 4.0 };
        let radius = |j: usize| f64::from(own[j]);
        agree(&field, &particles, &[&own], 2e-3, |at| solenthaler(at, &particles, &radius, t_high));
    }
}

#[test]
fn the_jacobian_is_that_of_the_centre() {
    let particles = particles();
    let (at, e) = ([0.7, 0.4, 0.3], 1e-6);
    let middle = |at| centre(at, &particles, &|_| 1.0, &|_| 0.0).0;
    let mut spread = super::centre::Spread::zero(Portable);
    for p in &particles {
        let d: [[f32; LANES]; 3] = std::array::from_fn(|a| [(at[a] - p[a]) as f32; LANES]);
        let (brings, dist_sq) = (super::centre::Brings::default(), [distance_sq(at, *p) as f32; LANES]);
        spread.add(Portable, d, super::centre::kernels(Portable, dist_sq, brings), brings);
    }
    let inverse = spread.centre.inverse_weight(Portable);
    let (off, _) = spread.centre.offset(Portable, inverse);
    let found = spread.jacobian(Portable, off, inverse);
    for b in 0..3 {
        let moved = |by: f64| middle(std::array::from_fn(|a| at[a] + if a == b { by } else { 0.0 }));
        for a in 0..3 {
            let want = (moved(e)[a] - moved(-e)[a]) / (2.0 * e);
            assert!((f64::from(found[a][b][0]) - want).abs() < 2e-5, "{a} {b}: {} {want}", found[a][b][0]);
        }
    }
}

#[test]
fn onderik_shrinks_the_radius_where_the_fluid_is_thin() {
    let particles = particles();
    let own = radii(particles.len());
    let volume = |j: usize| {
        let sum: f64 = particles.iter().map(|&p| (1.0 - distance_sq(particles[j], p)).max(0.0).powi(3)).sum();
        1.0 / sum
    };
    let volumes: Vec<f32> = (0..particles.len()).map(|j| volume(j) as f32).collect();
    let textbook = |at: [f64; 3], radius: &dyn Fn(usize) -> f64| {
        let (middle, radius, w) = centre(at, &particles, &|j| f64::from(volumes[j]), radius);
        let u = ((1.05 - w) / 1.05).clamp(0.0, 1.0);
        if w > 0.0 { 4.0 * (radius * (1.0 - u * u).powi(2) - distance_sq(at, middle).sqrt()) } else { -4.0 }
    };
    let (w_min, w_max) = (0.0, 1.05);
    let field = Onderik::<false> { iso: 0.0, radius: 0.25, w_min, w_max, particles_per_support: 4.0 };
    agree(&field, &particles, &[&volumes], 1e-4, |at| textbook(at, &|_| 0.25));
    let field = Onderik::<true> { iso: 0.0, radius: 0.25, w_min, w_max, particles_per_support: 4.0 };
    agree(&field, &particles, &[&volumes, &own], 1e-4, |at| textbook(at, &|j| f64::from(own[j])));
}

#[test]
fn particles_with_supports_of_their_own_make_an_sph_field() {
    let particles = particles();
    let supports: Vec<f32> = (0..particles.len()).map(|j| 0.5 + 0.1 * (j % 6) as f32).collect();
    let weights: Vec<f32> = (0..particles.len()).map(|j| 0.2 + 0.05 * (j % 5) as f32).collect();
    let per_support_sq: Vec<f32> = supports.iter().map(|h| h.powi(-2)).collect();
    let textbook = |at: [f64; 3]| -> f64 {
        let spline = |s: f64| if s < 0.5 { 0.5 - 3.0 * s * s + 3.0 * s * s * s } else { (1.0 - s).max(0.0).powi(3) };
        let term = |j: usize| {
            let s = distance_sq(at, particles[j]).sqrt() * f64::from(per_support_sq[j]).sqrt();
            f64::from(weights[j]) * spline(s)
        };
        (0..particles.len()).map(term).sum()
    };
    let field = SphOfRadii { iso: 0.6, particles_per_support: 2.0, smallest: 0.5 };
    agree(&field, &particles, &[&weights, &per_support_sq], 1e-5, textbook);
}

#[test]
fn ellipsoids_make_an_anisotropic_field() {
    let particles = particles();
    let (low, k_n) = (4.0, 0.5);
    let shapes = Shapes { smoothing: 0.9, max_stretch: low, isolated_scale: k_n, min_neighbors: 5.0 };
    // Second moments of a cloud along a direction of each particle's own.
    let direction = |j: usize| [1.0, 0.3 * (j % 5) as f64, 0.2 * (j % 7) as f64 - 0.5];
    let covariance = |j: usize, a: usize, b: usize| {
        let u = direction(j);
        u[a] * u[b] + if a == b { 0.05 } else { 0.0 }
    };
    let columns: Vec<[f32; 8]> = (0..particles.len())
        .map(|j| {
            let mut record = [0.0f32; RECORD];
            (record[0], record[1], record[11]) = (0.5, 1.0, 50.0);
            for (i, (a, b)) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].into_iter().enumerate() {
                record[5 + i] = covariance(j, a, b) as f32;
            }
            shapes.columns(&record, 0.4)
        })
        .collect();
    let slices: Vec<Vec<f32>> = (0..8).map(|c| columns.iter().map(|row| row[c]).collect()).collect();
    let slices: Vec<&[f32]> = slices.iter().map(Vec::as_slice).collect();
    // The covariance is u uᵀ + 0.05: one long axis along u, the others clamped, sizes such that the volume is a ball's.
    let textbook = |at: [f64; 3]| -> f64 {
        let term = |j: usize| {
            let u = direction(j);
            let long = u.iter().map(|v| v * v).sum::<f64>();
            let short = (0.05f64).max((long + 0.05) / low) / (long + 0.05);
            let size = (short * short).cbrt();
            let d: [f64; 3] = std::array::from_fn(|a| at[a] - particles[j][a]);
            let along = (0..3).map(|a| d[a] * u[a]).sum::<f64>() / long.sqrt();
            let across_sq = distance_sq(at, particles[j]) - along * along;
            let q_sq = (along * size).powi(2) + across_sq * (size / short).powi(2);
            // Σ V σ det G P with V = 16/π… see the columns: 0.5 · 315/1024, det G h³ = 1.
            0.5 * 315.0 / 1024.0 * (1.0 - q_sq / 0.16).max(0.0).powi(3)
        };
        (0..particles.len()).map(term).sum()
    };
    let field = Anisotropic { iso: 0.5, particles_per_support: 5.0, smallest: 1.0 };
    agree(&field, &particles, &slices, 1e-5, textbook);
}

#[test]
fn a_lone_particle_stays_and_a_crowd_moves_it() {
    let shapes = Shapes { smoothing: 0.9, max_stretch: 4.0, isolated_scale: 0.5, min_neighbors: 25.0 };
    let mut record = [0.0f32; RECORD];
    (record[0], record[1], record[11]) = (2.0, 1.0, 1.0);
    assert_eq!(shapes.shift(&record), [0.0; 3]);
    let alone = shapes.columns(&record, 0.4);
    // A ball of half the support, of weight 2 · 315/1024 · 8.
    assert_eq!(alone[..6], [5.0, 0.0, 0.0, 5.0, 0.0, 5.0]);
    assert!((alone[6] - 2.0 * 315.0 / 128.0).abs() < 1e-6 && (alone[7] - 0.04).abs() < 1e-5);
    (record[1], record[2]) = (11.0, 2.2);
    let shift = shapes.shift(&record);
    assert!((shift[0] + 0.18).abs() < 1e-6 && shift[1] == 0.0, "{shift:?}");
}
