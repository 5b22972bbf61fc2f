//! Particles that keep their distance: a scene under construction.
//!
//! Shapes overlap where a sheet meets the pool or a finger its rim. A particle that comes closer to an earlier one than
//! [`CLEARANCE`] spacings is left out, so what is added first wins, and no scene has two particles at one place.

use crate::Scene;
use crate::arithmetic::{Vec3, add_scaled, cross, normalized, sin_cos_turns};
use crate::random::Random;

/// The least distance between two particles, in spacings.
pub(crate) const CLEARANCE: f64 = 0.7;

/// How far a particle is moved off its place along each axis at most, in spacings.
const JITTER: f64 = 0.09;

/// A scene under construction, with a hashed grid of cells of one clearance to find who is near.
pub(crate) struct Cloud {
    pub random: Random,
    /// Rest spacing: twice the particle radius.
    pub spacing: f64,
    positions: Vec<[f32; 3]>,
    velocities: Vec<[f32; 3]>,
    /// First particle of each bucket, `NONE` if there is none. A power of two of them.
    heads: Vec<u32>,
    /// The next particle in the same bucket.
    next: Vec<u32>,
}

const NONE: u32 = u32::MAX;

impl Cloud {
    /// An empty cloud that will hold about `expected` particles.
    pub fn new(spacing: f64, expected: usize, random: Random) -> Self {
        Self {
            random,
            spacing,
            positions: Vec::with_capacity(expected),
            velocities: Vec::with_capacity(expected),
            heads: vec![NONE; (2 * expected).next_power_of_two()],
            next: Vec::with_capacity(expected),
        }
    }

    pub fn len(&self) -> usize {
        self.positions.len()
    }

    pub fn finish(self) -> Scene {
        Scene { positions: self.positions, velocities: self.velocities, radius: (self.spacing / 2.0) as f32 }
    }

    /// Adds a particle near `place` unless another is too close.
    pub fn add(&mut self, place: Vec3, velocity: Vec3) {
        let jitter = self.random.in_cube(JITTER);
        // Rounded first: the distances promised are those between the numbers handed out.
        let position = add_scaled(place, self.spacing, jitter).map(|x| x as f32);
        if !self.is_free(position.map(f64::from), CLEARANCE * self.spacing) {
            return;
        }
        let bucket = self.bucket(self.cell(position.map(f64::from)));
        self.next.push(self.heads[bucket]);
        self.heads[bucket] = self.positions.len() as u32;
        self.positions.push(position);
        self.velocities.push(velocity.map(|x| x as f32));
    }

    /// Whether no particle is closer to `place` than `distance`.
    pub fn is_free(&self, place: Vec3, distance: f64) -> bool {
        let reach = (distance / (CLEARANCE * self.spacing)).ceil() as i64;
        let [x, y, z] = self.cell(place);
        for k in z - reach..=z + reach {
            for j in y - reach..=y + reach {
                for i in x - reach..=x + reach {
                    let mut at = self.heads[self.bucket([i, j, k])];
                    while at != NONE {
                        let d = add_scaled(place, -1.0, self.positions[at as usize].map(f64::from));
                        if d[0] * d[0] + d[1] * d[1] + d[2] * d[2] < distance * distance {
                            return false;
                        }
                        at = self.next[at as usize];
                    }
                }
            }
        }
        true
    }

    /// A round slice of a column: rings one spacing apart, the outermost half a spacing within `radius`.
    /// `axis` is the slice's unit normal.
    pub fn add_disc(&mut self, centre: Vec3, axis: Vec3, radius: f64, velocity: Vec3) {
        let side = normalized(cross(axis, if axis[0].abs() < 0.7 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] }));
        let other = cross(axis, side);
        let mut ring = radius - self.spacing / 2.0;
        while ring > 0.4 * self.spacing {
            let count = (std::f64::consts::TAU * ring / self.spacing).round().max(2.0);
            let phase = self.random.unit();
            for i in 0..count as u32 {
                let (sin, cos) = sin_cos_turns((f64::from(i) + phase) / count);
                self.add(add_scaled(add_scaled(centre, ring * cos, side), ring * sin, other), velocity);
            }
            ring -= self.spacing;
        }
        if ring > -0.3 * self.spacing {
            self.add(centre, velocity);
        }
    }

    /// A ball: shells one spacing apart, the outermost half a spacing within `radius`. Never empty.
    pub fn add_ball(&mut self, centre: Vec3, radius: f64, velocity: Vec3) {
        let mut shell = radius - self.spacing / 2.0;
        while shell > 0.4 * self.spacing {
            let count =
                (2.0 * std::f64::consts::TAU * (shell / self.spacing) * (shell / self.spacing)).round().max(2.0);
            let phase = self.random.unit();
            for i in 0..count as u32 {
                // The golden ratio spreads points over the sphere (Fibonacci lattice).
                let y = 1.0 - (2.0 * f64::from(i) + 1.0) / count;
                let (sin, cos) = sin_cos_turns(f64::from(i) * 0.618_033_988_749_895 + phase);
                let flat = (1.0 - y * y).sqrt();
                self.add(add_scaled(centre, shell, [flat * cos, y, flat * sin]), velocity);
            }
            shell -= self.spacing;
        }
        self.add(centre, velocity);
    }

    fn cell(&self, place: Vec3) -> [i64; 3] {
        place.map(|x| (x / (CLEARANCE * self.spacing)).floor() as i64)
    }

    fn bucket(&self, cell: [i64; 3]) -> usize {
        let mixed =
            cell.iter().fold(0u64, |hash, &c| (hash ^ c as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29));
        mixed as usize & (self.heads.len() - 1)
    }
}
