//! Colors: sRGB for people and files, linear light for computing.
//!
//! Light adds up in linear numbers only, so shading, blending and the average over samples use those. The curve between
//! the two (IEC 61966-2-1) has the exponent 2.4, which is y² · ⁵√y²: fifth roots by Newton's method round the same on every
//! platform, `powf` need not.

use std::sync::LazyLock;

/// Red, green, blue as stored in a PNG: sRGB, 0 to 255.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Color(pub [u8; 3]);

/// Linear light; 0 is black, 1 what white reflects.
pub(crate) type Light = [f32; 3];

impl Color {
    /// The default of meshes: a clear water blue.
    pub const WATER: Self = Self([86, 158, 214]);
    /// Outsides, where both sides are told apart.
    pub const OUTSIDE: Self = Self([172, 181, 191]);
    /// Insides, where both sides are told apart: glaring, so that a hole cannot be missed.
    pub const INSIDE: Self = Self([226, 38, 84]);
    /// The default of spheres.
    pub const GRAIN: Self = Self([104, 166, 226]);
    /// Wires.
    pub const WIRE: Self = Self([22, 34, 54]);
    /// Values that are not a number.
    pub const NAN: Self = Self([128, 128, 128]);
    /// Text on a light background.
    pub const INK: Self = Self([44, 50, 60]);
    /// White.
    pub const WHITE: Self = Self([255, 255, 255]);

    pub(crate) fn light(self) -> Light {
        self.0.map(|byte| TABLES.light[usize::from(byte)])
    }

    /// Whether dark ink reads better on it than white.
    pub(crate) fn is_light(self) -> bool {
        let [r, g, b] = self.light();
        0.2126 * r + 0.7152 * g + 0.0722 * b > 0.2
    }
}

/// The nearest color; less than 0 is black, more than 1 is full.
pub(crate) fn encode(light: Light) -> Color {
    Color(light.map(|x| TABLES.byte(x)))
}

/// a + t·(b − a).
pub(crate) fn mix(a: Light, b: Light, t: f32) -> Light {
    [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])]
}

/// Steps of the first guess at a byte.
const GUESSES: usize = 4096;

struct Tables {
    /// Linear light of each byte.
    light: [f32; 256],
    /// `above[b]`: from here on the byte is at least b + 1. The last is infinite.
    above: [f32; 256],
    /// The byte at the beginning of each step.
    guess: Vec<u8>,
}

static TABLES: LazyLock<Tables> = LazyLock::new(|| {
    let light = std::array::from_fn(|b| linear(b as f64 / 255.0) as f32);
    let above: [f32; 256] =
        std::array::from_fn(|b| if b == 255 { f32::INFINITY } else { linear((b as f64 + 0.5) / 255.0) as f32 });
    let mut byte = 0;
    let guess = (0..GUESSES).map(|step| {
        while step as f32 / GUESSES as f32 >= above[byte] {
            byte += 1;
        }
        byte as u8
    });
    let guess = guess.collect();
    Tables { light, above, guess }
});

impl Tables {
    fn byte(&self, light: f32) -> u8 {
        // NaN is black: `clamp` would keep it.
        let x = if light > 0.0 { light.min(1.0) } else { 0.0 };
        let mut byte = self.guess[((x * GUESSES as f32) as usize).min(GUESSES - 1)];
        while x >= self.above[usize::from(byte)] {
            byte += 1;
        }
        byte
    }
}

/// Linear light of an sRGB value in 0..=1.
fn linear(s: f64) -> f64 {
    if s <= 0.040_45 {
        return s / 12.92;
    }
    let y = (s + 0.055) / 1.055;
    let square = y * y;
    // Fifth root: from 1 it falls to the root and stays.
    let root = (0..60).fold(1.0f64, |r, _| (4.0 * r + square / (r * r * r * r)) / 5.0);
    square * root
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_returns() {
        for byte in 0..=255 {
            let color = Color([byte; 3]);
            assert_eq!(encode(color.light()), color);
        }
    }

    #[test]
    fn the_curve_is_srgb() {
        for i in 0..=1000 {
            let s = f64::from(i) / 1000.0;
            let want = if s <= 0.04045 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) };
            assert!((linear(s) - want).abs() < 1e-12, "{s}");
        }
        assert_eq!(encode([0.5; 3]), Color([188; 3]));
    }

    #[test]
    fn what_is_out_of_range_is_clipped() {
        assert_eq!(encode([-1.0, f32::NAN, 7.0]), Color([0, 0, 255]));
        assert_eq!(encode([f32::NEG_INFINITY, f32::INFINITY, 1.0]), Color([0, 255, 255]));
    }
}
