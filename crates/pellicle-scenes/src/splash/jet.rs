//! The jet that shoots up where the cavity closed: a column that swells and necks, with drops pinching off its tip.

use crate::arithmetic::{Vec3, hump, sin_cos_turns};
use crate::cloud::Cloud;

/// Where the column ends, metres above still water.
const TIP: f64 = 0.56;

pub(super) fn add(cloud: &mut Cloud) {
    let sway = [cloud.random.unit(), cloud.random.unit()];
    let swell = cloud.random.unit();
    let axis = |y: f64| {
        let lean = 0.03 * (y / TIP) * (y / TIP);
        [lean * sin_cos_turns(y + sway[0]).0, y, lean * sin_cos_turns(1.3 * y + sway[1]).0]
    };
    let mut y = -0.1;
    while y < TIP {
        let part = (y / TIP).clamp(0.0, 1.0);
        let wave = 1.0 + 0.28 * part * sin_cos_turns(3.2 * part * part + swell).0;
        let radius = 0.052 * wave * (1.0 - 0.25 * part) + 0.13 * hump((y + 0.1) / 0.13);
        cloud.add_disc(axis(y), [0.0, 1.0, 0.0], radius.max(0.9 * cloud.spacing), velocity(y));
        y += cloud.spacing;
    }
    let mut radius = 0.074;
    y += 0.3 * radius;
    for _ in 0..3 {
        cloud.add_ball(axis(y), radius, velocity(y));
        let lower = radius;
        radius *= cloud.random.between(0.55, 0.8);
        y += lower + radius + 3.0 * cloud.spacing * cloud.random.between(0.8, 1.3);
    }
}

/// The higher, the faster: it is stretched as it rises.
fn velocity(y: f64) -> Vec3 {
    [0.0, 0.8 + 3.0 * y.max(0.0), 0.0]
}
