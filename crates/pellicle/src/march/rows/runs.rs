//! Signs as runs of equal words: memory that follows the surface, for lattices that nobody holds.
//!
//! ```text
//! words    the signs of row after row, a word for each run
//! ends     the word after each run, counted from the first row's
//! ```
//!
//! Away from the surface words repeat, through rows that lie inside or outside as a whole; so there are about two runs
//! for each word that is crossed.
//!
//! Source: this project.

use super::classify::Signs;

/// The signs of some rows for one isovalue.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Runs {
    words: Vec<u64>,
    ends: Vec<u32>,
}

impl Runs {
    /// Those of the first `rows` rows, which must have fewer than 2³² words.
    pub(crate) fn of(signs: &Signs, rows: usize, iso: usize) -> Self {
        let (mut runs, mut at) = (Self::default(), 0);
        for row in 0..rows {
            for &word in signs.row(row, iso) {
                at += 1;
                match (runs.words.last(), runs.ends.last_mut()) {
                    (Some(&last), Some(end)) if last == word => *end = at,
                    _ => {
                        runs.words.push(word);
                        runs.ends.push(at);
                    }
                }
            }
        }
        runs.words.shrink_to_fit();
        runs.ends.shrink_to_fit();
        runs
    }

    /// The signs again, of rows of so many words.
    pub(crate) fn signs(&self, words: usize) -> Signs {
        let mut bits = Vec::with_capacity(self.ends.last().map_or(0, |&end| end as usize));
        for (&word, &end) in self.words.iter().zip(&self.ends) {
            bits.resize(end as usize, word);
        }
        Signs::of_bits(words, bits)
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        (self.words.len() * 12) as u64
    }
}
