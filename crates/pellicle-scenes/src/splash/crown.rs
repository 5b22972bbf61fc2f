//! The crown: a thin sheet that opens upward, thicker at its foot and its rim, with fingers that shed droplets.

use super::{BASIN_RADIUS, CROWN_RADIUS};
use crate::arithmetic::{Vec3, add_scaled, hump, ramp, sin_cos_turns};
use crate::cloud::Cloud;
use crate::random::Random;

/// Height of the sheet along its slope, metres, before fingers pull the rim up.
const SLOPE: f64 = 0.36;
/// Thickness of the sheet between foot and rim, metres; never under two particles.
const THICKNESS: f64 = 0.035;

/// One finger: where it stands on the rim, and how far it reaches beyond.
struct Finger {
    turns: f64,
    length: f64,
    radius: f64,
}

pub(super) fn add(cloud: &mut Cloud) {
    let fingers = fingers(&mut cloud.random);
    let sway = [cloud.random.unit(), cloud.random.unit()];
    let rim = |turns: f64| rim(turns, &fingers, sway);
    add_sheet(cloud, rim);
    for finger in &fingers {
        add_finger(cloud, finger, rim(finger.turns));
    }
}

/// Spaced evenly but for a third of the gap, as the instability of a rim spaces them.
fn fingers(random: &mut Random) -> Vec<Finger> {
    let count = 17 + (random.bits() % 4) as u32;
    let place = |i: u32, random: &mut Random| Finger {
        turns: (f64::from(i) + random.between(-0.3, 0.3)) / f64::from(count),
        length: random.between(0.05, 0.17),
        radius: random.between(0.022, 0.034),
    };
    (0..count).map(|i| place(i, random)).collect()
}

/// Length of the sheet along its slope at one angle: pulled up to a cusp at each finger, and swaying slowly around.
fn rim(turns: f64, fingers: &[Finger], sway: [f64; 2]) -> f64 {
    let pull = fingers.iter().map(|finger| {
        let away = turns - finger.turns;
        let away = away - away.round();
        (0.25 * finger.length + 0.03) * hump(away / 0.014)
    });
    let slow = 0.025 * sin_cos_turns(turns + sway[0]).0 + 0.018 * sin_cos_turns(3.0 * turns + sway[1]).0;
    SLOPE + slow + pull.sum::<f64>()
}

/// A point of the sheet and the upward direction of its slope, `along` metres from its foot. The sheet leaves the water
/// steeply and opens: its slope turns outward with constant curvature, here to second order.
fn profile(along: f64, turns: f64) -> (Vec3, Vec3) {
    let (lean, curl) = (0.16, 1.15);
    let outward = lean + curl * along;
    let radius = CROWN_RADIUS + lean * along + curl * along * along / 2.0;
    let height = -0.03 + along * (1.0 - outward * outward / 6.0);
    let (sin, cos) = sin_cos_turns(turns);
    let up = 1.0 - outward * outward / 2.0;
    let length = (outward * outward + up * up).sqrt();
    let slope = [outward * cos / length, up / length, outward * sin / length];
    ([radius * cos, height, radius * sin], slope)
}

/// Water in the sheet moves along its slope, fastest where it left last.
fn velocity(along: f64, slope: Vec3) -> Vec3 {
    slope.map(|x| x * (2.4 - 2.0 * along))
}

/// Rows of rings, each of as many layers as the sheet is thick there.
fn add_sheet(cloud: &mut Cloud, rim: impl Fn(f64) -> f64) {
    let spacing = cloud.spacing;
    let mut along = 0.0;
    while along < 2.0 * SLOPE {
        let (place, _) = profile(along, 0.0);
        let count = (std::f64::consts::TAU * place[0] / spacing).round();
        let phase = cloud.random.unit();
        for i in 0..count as u32 {
            let turns = (f64::from(i) + phase) / count;
            let left = rim(turns) - along;
            if left < 0.0 {
                continue;
            }
            let (place, slope) = profile(along, turns);
            let (sin, cos) = sin_cos_turns(turns);
            let normal = [slope[1] * cos, -(slope[0] * cos + slope[2] * sin), slope[1] * sin];
            let foot = 0.05 * (1.0 - ramp(0.0, 0.12, along));
            let bead = 0.022 * (1.0 - ramp(0.015, 0.035, left));
            let layers = ((THICKNESS + foot + bead) / spacing).round().max(2.0);
            for layer in 0..layers as u32 {
                let offset = (f64::from(layer) - (layers - 1.0) / 2.0) * spacing;
                cloud.add(add_scaled(place, offset, normal), velocity(along, slope));
            }
        }
        along += spacing;
    }
}

/// A tapering thread with a bulb at its end, and the droplets that it shed before.
fn add_finger(cloud: &mut Cloud, finger: &Finger, rim: f64) {
    let spacing = cloud.spacing;
    let thick = finger.radius.max(0.9 * spacing);
    let mut along = rim - spacing;
    while along < rim + finger.length {
        let (place, slope) = profile(along, finger.turns);
        let part = ((along - rim) / finger.length).clamp(0.0, 1.0);
        cloud.add_disc(place, slope, thick * (1.15 - 0.65 * part), velocity(along, slope));
        along += spacing;
    }
    let mut radius = thick * cloud.random.between(1.05, 1.4);
    for _ in 0..1 + cloud.random.bits() % 4 {
        let (place, slope) = profile(along, finger.turns);
        if place[0] * place[0] + place[2] * place[2] > BASIN_RADIUS * BASIN_RADIUS {
            break;
        }
        cloud.add_ball(place, radius, velocity(along, slope));
        radius *= cloud.random.between(0.55, 0.9);
        along += radius + spacing * cloud.random.between(3.0, 5.0);
    }
}
