//! Values of bricks that are filled round by round.
//!
//! Each round has memory of its own, so that values stay where they are when more are added: growing one vector would move them all.
//!
//! Source: this project.

use crate::{fill::Values, math::memory::zeros};

/// Values by slot, counted over all rounds. Reusable: [`clear`](Self::clear) keeps the memory.
#[derive(Default)]
pub(crate) struct Rounds {
    /// The slot behind each round's last.
    ends: Vec<usize>,
    /// Of each round, those that are out of use included.
    values: Vec<Vec<Values>>,
}

impl Rounds {
    /// Forgets all values.
    pub(crate) fn clear(&mut self) {
        self.ends.clear();
    }

    /// Begins a round of so many slots. Their values are anything.
    pub(crate) fn add(&mut self, slots: usize) {
        let round = self.ends.len();
        if self.values.len() == round {
            self.values.push(zeros(slots));
        } else if self.values[round].len() < slots {
            // Of a series of frames, this one is larger: the next may be, too.
            self.values[round] = Vec::new();
            self.values[round] = zeros(slots + slots / 8);
        }
        self.ends.push(self.slots() + slots);
    }

    /// The values of the last round.
    pub(crate) fn last(&mut self) -> &mut [Values] {
        let Some(round) = self.ends.len().checked_sub(1) else { return &mut [] };
        let slots = self.ends[round] - self.start(round);
        &mut self.values[round][..slots]
    }

    #[inline(always)]
    pub(crate) fn get(&self, slot: usize) -> &Values {
        // Most are of the first.
        let round = self.ends.iter().position(|&end| slot < end).unwrap_or(self.ends.len());
        &self.values[round][slot - self.start(round)]
    }

    /// Copies the values of a slot to one of the last round.
    pub(crate) fn copy(&mut self, from: usize, to: usize) {
        let values = *self.get(from);
        let first = self.start(self.ends.len() - 1);
        self.last()[to - first] = values;
    }

    #[inline(always)]
    fn start(&self, round: usize) -> usize {
        if round == 0 { 0 } else { self.ends[round - 1] }
    }

    fn slots(&self) -> usize {
        self.ends.last().copied().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_stay_as_rounds_are_added_and_memory_is_used_again() {
        let mut rounds = Rounds::default();
        for frame in 1..4 {
            rounds.clear();
            let (mut first, lens) = (0, [5 * frame, 0, 3, 2]);
            for (round, len) in lens.into_iter().enumerate() {
                rounds.add(len);
                for (i, values) in rounds.last().iter_mut().enumerate() {
                    *values = [(100 * frame + first + i) as f32; 64];
                }
                first += len;
                assert_eq!(rounds.last().len(), len, "round {round}");
            }
            for slot in 0..first {
                assert_eq!(rounds.get(slot)[63], (100 * frame + slot) as f32);
            }
            rounds.copy(2, first - 1);
            assert_eq!(
                (rounds.get(first - 1)[0], rounds.get(first - 2)[0]),
                ((100 * frame + 2) as f32, (100 * frame + first - 2) as f32)
            );
        }
    }
}
