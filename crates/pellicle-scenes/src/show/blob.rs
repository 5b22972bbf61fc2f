//! 100 particles that hang together without a shape: lobes stretch out, part, and run into each other again.
//!
//! Source: this project. Particles push each other away when nearer than [`REST`], and each is drawn to one of a few points
//! that wander about.

use crate::arithmetic::{Vec3, add_scaled, dot, sin_cos_turns};
use crate::random::Random;

const PARTICLES: usize = 100;
/// Points that draw particles.
const LURES: usize = 5;
/// Distance below which two particles push.
const REST: f64 = 2.4;
/// Seconds of a frame.
const TIME: f64 = 1.0 / 60.0;

#[derive(Debug, Clone)]
pub(super) struct Blob {
    places: Vec<Vec3>,
    velocities: Vec<Vec3>,
    /// Of each lure and axis: turns a second, and the phase in turns.
    tunes: [[[f64; 2]; 3]; LURES],
    seconds: f64,
}

impl Blob {
    pub fn new(seed: u64) -> Self {
        let mut random = Random::new(seed);
        let places = (0..PARTICLES).map(|_| random.in_ball(6.0)).collect();
        let mut tune = || [random.between(0.08, 0.25), random.unit()];
        let tunes = std::array::from_fn(|_| std::array::from_fn(|_| tune()));
        let mut blob = Self { places, velocities: vec![[0.0; 3]; PARTICLES], tunes, seconds: 0.0 };
        for _ in 0..200 {
            blob.step();
        }
        blob
    }

    pub fn places(&self) -> &[Vec3] {
        &self.places
    }

    pub fn step(&mut self) {
        self.seconds += TIME;
        let lures = self.lures();
        let mut forces: Vec<Vec3> = (0..PARTICLES)
            .map(|i| {
                let to = add_scaled(lures[i % LURES], -1.0, self.places[i]);
                // A pull that does not grow without limit with the distance.
                let pull = 9.0 / (1.0 + 0.2 * dot(to, to).sqrt());
                add_scaled(to.map(|x| x * pull), -3.5, self.velocities[i])
            })
            .collect();
        for i in 0..PARTICLES {
            for j in i + 1..PARTICLES {
                let apart = add_scaled(self.places[i], -1.0, self.places[j]);
                let squared = dot(apart, apart);
                if squared < REST * REST {
                    let distance = squared.sqrt().max(1e-6);
                    let push = 90.0 * (REST - distance) / distance;
                    forces[i] = add_scaled(forces[i], push, apart);
                    forces[j] = add_scaled(forces[j], -push, apart);
                }
            }
        }
        for i in 0..PARTICLES {
            self.velocities[i] = add_scaled(self.velocities[i], TIME, forces[i]);
            self.places[i] = add_scaled(self.places[i], TIME, self.velocities[i]);
        }
    }

    fn lures(&self) -> [Vec3; LURES] {
        const REACH: Vec3 = [11.0, 6.0, 7.0];
        std::array::from_fn(|lure| {
            std::array::from_fn(|axis| {
                let [pace, phase] = self.tunes[lure][axis];
                REACH[axis] * sin_cos_turns(pace * self.seconds + phase).0
            })
        })
    }
}
