//! How light falls on a surface: a key light, a fill light, the sky, a highlight and a rim.
//!
//! Lights stand by the camera, not in the world: whatever side a turntable shows is well lit. Only the sky stays above.
//! Directions are unit vectors with x to the right, y up and z towards the viewer. Powers are products: `powf` need not
//! round the same everywhere.

use crate::color::Light;

/// From the upper left, a little behind the camera; warm.
const KEY: ([f32; 3], Light) = ([-0.466_236, 0.704_019, 0.535_707], [0.84, 0.81, 0.76]);
/// From the right, low; cool.
const FILL: ([f32; 3], Light) = ([0.868_243, 0.124_035, 0.480_392], [0.13, 0.16, 0.20]);
/// From above and below.
const SKY: Light = [0.40, 0.43, 0.47];
const GROUND: Light = [0.13, 0.125, 0.12];

/// How a surface answers to light.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Finish {
    /// Of the highlight.
    pub gloss: f32,
    /// Of the light that grazing views get from the sky.
    pub rim: f32,
}

impl Finish {
    /// Wet: for surfaces in one color.
    pub const WET: Self = Self { gloss: 0.28, rim: 0.20 };
    /// Dull: where the color is a value that must be read.
    pub const DULL: Self = Self { gloss: 0.03, rim: 0.04 };
    /// Spheres: little gloss, or a thousand small highlights glitter.
    pub const GRAIN: Self = Self { gloss: 0.08, rim: 0.06 };
}

/// Light that a surface sends to the viewer. `normal` and `viewer` are unit vectors, on one side of the surface; `sky` is
/// the world's up.
pub(crate) fn lit(albedo: Light, finish: Finish, normal: [f32; 3], viewer: [f32; 3], sky: [f32; 3]) -> Light {
    let key = dot(normal, KEY.0);
    // Wrapped a little, so that the border of the shade is soft.
    let key = ((key + 0.15) / 1.15).max(0.0);
    let fill = ((dot(normal, FILL.0) + 0.3) / 1.3).max(0.0);
    let above = 0.5 + 0.5 * dot(normal, sky);

    let half = unit([KEY.0[0] + viewer[0], KEY.0[1] + viewer[1], KEY.0[2] + viewer[2]]);
    let shine = dot(normal, half).max(0.0);
    let shine = power_48(shine) * finish.gloss;

    let grazing = 1.0 - dot(normal, viewer).clamp(0.0, 1.0);
    let grazing = grazing * grazing * grazing;
    let rim = grazing * finish.rim * (0.35 + 0.65 * above);

    std::array::from_fn(|c| {
        let ambient = GROUND[c] + above * (SKY[c] - GROUND[c]);
        let diffuse = KEY.1[c] * key + FILL.1[c] * fill + ambient;
        albedo[c] * diffuse + KEY.1[c] * shine + SKY[c] * 2.0 * rim
    })
}

/// Directions and lights by name, for the shader of the page.
pub(crate) const fn constants() -> [(&'static str, [f32; 3]); 6] {
    [
        ("KEY_DIRECTION", KEY.0),
        ("KEY_LIGHT", KEY.1),
        ("FILL_DIRECTION", FILL.0),
        ("FILL_LIGHT", FILL.1),
        ("SKY_LIGHT", SKY),
        ("GROUND_LIGHT", GROUND),
    ]
}

/// x⁴⁸.
fn power_48(x: f32) -> f32 {
    let x2 = x * x;
    let x4 = x2 * x2;
    let x16 = x4 * x4 * x4 * x4;
    x16 * x16 * x16
}

pub(crate) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// At length 1; 0 and what is not a number become the direction to the viewer.
pub(crate) fn unit(a: [f32; 3]) -> [f32; 3] {
    let length = dot(a, a).sqrt();
    if length > 0.0 && length.is_finite() { a.map(|x| x / length) } else { [0.0, 0.0, 1.0] }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AHEAD: [f32; 3] = [0.0, 0.0, 1.0];
    const UP: [f32; 3] = [0.0, 1.0, 0.0];

    #[test]
    fn directions_are_units() {
        for d in [KEY.0, FILL.0] {
            assert!((dot(d, d) - 1.0).abs() < 1e-5, "{d:?} {}", dot(d, d));
        }
    }

    #[test]
    fn the_upper_left_is_brighter_than_the_lower_right_and_nothing_is_black() {
        let of = |n: [f32; 3]| lit([0.5; 3], Finish::DULL, unit(n), AHEAD, UP)[1];
        assert!(of([-1.0, 1.0, 1.0]) > 1.5 * of([1.0, -1.0, 1.0]));
        assert!(of([0.3, -1.0, 0.0]) > 0.03);
    }

    #[test]
    fn a_dull_white_wall_is_about_white() {
        let wall = lit([1.0; 3], Finish::DULL, AHEAD, AHEAD, UP);
        assert!(wall.iter().all(|x| (0.8..1.1).contains(x)), "{wall:?}");
    }
}
