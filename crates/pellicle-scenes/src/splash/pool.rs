//! The water of the basin: columns on rings, each stacked evenly from the floor to the waves.

use super::{BASIN_RADIUS, CROWN_RADIUS, DEPTH};
use crate::arithmetic::{Vec3, hump, ramp, sin_cos_turns};
use crate::cloud::Cloud;

pub(super) fn add(cloud: &mut Cloud) {
    let spacing = cloud.spacing;
    let chop: [f64; 4] = std::array::from_fn(|_| cloud.random.unit());
    let rings = (BASIN_RADIUS / spacing).round().max(1.0);
    for ring in 0..rings as u32 {
        let away = (f64::from(ring) + 0.5) * BASIN_RADIUS / rings;
        let count = (std::f64::consts::TAU * away / spacing).round();
        let phase = cloud.random.unit();
        for i in 0..count as u32 {
            let turns = (f64::from(i) + phase) / count;
            let (sin, cos) = sin_cos_turns(turns);
            let column = DEPTH + level(away, turns, chop);
            let layers = (column / spacing).round().max(1.0);
            for layer in 0..layers as u32 {
                let y = (f64::from(layer) + 0.5) * column / layers - DEPTH;
                cloud.add([away * cos, y, away * sin], velocity(away, y, sin, cos));
            }
        }
    }
}

/// Height of the water above still water: a bowl with the jet's foot in it, a swell that carries the crown, rings of
/// waves that run outward, and a little chop so that nothing is quite round.
fn level(away: f64, turns: f64, chop: [f64; 4]) -> f64 {
    let bowl = -0.1 * (1.0 - ramp(0.2, CROWN_RADIUS, away)) + 0.13 * hump(away / 0.1);
    let swell = 0.075 * hump((away - CROWN_RADIUS) / 0.075);
    let far = ramp(CROWN_RADIUS, 0.62, away);
    let waves = 0.02 * far * (1.0 - 0.6 * ramp(0.6, 1.0, away)) * sin_cos_turns((away - 0.55) / 0.17).0;
    let rough = 0.007 * sin_cos_turns(5.0 * turns + 2.0 * away + chop[0]).0
        + 0.005 * sin_cos_turns(9.0 * turns - 3.0 * away + chop[1]).0
        + 0.004 * sin_cos_turns(14.0 * turns + 4.0 * away + chop[2]).0
        + 0.004 * sin_cos_turns(23.0 * turns - 5.0 * away + chop[3]).0;
    bowl + swell + waves + far * rough
}

/// Outward under the crown, upward under the jet and in the swell, still at the wall and the floor.
fn velocity(away: f64, y: f64, sin: f64, cos: f64) -> Vec3 {
    let depth = ramp(-DEPTH, 0.0, y);
    let out = 0.7 * depth * hump((away - CROWN_RADIUS) / 0.15) * ramp(0.0, 0.2, away);
    let up = depth * (0.8 * hump(away / 0.09) + 0.9 * hump((away - CROWN_RADIUS) / 0.07));
    [out * cos, up, out * sin]
}
