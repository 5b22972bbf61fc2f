//! A jet that rises, spreads, falls, and splashes in all directions from the ground.
//!
//! Source: this project. Particles are thrown and fall, each for itself; where one meets the ground it bounces. After
//! [`LIFE`] frames it starts again at the nozzle, so the number stays at 20 · 150 = 3000.

use crate::arithmetic::{Vec3, add_scaled, sin_cos_turns};
use crate::random::Random;

/// Particles that leave the nozzle in a frame.
const STREAM: usize = 20;
/// Frames from the nozzle until a particle is taken back.
const LIFE: usize = 150;
/// Seconds of a frame.
const TIME: f64 = 1.0 / 30.0;
/// Of gravity, units a second².
const GRAVITY: f64 = 9.81;
/// Of the jet at the nozzle, units a second: it rises 27 units.
const SPEED: f64 = 23.0;
/// What of a particle's speed the ground leaves, upward and along.
const BOUNCE: [f64; 2] = [0.42, 0.8];

#[derive(Debug, Clone)]
pub(super) struct Fountain {
    random: Random,
    places: Vec<Vec3>,
    velocities: Vec<Vec3>,
    /// The oldest, once there are all.
    next: usize,
}

impl Fountain {
    pub fn new(seed: u64) -> Self {
        let mut fountain = Self { random: Random::new(seed), places: Vec::new(), velocities: Vec::new(), next: 0 };
        fountain.emit();
        fountain
    }

    pub fn places(&self) -> &[Vec3] {
        &self.places
    }

    pub fn step(&mut self) {
        for (place, velocity) in self.places.iter_mut().zip(&mut self.velocities) {
            let fallen = add_scaled(*velocity, TIME, [0.0, -GRAVITY, 0.0]);
            *place = add_scaled(*place, TIME / 2.0, add_scaled(*velocity, 1.0, fallen));
            *velocity = fallen;
            if place[1] < 0.0 {
                place[1] *= -BOUNCE[0];
                *velocity = [BOUNCE[1] * fallen[0], BOUNCE[0] * fallen[1].abs(), BOUNCE[1] * fallen[2]];
            }
        }
        self.emit();
    }

    fn emit(&mut self) {
        for _ in 0..STREAM {
            let (place, velocity) = self.throw();
            if self.places.len() < STREAM * LIFE {
                self.places.push(place);
                self.velocities.push(velocity);
            } else {
                (self.places[self.next], self.velocities[self.next]) = (place, velocity);
                self.next = (self.next + 1) % (STREAM * LIFE);
            }
        }
    }

    /// A particle somewhere in the stretch of jet that leaves the nozzle in one frame.
    fn throw(&mut self) -> (Vec3, Vec3) {
        let random = &mut self.random;
        let speed = SPEED * (1.0 + 0.07 * random.bell());
        let (sin, cos) = sin_cos_turns(random.unit());
        // The tangent of the angle to the vertical.
        let tilt = 0.22 * random.bell();
        let upright = 1.0 / (1.0 + tilt * tilt).sqrt();
        let velocity = [tilt * cos, 1.0, tilt * sin].map(|x| x * upright * speed);
        let nozzle = random.in_ball(0.4);
        (add_scaled(nozzle, TIME * random.unit(), velocity), velocity)
    }
}
