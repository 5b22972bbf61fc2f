//! A packed ball of 1000 particles that trembles for a moment and flies apart.
//!
//! Source: this project. Places in the ball are those of a Fibonacci lattice on shells one unit apart; what flies falls.

use crate::arithmetic::{Vec3, add_scaled, dot, sin_cos_turns};
use crate::random::Random;

const PARTICLES: usize = 1000;
/// Frames before it bursts.
const WAIT: usize = 20;
/// Seconds of a frame.
const TIME: f64 = 1.0 / 60.0;
/// Of gravity, units a second².
const GRAVITY: f64 = 1.5;

#[derive(Debug, Clone)]
pub(super) struct Explosion {
    random: Random,
    rest: Vec<Vec3>,
    places: Vec<Vec3>,
    velocities: Vec<Vec3>,
    frame: usize,
}

impl Explosion {
    pub fn new(seed: u64) -> Self {
        let mut random = Random::new(seed);
        let rest: Vec<Vec3> = packed(PARTICLES).into_iter().map(|p| add_scaled(p, 0.15, random.in_cube(1.0))).collect();
        let radius = rest.iter().map(|&p| dot(p, p)).fold(0.0, f64::max).sqrt();
        let velocities = rest
            .iter()
            .map(|&p| {
                let distance = dot(p, p).sqrt().max(1e-6);
                let speed = random.between(2.0, 9.0) * (0.3 + 0.7 * distance / radius);
                let stray: Vec3 = std::array::from_fn(|_| 0.25 * random.bell());
                add_scaled(stray, 1.0 / distance, p).map(|x| x * speed)
            })
            .collect();
        Self { random, places: rest.clone(), rest, velocities, frame: 0 }
    }

    pub fn places(&self) -> &[Vec3] {
        &self.places
    }

    pub fn step(&mut self) {
        self.frame += 1;
        if self.frame <= WAIT {
            let tremble = 0.2 * self.frame as f64 / WAIT as f64;
            for (place, &rest) in self.places.iter_mut().zip(&self.rest) {
                *place = add_scaled(rest, tremble, self.random.in_cube(1.0));
            }
            return;
        }
        for (place, velocity) in self.places.iter_mut().zip(&mut self.velocities) {
            *place = add_scaled(*place, TIME, *velocity);
            velocity[1] -= TIME * GRAVITY;
        }
    }
}

/// A ball of `count` places, about one apart, from the middle outward.
pub(super) fn packed(count: usize) -> Vec<Vec3> {
    let mut places = Vec::with_capacity(count);
    let mut shell = 0.0;
    while places.len() < count {
        // Where the last shell is not full its places spread over the whole sphere, too.
        let full = (2.0 * std::f64::consts::TAU * shell * shell).round().max(1.0);
        let on_shell = full.min((count - places.len()) as f64);
        for i in 0..on_shell as usize {
            // The golden ratio spreads points over the sphere (Fibonacci lattice).
            let y = 1.0 - (2.0 * i as f64 + 1.0) / on_shell;
            let (sin, cos) = sin_cos_turns(i as f64 * 0.618_033_988_749_895 + 0.37 * shell);
            let flat = (1.0 - y * y).max(0.0).sqrt();
            places.push([shell * flat * cos, shell * y, shell * flat * sin]);
        }
        shell += 1.0;
    }
    places
}
