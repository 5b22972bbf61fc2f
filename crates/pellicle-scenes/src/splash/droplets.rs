//! Droplets in flight, thrown off the crown a while ago: most are small, some hold tens of particles.

use super::{BASIN_RADIUS, CROWN_RADIUS};
use crate::arithmetic::sin_cos_turns;
use crate::cloud::Cloud;

const GRAVITY: f64 = 9.81;
/// Throws tried; those that would land on something else are dropped.
const THROWS: usize = 150;

pub(super) fn add(cloud: &mut Cloud) {
    for _ in 0..THROWS {
        let random = &mut cloud.random;
        let (sin, cos) = sin_cos_turns(random.unit());
        let start = CROWN_RADIUS + random.between(0.0, 0.2);
        let (out, up) = (random.between(0.15, 1.5), random.between(1.9, 3.3));
        let time = random.between(0.08, 0.42);
        let size = random.unit();
        // Few are large: the size falls off with the fourth power of a uniform number.
        let radius = 0.012 + 0.04 * size * size * size * size;
        let away = start + out * time;
        let height = 0.15 + up * time - GRAVITY * time * time / 2.0;
        let place = [away * cos, height, away * sin];
        // A gap of two and a half spacings keeps the droplet's surface apart from all others.
        let room = radius + 2.5 * cloud.spacing;
        if height > 0.12 && away < BASIN_RADIUS && cloud.is_free(place, room) {
            cloud.add_ball(place, radius, [out * cos, up - GRAVITY * time, out * sin]);
        }
    }
}
