//! A drop has fallen into a round basin: a crown opens, a jet rises from the middle, droplets fly.
//!
//! Source: this project; drawn after photographs of drop impact, not simulated. Still water would stand at y = 0, and
//! the drop fell along the y axis. Every part is laid in rows, rings or shells one particle spacing apart that follow
//! the part's surface, as particles of a simulator do; the sheet of the crown is at least two particles thick.
//!
//! ```text
//!                o                     droplets
//!          .           o   .
//!        \  o    (  )    /   /         fingers
//!         \      |  |   / /            crown, jet
//!     _.-. \_   / __ \ _/ .-._         waves
//!    |      `\_/      \_/     |        basin
//! ```

mod crown;
mod droplets;
mod jet;
mod pool;

use crate::Scene;
use crate::arithmetic::cube_root;
use crate::cloud::Cloud;
use crate::random::Random;

/// Where the crown stands on the water, metres from the axis.
const CROWN_RADIUS: f64 = 0.44;
/// Of the basin.
const BASIN_RADIUS: f64 = 1.0;
/// Of the still water.
const DEPTH: f64 = 0.16;
/// Fewer particles than this cannot show a splash, more than this is not what this scene is for.
const PARTICLES: std::ops::RangeInclusive<usize> = 2_000..=50_000_000;

/// A splash in a basin two metres wide, of about `particles` particles: within 5 % of the number asked for, which is
/// taken to be at least 2 000 and at most 50 million.
///
/// The basin is the same for every number: more particles are smaller ones. `seed` chooses the fingers of the crown, the
/// droplets and the small irregularities. No two particles are closer than 1.4 radii.
pub fn splash(particles: usize, seed: u64) -> Scene {
    let wanted = particles.clamp(*PARTICLES.start(), *PARTICLES.end());
    // Nearly all particles are in the basin: its volume is a good first guess at the spacing.
    let volume = std::f64::consts::PI * BASIN_RADIUS * BASIN_RADIUS * DEPTH * 1.15;
    let mut spacing = cube_root(volume / wanted as f64);
    let mut cloud = splash_of_spacing(spacing, wanted, seed);
    // Thicknesses come in whole particles, so the number is not smooth in the spacing: take the best of a few.
    for _ in 0..6 {
        let miss = |cloud: &Cloud| (cloud.len() as f64 / wanted as f64 - 1.0).abs();
        if miss(&cloud) < 0.01 {
            break;
        }
        spacing *= cube_root(cloud.len() as f64 / wanted as f64);
        let next = splash_of_spacing(spacing, wanted, seed);
        if miss(&next) < miss(&cloud) {
            cloud = next;
        }
    }
    cloud.finish()
}

/// The parts that own their places come first: the pool fills what they leave.
fn splash_of_spacing(spacing: f64, expected: usize, seed: u64) -> Cloud {
    let mut cloud = Cloud::new(spacing, expected, Random::new(seed));
    crown::add(&mut cloud);
    jet::add(&mut cloud);
    droplets::add(&mut cloud);
    pool::add(&mut cloud);
    cloud
}

#[cfg(test)]
mod tests;
