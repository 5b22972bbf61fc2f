//! Functions that a platform's mathematics library rounds in its own way, built from operations that IEEE 754 rounds
//! the same everywhere. Accurate to a few units in the last place, which is far more than a scene needs.

/// A point or a direction.
pub(crate) type Vec3 = [f64; 3];

/// Sine and cosine of an angle in whole turns.
pub(crate) fn sin_cos_turns(turns: f64) -> (f64, f64) {
    // The nearest quarter turn goes by swaps and signs, the rest lies within an eighth of a turn: series.
    let quarters = (turns * 4.0 + 0.5).floor();
    let x = (turns - quarters / 4.0) * std::f64::consts::TAU;
    let xx = x * x;
    let series = |first: f64, lowest: u32| {
        let mut term = first;
        let mut sum = first;
        for k in (lowest..lowest + 16).step_by(2) {
            term *= -xx / f64::from(k * (k + 1));
            sum += term;
        }
        sum
    };
    let (sin, cos) = (series(x, 2), series(1.0, 1));
    match (quarters as i64).rem_euclid(4) {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

/// Cube root of a positive number between about 1e-9 and 1e9, by Newton's method.
pub(crate) fn cube_root(x: f64) -> f64 {
    (0..64).fold(1.0, |root, _| (2.0 * root + x / (root * root)) / 3.0)
}

/// A hump of height 1 at 0, 1/4 at ±1, that falls off with the fourth power.
pub(crate) fn hump(x: f64) -> f64 {
    let y = 1.0 / (1.0 + x * x);
    y * y
}

/// 0 up to `from`, 1 from `to` on, smooth between.
pub(crate) fn ramp(from: f64, to: f64, x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// a + s·b.
pub(crate) fn add_scaled(a: Vec3, s: f64, b: Vec3) -> Vec3 {
    [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]]
}

/// `a` at length 1; `a` must not be 0.
pub(crate) fn normalized(a: Vec3) -> Vec3 {
    let length = (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]).sqrt();
    a.map(|x| x / length)
}

/// The vector at right angles to both.
pub(crate) fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The angle of the direction (x, y) in turns, from −½ to ½; 0 if both are 0. Accurate to 2e-6.
///
/// Source: Abramowitz & Stegun, "Handbook of mathematical functions", 1964, equation 4.4.49.
#[cfg(feature = "skin")]
pub(crate) fn turns_of(y: f32, x: f32) -> f32 {
    let (least, most) = (x.abs().min(y.abs()), x.abs().max(y.abs()));
    if most == 0.0 {
        return 0.0;
    }
    let a = least / most;
    let aa = a * a;
    let arc = a * (0.999_866 + aa * (-0.330_299_5 + aa * (0.180_141 + aa * (-0.085_133 + aa * 0.020_835_1))));
    let eighth = arc / std::f32::consts::TAU;
    let quarter = if y.abs() > x.abs() { 0.25 - eighth } else { eighth };
    let half = if x < 0.0 { 0.5 - quarter } else { quarter };
    if y < 0.0 { -half } else { half }
}

/// The inner product.
pub(crate) fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a + t·(b − a).
pub(crate) fn between(a: Vec3, b: Vec3, t: f64) -> Vec3 {
    std::array::from_fn(|k| a[k] + t * (b[k] - a[k]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_and_cosine_agree_with_the_standard_library() {
        for i in -4000..4000 {
            let turns = f64::from(i) / 997.0;
            let (sin, cos) = sin_cos_turns(turns);
            let (s, c) = (turns * std::f64::consts::TAU).sin_cos();
            assert!((sin - s).abs() < 1e-14 && (cos - c).abs() < 1e-14, "{turns}: {sin} {s}, {cos} {c}");
        }
    }

    #[cfg(feature = "skin")]
    #[test]
    fn turns_agree_with_the_standard_library() {
        for i in 0..4000 {
            let angle = (i as f32 - 2000.0) / 2000.0 * std::f32::consts::PI;
            for length in [1e-3, 1.0, 400.0] {
                let (y, x) = (length * angle.sin(), length * angle.cos());
                let off = turns_of(y, x) - y.atan2(x) / std::f32::consts::TAU;
                // Half a turn either way is the same.
                assert!((off - off.round()).abs() < 3e-6, "{angle}: {off}");
            }
        }
        assert_eq!(turns_of(0.0, 0.0), 0.0);
    }

    #[test]
    fn cube_root_cubed_is_the_number() {
        for x in [1e-9, 1e-3, 0.5, 1.0, 7.0, 1e9] {
            let root = cube_root(x);
            assert!((root * root * root / x - 1.0).abs() < 1e-14, "{x}");
        }
    }
}
