//! What a volume is worth between its samples: the trilinear interpolant, and its gradient.
//!
//! Gradients go to the world by the inverse of the direction vectors, so that those of oblique volumes are right.
//!
//! Source: this project.

use super::{Volume, determinant};
use crate::math::vector::{cross, subtract};

/// The trilinear interpolant of a volume.
///
/// ```
/// use pellicle::{Interpolant, Volume};
/// let samples = [0.0f32, 1.0, 0.0, 1.0, 2.0, 3.0, 2.0, 3.0];
/// let interpolant = Interpolant::of(&Volume::new(&samples, [2, 2, 2])?);
/// assert_eq!(interpolant.at([0.5, 0.25, 0.5]), Some((1.5, [1.0, 0.0, 2.0])));
/// assert_eq!(interpolant.at([0.5, 0.25, 1.5]), None);
/// # Ok::<(), pellicle::Error>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Interpolant<'a> {
    volume: Volume<'a>,
    /// Rows of the inverse of the directions: the gradient of each node coordinate.
    inverse: [[f64; 3]; 3],
}

impl<'a> Interpolant<'a> {
    /// That of a volume.
    pub fn of(volume: &Volume<'a>) -> Self {
        let [a, b, c] = volume.directions();
        let by = 1.0 / determinant([a, b, c]);
        Self { volume: *volume, inverse: [cross(b, c), cross(c, a), cross(a, b)].map(|row| row.map(|v| v * by)) }
    }

    /// A place in the world in node coordinates.
    pub fn node(&self, at: [f64; 3]) -> [f64; 3] {
        let from = subtract(at, self.volume.origin());
        self.inverse.map(|row| row[0] * from[0] + row[1] * from[1] + row[2] * from[2])
    }

    /// Value and gradient, per unit of length, at a place in the world. `None` beyond the volume, and in cells with an absent
    /// corner.
    pub fn at(&self, at: [f64; 3]) -> Option<(f64, [f64; 3])> {
        let (node, dims) = (self.node(at), self.volume.dims());
        if !(0..3).all(|a| node[a] >= 0.0 && node[a] <= (dims[a] - 1) as f64) {
            return None;
        }
        let low: [usize; 3] = std::array::from_fn(|a| (node[a] as usize).min(dims[a] - 2));
        let part: [f64; 3] = std::array::from_fn(|a| node[a] - low[a] as f64);
        let (mut value, mut slope) = (0.0, [0.0; 3]);
        for corner in 0..8usize {
            let is_high: [bool; 3] = std::array::from_fn(|a| corner >> a & 1 == 1);
            let sample = self.volume.value(std::array::from_fn(|a| low[a] + usize::from(is_high[a])))?;
            let weight: [f64; 3] = std::array::from_fn(|a| if is_high[a] { part[a] } else { 1.0 - part[a] });
            value += sample * (weight[0] * weight[1] * weight[2]);
            for a in 0..3 {
                let sign = if is_high[a] { 1.0 } else { -1.0 };
                slope[a] += sign * sample * (weight[(a + 1) % 3] * weight[(a + 2) % 3]);
            }
        }
        let mut gradient = [0.0; 3];
        for (slope, row) in slope.iter().zip(&self.inverse) {
            (0..3).for_each(|a| gradient[a] += slope * row[a]);
        }
        Some((value, gradient))
    }
}
