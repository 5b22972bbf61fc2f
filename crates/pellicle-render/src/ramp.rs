//! The color map of values: dark violet over blue, teal and green to light yellow.
//!
//! Made from a rule, not from a table. In OKLab (Björn Ottosson, "A perceptual color space for image processing", 2020),
//! where distances are about as large as they look:
//! - lightness rises evenly from 0.30 to 0.93, so the map reads in grey and to the color-blind;
//! - hue falls evenly from 305° to 100°, the short way round that leaves red and grey aside;
//! - chroma is 0.14, or 0.96 of what sRGB can show of that lightness and hue;
//! - then places are moved along this curve until equal steps of value are equal distances.

use std::sync::LazyLock;

use crate::color::{Light, mix};
use crate::vector::sin_cos;

/// Colors of the finished map.
const STEPS: usize = 256;
/// Points of the curve that its length is measured on.
const FINE: usize = 2048;

static RAMP: LazyLock<Vec<Light>> = LazyLock::new(|| {
    let curve: Vec<[f64; 3]> = (0..=FINE).map(|i| lab(i as f64 / FINE as f64)).collect();
    let mut length = vec![0.0];
    for pair in curve.windows(2) {
        let d: f64 = (0..3).map(|a| (pair[1][a] - pair[0][a]) * (pair[1][a] - pair[0][a])).sum();
        length.push(length[length.len() - 1] + d.sqrt());
    }
    let total = length[FINE];
    let mut at = 0;
    let color = |step: usize| {
        let wanted = total * step as f64 / (STEPS - 1) as f64;
        while at + 2 < length.len() && length[at + 1] < wanted {
            at += 1;
        }
        let t = ((wanted - length[at]) / (length[at + 1] - length[at])).clamp(0.0, 1.0);
        let lab = std::array::from_fn(|a| curve[at][a] + t * (curve[at + 1][a] - curve[at][a]));
        light(lab).map(|x| x.clamp(0.0, 1.0) as f32)
    };
    (0..STEPS).map(color).collect()
});

/// The color of a value at `t` of its range; beyond 0 and 1 the ends' colors. `t` is a number.
pub(crate) fn ramp(t: f32) -> Light {
    let place = t.clamp(0.0, 1.0) * (STEPS - 1) as f32;
    let low = (place as usize).min(STEPS - 2);
    mix(RAMP[low], RAMP[low + 1], place - low as f32)
}

/// The rule's curve in OKLab, before its places are evened out.
fn lab(t: f64) -> [f64; 3] {
    let lightness = 0.30 + 0.63 * t;
    let (sin, cos) = sin_cos(305.0 - 205.0 * t);
    let fits = |chroma: f64| light([lightness, chroma * cos, chroma * sin]).iter().all(|x| (0.0..=1.0).contains(x));
    // Gamut by halving: what fits is connected to grey.
    let (mut inside, mut outside) = (0.0, 0.4);
    for _ in 0..40 {
        let middle = (inside + outside) / 2.0;
        if fits(middle) { inside = middle } else { outside = middle }
    }
    let chroma = (0.96 * inside).min(0.14);
    [lightness, chroma * cos, chroma * sin]
}

/// OKLab to linear light.
fn light([l, a, b]: [f64; 3]) -> [f64; 3] {
    let cube = |x: f64| x * x * x;
    let long = cube(l + 0.396_337_777_4 * a + 0.215_803_757_3 * b);
    let middle = cube(l - 0.105_561_345_8 * a - 0.063_854_172_8 * b);
    let short = cube(l - 0.089_484_177_5 * a - 1.291_485_548 * b);
    [
        4.076_741_662_1 * long - 3.307_711_591_3 * middle + 0.230_969_929_2 * short,
        -1.268_438_004_6 * long + 2.609_757_401_1 * middle - 0.341_319_396_5 * short,
        -0.004_196_086_3 * long - 0.703_418_614_7 * middle + 1.707_614_701 * short,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_and_black_are_where_oklab_has_them() {
        assert!(light([1.0, 0.0, 0.0]).iter().all(|x| (x - 1.0).abs() < 1e-6));
        assert_eq!(light([0.0, 0.0, 0.0]), [0.0; 3]);
    }

    #[test]
    fn it_gets_lighter_all_the_way() {
        let luminance = |c: Light| 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
        for step in 1..STEPS {
            assert!(luminance(RAMP[step]) > luminance(RAMP[step - 1]), "{step}");
        }
        assert!(luminance(RAMP[0]) < 0.06 && luminance(RAMP[STEPS - 1]) > 0.7);
    }

    #[test]
    fn values_beyond_the_range_have_the_colors_of_its_ends() {
        assert_eq!(ramp(-5.0), RAMP[0]);
        assert_eq!(ramp(f32::INFINITY), RAMP[STEPS - 1]);
    }
}
