//! 250 particles that play a monster: it grows tentacles, waves them, draws itself together into a ball, leaps at a wall and
//! coats it, bursts, and reassembles.
//!
//! Source: Rosenberg & Birdwell, "Real-time particle isosurface extraction", 2008, section 7, tells what it does; how is
//! ours. Each particle follows a place that its act assigns to it as if it hung on a damped spring; after the burst it
//! flies free until its turn comes.
//!
//! ```text
//! frame   0       100     150      200   225        300
//!         tentacles  ball    wall    burst  reassembly
//! ```

use crate::arithmetic::{Vec3, add_scaled, between, cross, dot, normalized, ramp, sin_cos_turns};
use crate::random::Random;
use crate::show::Limb;
use crate::show::explosion::packed;

const BODY: usize = 130;
const ARMS: usize = 5;
const ARM: usize = 24;
const PARTICLES: usize = BODY + ARMS * ARM;
/// Seconds of a frame.
const TIME: f64 = 1.0 / 30.0;
/// Frames at which the acts begin.
const BALL: usize = 100;
const WALL: usize = 150;
const BURST: usize = 200;
const REUNION: usize = 225;
/// Where the monster stands.
const HOME: Vec3 = [0.0, 6.0, 0.0];
/// What its splash on the wall spreads from; the wall's x is the first number.
const SPLASH: Vec3 = [19.0, 18.5, 0.0];
/// From the middle of the body to the first particle of a tentacle, and to the last.
const ROOT: f64 = 3.0;
const TIP: f64 = 18.0;

#[derive(Debug, Clone)]
pub(super) struct Monster {
    places: Vec<Vec3>,
    velocities: Vec<Vec3>,
    /// The whole as a ball, and the splash, around their middles; the body takes the first of both.
    ball: Vec<Vec3>,
    splash: Vec<Vec3>,
    /// How far a particle flies in the burst, in units a second.
    flight: Vec<Vec3>,
    /// Frames after the first that it turns back.
    delay: Vec<usize>,
    frame: usize,
}

impl Monster {
    pub fn new(seed: u64) -> Self {
        let mut random = Random::new(seed);
        let splash = (0..PARTICLES)
            .map(|i| {
                let radius = 0.85 * (i as f64 + 0.5).sqrt() * random.between(0.88, 1.1);
                let (sin, cos) = sin_cos_turns(i as f64 * 0.618_033_988_749_895);
                [0.0, radius * cos, radius * sin]
            })
            .collect();
        let flight = (0..PARTICLES)
            .map(|_| add_scaled([-random.between(3.0, 22.0), random.between(-2.0, 9.0), 0.0], 9.0, random.in_ball(1.0)))
            .collect();
        let mut monster = Self {
            places: Vec::new(),
            velocities: vec![[0.0; 3]; PARTICLES],
            ball: packed(PARTICLES),
            splash,
            flight,
            delay: (0..PARTICLES).map(|_| random.below(16)).collect(),
            frame: 0,
        };
        monster.places = (0..PARTICLES).map(|i| monster.stand(i)).collect();
        monster
    }

    pub fn places(&self) -> &[Vec3] {
        &self.places
    }

    pub fn step(&mut self) {
        self.frame += 1;
        for i in 0..PARTICLES {
            if self.frame == BURST {
                self.velocities[i] = self.flight[i];
            }
            if (BURST..REUNION + self.delay[i]).contains(&self.frame) {
                self.fly(i);
            } else {
                self.follow(i);
            }
        }
    }

    /// Two steps of a spring at its critical damping.
    fn follow(&mut self, i: usize) {
        let target = self.target(i);
        let stiffness = if self.frame < REUNION { 110.0 } else { 45.0f64 };
        for _ in 0..2 {
            let pull = add_scaled(target, -1.0, self.places[i]).map(|x| x * stiffness);
            let force = add_scaled(pull, -2.0 * stiffness.sqrt(), self.velocities[i]);
            self.velocities[i] = add_scaled(self.velocities[i], TIME / 2.0, force);
            self.places[i] = add_scaled(self.places[i], TIME / 2.0, self.velocities[i]);
        }
    }

    fn fly(&mut self, i: usize) {
        let (place, velocity) = (&mut self.places[i], &mut self.velocities[i]);
        velocity[1] -= TIME * 12.0;
        *place = add_scaled(*place, TIME, *velocity);
        if place[1] < 0.0 {
            place[1] *= -0.3;
            *velocity = [0.6 * velocity[0], -0.3 * velocity[1], 0.6 * velocity[2]];
        }
    }

