//! `--frames`: which frames of a sequence. `7`, `1-100`, `1-100:5` (every fifth), `1-10,20,30-40:2`, `-5--1`.

use std::fmt;

/// More frames are a typing error.
const MAX_FRAMES: i128 = 1_000_000;

const FORM: &str = "write frames such as 1-100, 1-100:5 for every fifth, or 1-10,20";

/// A set of frame numbers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FrameRange {
    text: String,
    /// Ascending, each once; never empty.
    numbers: Vec<i64>,
}

impl FrameRange {
    /// Reads a list of numbers and ranges, whose last number belongs to them. Order and repeats do not matter.
    ///
    /// # Errors
    /// What is no range, a first frame above the last, a step below 1, more than a million frames.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut numbers = Vec::new();
        let mut count = 0;
        for item in text.split(',').map(str::trim) {
            let (first, last, step) = span(item)?;
            if first > last {
                return Err(format!("{item}: the first frame comes after the last: write {last}-{first}"));
            }
            count += (i128::from(last) - i128::from(first)) / i128::from(step) + 1;
            if count > MAX_FRAMES {
                return Err(format!("more than {MAX_FRAMES} frames"));
            }
            // The last step may lead beyond the largest integer.
            numbers.extend(std::iter::successors(Some(first), |n| n.checked_add(step).filter(|n| *n <= last)));
        }
        numbers.sort_unstable();
        numbers.dedup();
        Ok(Self { text: text.trim().to_owned(), numbers })
    }

    /// The numbers, ascending.
    pub fn numbers(&self) -> &[i64] {
        &self.numbers
    }

    /// Whether a frame is one of them.
    pub fn contains(&self, number: i64) -> bool {
        self.numbers.binary_search(&number).is_ok()
    }
}

impl fmt::Display for FrameRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// `first-last:step`, of which only `first` must be there.
fn span(item: &str) -> Result<(i64, i64, i64), String> {
    let wrong = || format!("'{item}' is no range of frames: {FORM}");
    let number = |text: &str| text.trim().parse::<i64>().map_err(|_| wrong());
    let (range, step) = match item.split_once(':') {
        Some((range, step)) => (range.trim(), number(step)?),
        None => (item, 1),
    };
    if step < 1 {
        return Err(format!("'{item}': a step is 1 or more"));
    }
    // The first character may be a minus; the next one separates.
    let at = range.char_indices().skip(1).find(|(_, c)| *c == '-').map(|(at, _)| at);
    let (first, last) = match at {
        Some(at) => (number(&range[..at])?, number(&range[at + 1..])?),
        None if step > 1 => return Err(format!("'{item}': a step needs a range before it, such as 1-100:{step}")),
        None => (number(range)?, number(range)?),
    };
    Ok((first, last, step))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_hold_their_last_number() {
        for (text, numbers) in [
            ("7", &[7][..]),
            ("-7", &[-7]),
            ("1-3", &[1, 2, 3]),
            ("1-10:4", &[1, 5, 9]),
            ("0-10:5", &[0, 5, 10]),
            ("-5--3", &[-5, -4, -3]),
            ("-1-1", &[-1, 0, 1]),
            (" 8 , 1 - 2 ,30-34:2", &[1, 2, 8, 30, 32, 34]),
            ("3,1-4,2", &[1, 2, 3, 4]),
            ("0001-0002", &[1, 2]),
            ("9223372036854775800-9223372036854775807:5", &[i64::MAX - 7, i64::MAX - 2]),
        ] {
            assert_eq!(FrameRange::parse(text).as_ref().map(FrameRange::numbers), Ok(numbers), "{text}");
        }
        let range = FrameRange::parse("1-100:5 ").unwrap();
        assert!(range.contains(96) && !range.contains(97) && !range.contains(101));
        assert_eq!(range.to_string(), "1-100:5");
    }

    #[test]
    fn what_is_no_range_is_refused_with_the_form() {
        for (text, hint) in [
            ("", "no range"),
            ("a", "'a' is no range"),
            ("1-", "'1-' is no range"),
            ("1-2-3", "no range"),
            ("1..3", "1-100"),
            ("1,,3", "'' is no range"),
            ("1-10:", "no range"),
            ("1-10:0", "1 or more"),
            ("1-10:-2", "1 or more"),
            ("5:2", "needs a range"),
            ("9-1", "write 1-9"),
            ("1.5", "no range"),
            ("99999999999999999999", "no range"),
            ("0-1000000000000000000", "more than 1000000 frames"),
            ("-9223372036854775808-9223372036854775807", "more than 1000000 frames"),
        ] {
            let message = FrameRange::parse(text).expect_err(text);
            assert!(message.contains(hint), "{text}: {message}");
        }
        assert_eq!(FrameRange::parse("1-1000000").map(|r| r.numbers().len()), Ok(1_000_000));
    }
}
