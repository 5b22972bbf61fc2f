//! Color bars: which color is which value, with round numbers beside it and the name above.

use crate::color::{Color, encode};
use crate::image::Image;
use crate::ramp::ramp;
use crate::stage::Shown;
use crate::text::Font;

/// Draws the bars at the right border, the first one outermost. What does not fit is left out.
pub(crate) fn draw(image: &mut Image, all: &[Shown<'_>]) {
    let font = Font::for_height(image.height());
    let line = i64::from(font.height());
    let mut right = i64::from(image.width()) - line;
    for shown in all {
        let tall = i64::from(image.height()) * 55 / 100;
        let most = (tall / (2 * line)).clamp(2, 9) as usize;
        let ticks = ticks(shown.range, most);
        let widest = ticks.iter().map(|tick| i64::from(font.width_of(&tick.label))).max().unwrap_or(0);
        let bar = line * 4 / 5;
        let gap = line / 3;
        let width = (bar + gap + widest).max(i64::from(font.width_of(shown.name)));
        let left = right - width;
        if tall < 4 * line || left < i64::from(image.width()) / 2 {
            return;
        }
        let top = (i64::from(image.height()) - tall) / 2 + line / 2;
        let ink = image.ink(left, top - 2 * line, width as u32, font.height());
        font.write(image, left, top - line * 8 / 5, shown.name, ink);
        paint(image, left, top, bar, tall);
        for tick in &ticks {
            let y = top + tall - 1 - (tick.place * (tall - 1) as f64 + 0.5) as i64;
            image.fill(left + bar, y, gap * 2 / 3, (line / 16).max(1), ink);
            font.write(image, left + bar + gap, y - line / 2, &tick.label, ink);
        }
        right = left - line;
    }
}

/// The bar with a thin frame.
fn paint(image: &mut Image, left: i64, top: i64, width: i64, height: i64) {
    image.fill(left - 1, top - 1, width + 2, height + 2, Color([120, 126, 134]));
    for row in 0..height {
        let value = 1.0 - row as f32 / (height - 1).max(1) as f32;
        image.fill(left, top + row, width, 1, encode(ramp(value)));
    }
}

/// A round number within the range.
#[derive(Debug, PartialEq)]
struct Tick {
    /// 0 at the low end, 1 at the high end.
    place: f64,
    label: String,
}

/// At most `most` round numbers, by steps of 1, 2 or 5 times a power of ten: the smallest such step that is not too many.
fn ticks([low, high]: [f64; 2], most: usize) -> Vec<Tick> {
    let span = high - low;
    let count = |step: f64| ((high / step).floor() - (low / step).ceil() + 1.0).max(0.0);
    let mut found = None;
    // From a hundredth of the span up; powers of ten from the parser, which rounds them right.
    'search: for power in exponent(span) - 2..=exponent(span) + 1 {
        for digit in [1.0, 2.0, 5.0] {
            let step = digit * ten_to(power);
            if step > 0.0 && count(step) <= most as f64 {
                found = Some((step, power));
                break 'search;
            }
        }
    }
    let Some((step, power)) = found else { return Vec::new() };
    let (first, count) = ((low / step).ceil(), count(step) as usize);
    let values = (0..count).map(|i| (first + i as f64) * step);
    let largest = exponent(low.abs().max(high.abs()));
    let label = |value: f64| {
        // Minus zero is zero.
        let value = if value.abs() < step / 2.0 { 0.0 } else { value };
        if (-4..6).contains(&largest) && power >= -6 {
            format!("{value:.0$}", usize::try_from(-power).unwrap_or(0))
        } else if value == 0.0 {
            "0".into()
        } else {
            let digits = usize::try_from(exponent(value.abs()) - power).unwrap_or(0);
            format!("{value:.digits$e}")
        }
    };
    values.map(|value| Tick { place: ((value - low) / span).clamp(0.0, 1.0), label: label(value) }).collect()
}

/// 10 to an integer power.
fn ten_to(power: i32) -> f64 {
    format!("1e{power}").parse().unwrap_or(0.0)
}

/// Of the leading digit, as written; 0 for 0.
fn exponent(x: f64) -> i32 {
    format!("{x:e}").rsplit('e').next().and_then(|e| e.parse().ok()).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(range: [f64; 2], most: usize) -> Vec<String> {
        ticks(range, most).into_iter().map(|tick| tick.label).collect()
    }

    #[test]
    fn numbers_are_round() {
        assert_eq!(labels([0.0, 1.0], 6), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels([-1.3, 2.7], 9), ["-1.0", "-0.5", "0.0", "0.5", "1.0", "1.5", "2.0", "2.5"]);
        assert_eq!(labels([3.0, 47.0], 5), ["10", "20", "30", "40"]);
        assert_eq!(labels([0.0, 3e-7], 4), ["0", "1e-7", "2e-7", "3e-7"]);
        assert_eq!(labels([0.0, 2.5e8], 3), ["0", "1e8", "2e8"]);
        assert_eq!(labels([998.2, 1003.9], 6), ["999", "1000", "1001", "1002", "1003"]);
    }

    #[test]
    fn places_are_those_of_the_values() {
        let ticks = ticks([0.0, 4.0], 5);
        assert_eq!(ticks.iter().map(|tick| tick.place).collect::<Vec<_>>(), [0.0, 0.25, 0.5, 0.75, 1.0]);
    }

    #[test]
    fn extremes_have_an_answer() {
        for range in [[-3.4e38, 3.4e38], [0.0, 1e-45], [1e30, 1.0000001e30], [5.0, 5.0000005]] {
            for most in 2..9 {
                assert!(ticks(range, most).len() <= most, "{range:?}");
            }
        }
    }
}
