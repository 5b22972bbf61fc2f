//! Sums of squared distances to planes and lines, as a polynomial: xᵀAx + 2 bᵀx + c.
//!
//! Source: Garland & Heckbert 1997, section 4; Liu et al. 2025 for lines.

use crate::math::vector::{cross, dot, length};

/// A weighted sum of squared distances, and the sum of the weights.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Quadric {
    /// xx, yy, zz, xy, xz, yz.
    a: [f64; 6],
    b: [f64; 3],
    c: f64,
    weight: f64,
}

impl Quadric {
    /// `weight` times the squared distance to the plane through `p` with the unit normal `n`.
    pub(super) fn plane(p: [f64; 3], n: [f64; 3], weight: f64) -> Self {
        let d = -dot(n, p);
        let [x, y, z] = n;
        Self {
            a: [x * x, y * y, z * z, x * y, x * z, y * z].map(|v| weight * v),
            b: n.map(|v| weight * d * v),
            c: weight * d * d,
            weight,
        }
    }

    /// `weight` times the squared distance to the line through `p` along the unit vector `n`. Its weight does not count.
    pub(super) fn line(p: [f64; 3], n: [f64; 3], weight: f64) -> Self {
        let plane = Self::plane(p, n, weight);
        let [a, b, c, rest @ ..] = plane.a;
        Self {
            a: [weight - a, weight - b, weight - c, -rest[0], -rest[1], -rest[2]],
            b: [0, 1, 2].map(|i| -weight * p[i] - plane.b[i]),
            c: weight * dot(p, p) - plane.c,
            weight: 0.0,
        }
    }

    pub(super) fn add(&mut self, other: &Self) {
        for (a, o) in self.a.iter_mut().zip(other.a) {
            *a += o;
        }
        for (b, o) in self.b.iter_mut().zip(other.b) {
            *b += o;
        }
        self.c += other.c;
        self.weight += other.weight;
    }

    /// The sum at `x`; rounding may make it negative, then it is 0.
    pub(super) fn at(&self, x: [f64; 3]) -> f64 {
        let [xx, yy, zz, xy, xz, yz] = self.a;
        let ax = [dot([xx, xy, xz], x), dot([xy, yy, yz], x), dot([xz, yz, zz], x)];
        (dot(ax, x) + 2.0 * dot(self.b, x) + self.c).max(0.0)
    }

    /// Root of the weighted mean of the squares, of a sum.
    pub(super) fn error(&self, sum: f64) -> f64 {
        if self.weight > 0.0 { (sum / self.weight).sqrt() } else { 0.0 }
    }

    /// Where the sum is least, unless that is ill determined.
    pub(super) fn lowest(&self) -> Option<[f64; 3]> {
        let [xx, yy, zz, xy, xz, yz] = self.a;
        let rows = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
        let minors = [cross(rows[1], rows[2]), cross(rows[2], rows[0]), cross(rows[0], rows[1])];
        let determinant = dot(rows[0], minors[0]);
        let scale = xx + yy + zz;
        if determinant <= 1e-10 * scale * scale * scale {
            return None;
        }
        Some([0, 1, 2].map(|i| -(0..3).map(|j| minors[j][i] * self.b[j]).sum::<f64>() / determinant))
    }
}

/// The unit vector along `v`, and its length; 0 for none.
pub(super) fn unit(v: [f64; 3]) -> ([f64; 3], f64) {
    let length = length(v);
    if length > 0.0 { (v.map(|x| x / length), length) } else { ([0.0; 3], 0.0) }
}
