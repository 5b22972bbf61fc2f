//! Gradient noise, and a function with noise added: turbulent fields.
//!
//! At every point of an integer lattice a direction is drawn by hashing its coordinates; between, the linear functions of
//! the eight corners are blended by a quintic. Octaves are summed, each of twice the frequency and half the height. Only
//! sums, products and rounding: the same values on every platform.
//!
//! Source: Perlin, Improving noise, 2002 (twelve directions, the quintic); hashing by a mix of the coordinates' bits in
//! place of his table is this project's.

use crate::Function;

/// Smooth noise with mean 0, mostly between −1 and 1. Repeats itself after 2³² lattice points along an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Lattice points in a unit of length of the first octave.
    pub frequency: f64,
    /// Octaves, at least 1.
    pub octaves: u32,
    /// Any; another gives another noise.
    pub seed: u64,
}

/// The twelve middles of a cube's edges, four of them twice.
const DIRECTIONS: [[f64; 3]; 16] = {
    let mut all = [[0.0; 3]; 16];
    let mut i = 0;
    while i < 16 {
        // The last four are the first of the others again.
        let n = if i < 12 { i } else { (i - 12) * 3 };
        let axis = n / 4;
        all[i][(axis + 1) % 3] = if n & 1 == 0 { 1.0 } else { -1.0 };
        all[i][(axis + 2) % 3] = if n & 2 == 0 { 1.0 } else { -1.0 };
        i += 1;
    }
    all
};

impl Noise {
    /// Direction at a lattice point.
    fn direction(&self, at: [i64; 3], octave: u32) -> [f64; 3] {
        let [x, y, z] = at.map(|v| v as u64 & 0xffff_ffff);
        let mut h = self.seed ^ u64::from(octave).wrapping_mul(0xd6e8_feb8_6659_fd93);
        for v in [x, y, z] {
            h = (h ^ v).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            h ^= h >> 32;
        }
        DIRECTIONS[(h >> 17 & 15) as usize]
    }

    /// Value and gradient of one octave at a point in lattice units.
    fn octave(&self, at: [f64; 3], octave: u32) -> (f64, [f64; 3]) {
        let low = at.map(f64::floor);
        let rest: [f64; 3] = std::array::from_fn(|a| at[a] - low[a]);
        let fade = rest.map(|t| t * t * t * (t * (t * 6.0 - 15.0) + 10.0));
        let slope = rest.map(|t| 30.0 * t * t * (t - 1.0) * (t - 1.0));
        let (mut value, mut gradient) = (0.0, [0.0; 3]);
        for c in 0..8usize {
            let bit = |a: usize| (c >> a & 1) as f64;
            let direction = self.direction(std::array::from_fn(|a| low[a] as i64 + (c >> a & 1) as i64), octave);
            let linear: f64 = (0..3).map(|a| direction[a] * (rest[a] - bit(a))).sum();
            let weight = |a: usize| if bit(a) == 1.0 { fade[a] } else { 1.0 - fade[a] };
            let (x, y, z) = (weight(0), weight(1), weight(2));
            value += x * y * z * linear;
            for a in 0..3 {
                let others = [y * z, x * z, x * y][a];
                let sign = 2.0 * bit(a) - 1.0;
                gradient[a] += x * y * z * direction[a] + sign * slope[a] * others * linear;
            }
        }
        (value, gradient)
    }

    /// Value and gradient at a point.
    fn both(&self, at: [f64; 3]) -> (f64, [f64; 3]) {
        let (mut value, mut gradient) = (0.0, [0.0; 3]);
        let (mut frequency, mut height) = (self.frequency, 1.0);
        for octave in 0..self.octaves {
            let (v, g) = self.octave(at.map(|x| x * frequency), octave);
            value += height * v;
            (0..3).for_each(|a| gradient[a] += height * frequency * g[a]);
            frequency *= 2.0;
            height *= 0.5;
        }
        (value, gradient)
    }
}

impl Function for Noise {
    fn value(&self, at: [f64; 3]) -> f64 {
        self.both(at).0
    }

    fn gradient(&self, at: [f64; 3], _: f64) -> [f64; 3] {
        self.both(at).1
    }
}

/// A function with noise added.
#[derive(Clone, Copy)]
pub struct Turbulent<'a> {
    /// The function.
    pub function: &'a dyn Function,
    /// The noise.
    pub noise: Noise,
    /// What the noise is multiplied by.
    pub amplitude: f64,
}

impl Function for Turbulent<'_> {
    fn value(&self, at: [f64; 3]) -> f64 {
        self.function.value(at) + self.amplitude * self.noise.value(at)
    }

    fn values(&self, at: &[[f64; 3]], to: &mut [f64]) {
        self.function.values(at, to);
        at.iter().zip(to).for_each(|(&p, to)| *to += self.amplitude * self.noise.value(p));
    }

    fn gradient(&self, at: [f64; 3], step: f64) -> [f64; 3] {
        let (a, b) = (self.function.gradient(at, step), self.noise.gradient(at, step));
        std::array::from_fn(|i| a[i] + self.amplitude * b[i])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOISE: Noise = Noise { frequency: 1.7, octaves: 3, seed: 7 };

    #[test]
    fn noise_is_zero_mean_bounded_and_not_constant() {
        let values: Vec<f64> = (0..4000).map(|i| NOISE.value([0.37, 0.53, 0.91].map(|k| k * f64::from(i)))).collect();
        let mean = values.iter().sum::<f64>() / 4000.0;
        let spread = (values.iter().map(|v| v * v).sum::<f64>() / 4000.0).sqrt();
        assert!(mean.abs() < 0.03 && (0.15..0.6).contains(&spread), "{mean} {spread}");
        assert!(values.iter().all(|v| v.abs() < 2.0));
        assert_ne!(NOISE.value([0.3; 3]), Noise { seed: 8, ..NOISE }.value([0.3; 3]));
    }

    #[test]
    fn the_gradient_is_that_of_differences_across_lattice_planes_too() {
        let field = Turbulent { function: &|p: [f64; 3]| p[0] * p[1], noise: NOISE, amplitude: 0.5 };
        let plain = |p: [f64; 3]| field.value(p);
        for i in 0..60 {
            let p = [0.1, -0.23, 0.31].map(|k| k * f64::from(i));
            let (exact, found) = (field.gradient(p, 1e-5), plain.gradient(p, 1e-5));
            for a in 0..3 {
                assert!((exact[a] - found[a]).abs() < 1e-5, "{p:?}: {exact:?} {found:?}");
            }
        }
    }
}
