//! `--shard k/n`: one of n parts of a sequence, so that n machines share the work without talking.
//!
//! Parts are interleaved: part k has the frames k, k + n, k + 2n, … counted from 1 in the sequence's order. Later frames
//! often take longer, as a fluid splashes, and so each part gets its share of them. The parts cover all frames and none
//! twice, as long as all machines see the same files.

use std::fmt;
use std::str::FromStr;

/// More parts than any cluster has machines.
const MAX_PARTS: usize = 1_000_000;

/// Part `part` of `parts`, counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    part: usize,
    parts: usize,
}

impl Shard {
    /// The items of this part, in their order.
    pub fn take<T>(&self, items: Vec<T>) -> Vec<T> {
        items.into_iter().skip(self.part - 1).step_by(self.parts).collect()
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("'{text}' is no part: write k/n, such as 1/4 for the first of four");
        let (part, parts) = text.split_once('/').ok_or_else(wrong)?;
        let number = |text: &str| text.trim().parse::<usize>().map_err(|_| wrong());
        let (part, parts) = (number(part)?, number(parts)?);
        if parts > MAX_PARTS {
            return Err(format!("{parts} parts, at most {MAX_PARTS} are possible"));
        }
        if !(1..=parts).contains(&part) {
            return Err(format!("part {part} of {parts}: parts are counted from 1 to {parts}"));
        }
        Ok(Self { part, parts })
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.part, self.parts)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_cover_everything_once_and_evenly() {
        for parts in 1..=7 {
            let mut all = Vec::new();
            for part in 1..=parts {
                let shard: Shard = format!("{part}/{parts}").parse().unwrap();
                let taken = shard.take((0..17).collect());
                assert!((17 / parts..=17usize.div_ceil(parts)).contains(&taken.len()));
                all.extend(taken);
            }
            all.sort_unstable();
            assert!(all.iter().copied().eq(0..17));
        }
        assert_eq!("2/3".parse::<Shard>().unwrap().take(vec![0, 1, 2, 3, 4, 5, 6, 7]), [1, 4, 7]);
        assert_eq!(" 2 / 3 ".parse::<Shard>().unwrap().to_string(), "2/3");
    }

    #[test]
    fn what_is_no_part_is_refused() {
        for text in ["", "3", "0/4", "5/4", "1/0", "-1/4", "a/b", "1/4/2", "1.5/4", "1/99999999"] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
    }
}
