//! The specification of every field: the value of one node in plain arithmetic, one particle after the other. What runs in
//! lanes must equal it bit for bit.
//!
//! Source: this project; each field names its own.

use super::{kernel::half_spline_scalar, onderik::Onderik, solenthaler::Solenthaler, zhu_bridson::ZhuBridson};

/// One particle as a node sees it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Term {
    /// Node minus particle, in support units.
    pub(crate) d: [f32; 3],
    pub(crate) dist_sq: f32,
    pub(crate) particle: usize,
}

/// Σ V g.
pub(crate) fn sph(terms: &[Term], weights: &[f32]) -> f32 {
    terms.iter().fold(0.0, |sum, t| sum + weights[t.particle] * half_spline_scalar(t.dist_sq))
}

/// Σ V g of the particles' own supports.
pub(crate) fn sph_of_radii(terms: &[Term], weights: &[f32], per_support_sq: &[f32]) -> f32 {
    let term = |t: &Term| weights[t.particle] * half_spline_scalar(t.dist_sq * per_support_sq[t.particle]);
    terms.iter().fold(0.0, |sum, t| sum + term(t))
}

/// Σ w P(‖G d‖).
pub(crate) fn anisotropic(terms: &[Term], columns: &[Vec<f32>]) -> f32 {
    terms.iter().fold(0.0, |sum, Term { d, particle, .. }| {
        let g = |c: usize| columns[c][*particle];
        let row = |i: usize, j: usize, k: usize| g(i) * d[0] + g(j) * d[1] + g(k) * d[2];
        let q = [row(0, 1, 2), row(1, 3, 4), row(2, 4, 5)];
        let t = (1.0 - (q[0] * q[0] + q[1] * q[1] + q[2] * q[2])).max(0.0);
        sum + g(6) * (t * t * t)
    })
}

/// Σ of Triquet's function.
pub(crate) fn metaball(terms: &[Term]) -> f32 {
    let rest = |t: &Term| (1.0 - t.dist_sq).max(0.0);
    terms.iter().fold(0.0, |sum, t| sum + rest(t) * rest(t) * 0.25)
}

/// Sums of a weighted centre.
struct Centre {
    weight: f32,
    moment: [f32; 3],
    radius: f32,
    first: [f32; 3],
    second: [[f32; 3]; 3],
}

fn centre(terms: &[Term], mass: Option<&[f32]>, radii: Option<&[f32]>) -> Centre {
    let mut c = Centre { weight: 0.0, moment: [0.0; 3], radius: 0.0, first: [0.0; 3], second: [[0.0; 3]; 3] };
    for Term { d, dist_sq, particle } in terms {
        let t = (1.0 - dist_sq).max(0.0);
        let slope = mass.map_or(t * t, |mass| t * t * mass[*particle]);
        let k = slope * t;
        c.weight += k;
        for a in 0..3 {
            c.moment[a] += k * d[a];
            c.first[a] += slope * d[a];
            for b in a..3 {
                c.second[a][b] += slope * d[a] * d[b];
                c.second[b][a] = c.second[a][b];
            }
        }
        if let Some(radii) = radii {
            c.radius += k * radii[*particle];
        }
    }
    c
}

impl Centre {
    fn inverse(&self) -> f32 {
        1.0 / self.weight.max(1e-30)
    }

    fn offset(&self) -> ([f32; 3], f32) {
        let off = self.moment.map(|m| m * self.inverse());
        (off, (off[0] * off[0] + off[1] * off[1] + off[2] * off[2]).sqrt())
    }

    fn mean_radius(&self, radii: Option<&[f32]>, radius: f32) -> f32 {
        if radii.is_some() { self.radius * self.inverse() } else { radius }
    }
}

pub(crate) fn zhu_bridson<const RADII: bool>(field: &ZhuBridson<RADII>, terms: &[Term], radii: Option<&[f32]>) -> f32 {
    let c = centre(terms, None, radii);
    let depth = c.mean_radius(radii, field.radius) - c.offset().1;
    let per_support = field.particles_per_support;
    if c.weight > 0.0 { per_support * depth } else { -per_support }
}

pub(crate) fn onderik<const RADII: bool>(
    field: &Onderik<RADII>,
    terms: &[Term],
    volumes: &[f32],
    radii: Option<&[f32]>,
) -> f32 {
    let c = centre(terms, Some(volumes), radii);
    let lack = (field.w_max - c.weight) * (1.0 / (field.w_max - field.w_min));
    let u = lack.clamp(0.0, 1.0);
    let factor = (1.0 - u * u) * (1.0 - u * u);
    let depth = c.mean_radius(radii, field.radius) * factor - c.offset().1;
    let per_support = field.particles_per_support;
    if c.weight > 0.0 { per_support * depth } else { -per_support }
}

pub(crate) fn solenthaler<const RADII: bool>(field: &Solenthaler<RADII>, terms: &[Term], radii: Option<&[f32]>) -> f32 {
    let c = centre(terms, None, radii);
    let (off, length) = c.offset();
    let scale = 6.0 * c.inverse();
    let jacobian = std::array::from_fn(|a| std::array::from_fn(|b| scale * (c.second[a][b] - off[a] * c.first[b])));
    let excess = (largest_real_part(jacobian) - field.t_low) * (1.0 / (field.t_high - field.t_low));
    let rest = excess.clamp(0.0, 1.0);
    let factor = 1.0 - rest * rest * rest;
    let per_support = field.particles_per_support;
    if c.weight > 0.0 { per_support * (c.mean_radius(radii, field.radius) * factor - length) } else { -per_support }
}

/// As in [`crate::math::eigen`].
fn largest_real_part(mut d: [[f32; 3]; 3]) -> f32 {
    let third = (1.0 / 3.0) * (d[0][0] + d[1][1] + d[2][2]);
    (0..3).for_each(|a| d[a][a] -= third);
    let squares = d[0][0] * d[0][0] + d[1][1] * d[1][1] + d[2][2] * d[2][2];
    let pairs = d[0][1] * d[1][0] + d[0][2] * d[2][0] + d[1][2] * d[2][1];
    let p = 0.0 - (0.5 * squares + pairs);
    let determinant = d[0][0] * (d[1][1] * d[2][2] - d[1][2] * d[2][1])
        + d[0][1] * (d[1][2] * d[2][0] - d[1][0] * d[2][2])
        + d[0][2] * (d[1][0] * d[2][1] - d[1][1] * d[2][0]);
    let size = determinant.abs();
    let quarter = size.max(1e-30).sqrt().sqrt();
    let sixteenth = quarter.sqrt().sqrt();
    let mut t = (0.0 - p).max(0.0).sqrt() + 1.16 * (quarter * sixteenth * sixteenth.sqrt().sqrt());
    for _ in 0..6 {
        t = (2.0 * (t * t) * t + size) / (3.0 * (t * t) + p).max(1e-30);
    }
    let single = if determinant < 0.0 { 0.0 - t } else { t };
    let under = 0.0 - p - 0.75 * (single * single);
    let pair = -0.5 * single + under.max(0.0).sqrt();
    third + if pair > single { pair } else { single }
}
