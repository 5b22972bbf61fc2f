//! Values of eighths of bricks, in chunks of memory that many tasks add to at once.
//!
//! How many eighths are filled is known only when they are, so that no task can be given a place before. Each takes a [`Chunk`] that no
//! other one has, or a new one, adds to it and gives it back. Values stay where they are when more are added.
//!
//! Source: this project.

use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::{fill::eighths::Eight, math::memory::filled};

/// Chunks that a thread fills where all that is asked for is filled: what the last of them leaves unused is a share of that, but large
/// ones are cheaper to come by.
const CHUNKS: usize = 4;
/// As many where nobody knows how much of it will be.
const CHUNKS_OF_SOME: usize = 16;
/// Eighths of the smallest chunk.
const LEAST: usize = 512;

/// Values by [`Place`]. Reusable: [`clear`](Self::clear) keeps the memory.
#[derive(Default)]
pub(crate) struct Values {
    chunks: Vec<Vec<Eight>>,
    spare: Vec<Vec<Eight>>,
}

/// Where values are.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Place {
    chunk: u32,
    first: u32,
}

/// What is added to in one round.
pub(crate) struct Round {
    /// Eighths of a new chunk.
    size: usize,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    spare: Vec<Vec<Eight>>,
    /// Those with room, as far as is known.
    open: Vec<Chunk>,
    full: Vec<Chunk>,
    next: u32,
    /// The most eighths that tasks to come may add.
    left: usize,
}

/// Memory of one task.
pub(crate) struct Chunk {
    number: u32,
    used: usize,
    values: Vec<Eight>,
}

impl Values {
    /// Forgets all values.
    pub(crate) fn clear(&mut self) {
        self.spare.append(&mut self.chunks);
    }

    /// The first `count` values at a place.
    #[inline(always)]
    pub(crate) fn get(&self, place: Place, count: usize) -> &[Eight] {
        &self.chunks[place.chunk as usize][place.first as usize..][..count]
    }

    /// Begins a round of so many eighths, or at most so many.
    pub(crate) fn begin(&mut self, most: usize, all: bool) -> Round {
        let chunks = if all { CHUNKS } else { CHUNKS_OF_SOME };
        let size = most.div_ceil(chunks * rayon::current_num_threads()).max(LEAST);
        let mut spare = std::mem::take(&mut self.spare);
        // The largest are taken first: one too small for a task leaves none behind it that is not.
        spare.sort_unstable_by_key(Vec::len);
        let state = State { spare, next: self.chunks.len() as u32, left: most, ..State::default() };
        Round { size, state: Mutex::new(state) }
    }

    /// Takes what a round added.
    pub(crate) fn end(&mut self, round: Round) {
        let State { spare, open, mut full, .. } = round.state.into_inner().unwrap_or_else(PoisonError::into_inner);
        self.spare = spare;
        full.extend(open);
        full.sort_unstable_by_key(|chunk| chunk.number);
        self.chunks.extend(full.into_iter().map(|chunk| chunk.values));
    }
}

impl Round {
    /// A chunk with room for so many eighths.
    pub(crate) fn open(&self, most: usize) -> Chunk {
        let mut state = self.lock();
        let size = self.size.min(state.left).max(most);
        state.left = state.left.saturating_sub(most);
        while let Some(chunk) = state.open.pop() {
            if chunk.values.len() - chunk.used >= most {
                return chunk;
            }
            state.full.push(chunk);
        }
        let number = state.next;
        state.next += 1;
        let spare = state.spare.pop_if(|spare| spare.len() >= most);
        drop(state);
        Chunk { number, used: 0, values: spare.unwrap_or_else(|| filled([0.0; 8], size)) }
    }

    /// Gives it back.
    pub(crate) fn close(&self, chunk: Chunk) {
        self.lock().open.push(chunk);
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Chunk {
    /// Adds values, for which there must be room.
    #[inline(always)]
    pub(crate) fn add(&mut self, values: &[Eight]) -> Place {
        let first = self.used;
        self.used += values.len();
        self.values[first..self.used].copy_from_slice(values);
        Place { chunk: self.number, first: first as u32 }
    }
}

#[cfg(test)]
mod tests {
    use rayon::prelude::*;

    use super::*;

    #[test]
    fn values_of_many_tasks_and_rounds_stay_and_memory_is_used_again() {
        /// The most that a task adds.
        const MOST: usize = 300;
        let value = |round: usize, task: usize, i: usize| [(round * 100_000 + task * MOST + i) as f32; 8];
        let count = |task: usize| task * 37 % (MOST + 1);
        let mut values = Values::default();
        let mut lens = Vec::new();
        for frame in 0..4 {
            values.clear();
            let mut places = Vec::new();
            for (round, tasks) in [200, 0, 1, 40].into_iter().enumerate() {
                let adding = values.begin((0..tasks).map(count).sum(), round % 2 == 0);
                let add = |task: usize| {
                    let mut chunk = adding.open(count(task));
                    let own: Vec<Eight> = (0..count(task)).map(|i| value(round, task, i)).collect();
                    let place = chunk.add(&own);
                    adding.close(chunk);
                    (round, task, place)
                };
                let added: Vec<_> = (0..tasks).into_par_iter().map(add).collect();
                values.end(adding);
                places.extend(added);
            }
            for &(round, task, place) in &places {
                let want: Vec<Eight> = (0..count(task)).map(|i| value(round, task, i)).collect();
                assert_eq!(values.get(place, count(task)), want, "task {task} of round {round} in frame {frame}");
            }
            lens.push(values.chunks.iter().chain(&values.spare).map(Vec::len).sum::<usize>());
        }
        assert!(lens[3] * 2 < lens[0] * 3, "{lens:?}");
    }
}