    fn target(&self, i: usize) -> Vec3 {
        let since = |frame: usize| self.frame.saturating_sub(frame) as f64;
        match self.frame {
            ..BALL => self.stand(i),
            // The ball ducks, then leaps.
            BALL..WALL => {
                let leap = ramp(25.0, 50.0, since(BALL));
                let middle = add_scaled(between(HOME, SPLASH, leap), 10.0 * leap * (1.0 - leap), [0.0, 1.0, 0.0]);
                add_scaled(middle, 0.95, self.ball[i])
            }
            WALL..REUNION => {
                // The coat sags while it hangs.
                let sag = 0.06 * since(WALL) * ramp(0.0, 40.0, since(WALL));
                let spread = between(self.ball[i], self.splash[i], ramp(0.0, 18.0, since(WALL)));
                add_scaled(add_scaled(SPLASH, 1.0, spread), -sag, [0.0, 1.0, 0.0])
            }
            _ => self.stand(i),
        }
    }

    /// How far the tentacles have grown, 0 to 1.
    fn growth(&self) -> f64 {
        let frame = self.frame as f64;
        ramp(8.0, 70.0, frame) * (1.0 - ramp(92.0, 112.0, frame)) + ramp(235.0, 280.0, frame)
    }

    /// Where a particle of the standing monster has its place.
    fn stand(&self, i: usize) -> Vec3 {
        let seconds = self.frame as f64 * TIME;
        if i < BODY {
            let breath = 1.0 + 0.04 * sin_cos_turns(0.5 * seconds).0;
            return add_scaled(HOME, breath, self.ball[i]);
        }
        let (arm, s) = arm_of(i);
        let [out, side] = directions(arm);
        let wave = |turns: f64| sin_cos_turns(turns + 0.37 * arm as f64).0;
        let reach = self.growth() * s;
        let sway = 3.6 * reach * wave(0.8 * s - 0.55 * seconds);
        let lift = 2.8 * reach * wave(0.6 * s - 0.4 * seconds + 0.25) + 3.0 * reach * reach * (1.0 - 1.4 * reach);
        let place = add_scaled(HOME, ROOT + (TIP - ROOT) * reach, out);
        add_scaled(add_scaled(place, sway, side), lift, [0.0, 1.0, 0.0])
    }

    /// The places on limbs, and the strengths. A tentacle is thinner toward its tip, and ringed. Of body and ball the limb
    /// is the vertical axis.
    pub fn limbs(&self, limbs: &mut Vec<Limb>, strengths: &mut Vec<f32>) {
        limbs.clear();
        strengths.clear();
        let grown = self.growth().clamp(0.0, 1.0);
        for i in 0..PARTICLES {
            let (mut side, mut axis) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
            let mut along = self.places[i][1] - HOME[1];
            let mut strength = 1.0;
            if i >= BODY {
                let (arm, s) = arm_of(i);
                let [out, across] = directions(arm);
                let toward = self.tangent(i).unwrap_or(out);
                axis = steady(between(axis, toward, grown), out);
                side = between(side, across, grown);
                along += grown * (ROOT + (TIP - ROOT) * s - along);
                strength += grown * (0.9 - 0.62 * s + 0.1 * sin_cos_turns(5.0 * s).0 - 1.0);
            }
            // Across the axis whatever happens; the third direction cannot be parallel to it when both others nearly are.
            let side = [side, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]
                .into_iter()
                .map(|v| add_scaled(v, -dot(v, axis), axis))
                .find(|v| dot(*v, *v) > 1e-3)
                .map_or([0.0, 0.0, 1.0], normalized);
            let up = cross(side, axis);
            limbs.push(Limb { side: side.map(|x| x as f32), up: up.map(|x| x as f32), along: along as f32 });
            strengths.push(strength as f32);
        }
    }

    /// Along a tentacle as it is, outward.
    fn tangent(&self, i: usize) -> Option<Vec3> {
        let j = (i - BODY) % ARM;
        let (before, after) = (if j == 0 { i } else { i - 1 }, if j + 1 == ARM { i } else { i + 1 });
        let chord = add_scaled(self.places[after], -1.0, self.places[before]);
        (dot(chord, chord) > 1e-6).then(|| normalized(chord))
    }
}

/// The tentacle of a particle, and how far along it sits: above 0 to 1.
fn arm_of(i: usize) -> (usize, f64) {
    let j = i - BODY;
    (j / ARM, (j % ARM + 1) as f64 / ARM as f64)
}

/// Where a tentacle points, and the horizontal direction across it.
fn directions(arm: usize) -> [Vec3; 2] {
    let (sin, cos) = sin_cos_turns(arm as f64 / ARMS as f64 + 0.05);
    let rise = if arm.is_multiple_of(2) { 0.1 } else { 0.55 };
    [normalized([cos, rise, sin]), [-sin, 0.0, cos]]
}

/// At length 1, or `other` if too short for a direction.
fn steady(v: Vec3, other: Vec3) -> Vec3 {
    if dot(v, v) > 1e-6 { normalized(v) } else { other }
}
