//! From integer coordinates to a dense index, sparse and local.
//!
//! ```text
//! hash map    block of 8×8×8 coordinates ──► page          one look-up for a whole neighbourhood
//! pages       page, place in the block ──► index           2 KiB each, only where something is
//! ```
//!
//! Who looks up neighbours keeps a [`Cursor`], which remembers the last block, so that most look-ups are one load. Only
//! looked up, never iterated: the hash map's order cannot reach a result.
//!
//! Source: this project; two levels, as in the sparse block grids of Bridson 2003.

use std::collections::hash_map::Entry;

use rustc_hash::FxHashMap;

use crate::lattice::Coord;

/// Coordinates of a block along an axis, as a shift.
const BLOCK: u32 = 3;
/// Half of that.
const HALF: i32 = 1 << (BLOCK - 1);
/// Index of nothing.
const NONE: u32 = u32::MAX;

/// A sparse map from coordinates to indices.
#[derive(Default)]
pub(crate) struct Directory {
    blocks: FxHashMap<Coord, u32>,
    pages: Vec<[u32; 1 << (3 * BLOCK)]>,
    used: usize,
}

/// The last block that was looked up, and its page, if there is one.
#[derive(Clone, Copy)]
pub(crate) struct Cursor {
    block: Coord,
    page: u32,
}

impl Default for Cursor {
    fn default() -> Self {
        // No coordinate's block: the shift keeps them far from the smallest integer.
        Self { block: [i32::MIN; 3], page: NONE }
    }
}

#[inline(always)]
fn split(at: Coord) -> (Coord, usize) {
    const LOW: i32 = (1 << BLOCK) - 1;
    // Half a block further, so that what lies around the origin is in one block, not in eight.
    let at = [at[0] + HALF, at[1] + HALF, at[2] + HALF];
    let place = (at[0] & LOW) | (at[1] & LOW) << BLOCK | (at[2] & LOW) << (2 * BLOCK);
    (at.map(|v| v >> BLOCK), place as usize)
}

impl Directory {
    /// Forgets everything, keeping the memory.
    pub(crate) fn clear(&mut self) {
        self.blocks.clear();
        self.used = 0;
    }

    /// The index at these coordinates.
    #[inline(always)]
    pub(crate) fn get(&self, cursor: &mut Cursor, at: Coord) -> Option<u32> {
        let (block, place) = split(at);
        if block != cursor.block {
            *cursor = Cursor { block, page: self.blocks.get(&block).copied().unwrap_or(NONE) };
        }
        let index = self.pages.get(cursor.page as usize)?[place];
        (index != NONE).then_some(index)
    }

    /// Place for the index at these coordinates: `u32::MAX` until it is set.
    #[inline(always)]
    pub(crate) fn entry(&mut self, cursor: &mut Cursor, at: Coord) -> &mut u32 {
        let (block, place) = split(at);
        if block != cursor.block || cursor.page == NONE {
            *cursor = Cursor { block, page: self.page(block) };
        }
        &mut self.pages[cursor.page as usize][place]
    }

    /// The page of a block, new and empty if need be.
    fn page(&mut self, block: Coord) -> u32 {
        match self.blocks.entry(block) {
            Entry::Occupied(page) => *page.get(),
            Entry::Vacant(vacant) => {
                let page = self.used;
                self.used += 1;
                match self.pages.get_mut(page) {
                    Some(left_over) => left_over.fill(NONE),
                    None => self.pages.push([NONE; 1 << (3 * BLOCK)]),
                }
                *vacant.insert(page as u32)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_set_is_found_and_cleared_pages_are_empty() {
        let mut directory = Directory::default();
        let at = |i: i32| [i * 7 % 50 - 25, i * 13 % 40 - 20, i - 500];
        for round in 0..2u32 {
            directory.clear();
            let mut cursor = Cursor::default();
            for i in (0..1000).filter(|i| i % 2 == 0 || round == 0) {
                *directory.entry(&mut cursor, at(i)) = i as u32 + round;
            }
            let mut cursor = Cursor::default();
            for i in 0..1000 {
                let want = (i % 2 == 0 || round == 0).then_some(i as u32 + round);
                assert_eq!(directory.get(&mut cursor, at(i)), want, "{i}");
            }
            assert_eq!(directory.get(&mut cursor, [1000, 0, 0]), None);
        }
    }
}
