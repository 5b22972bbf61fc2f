//! A cell size for each block: where the surface is fine and where it is coarse.
//!
//! A *block* is a cube of the world, the same for all levels. At level L its cells are 2^L cells of the finest lattice wide,
//! so every node of a level is a node of the finest lattice. A block is *listed* or absent; two blocks are neighbours if
//! they share a face, an edge or a corner, hence 26.
//!
//! The caller wishes a level for each block. Levels are *balanced*: those of neighbours differ by one at most, and never
//! exceed the wish. So two levels at most meet in a point, and what lies around a face, edge or corner of a block is known
//! from its neighbours' levels alone.
//!
//! A block may be listed and *hidden*: left out by the caller. It has a level, to which those around it are balanced, and
//! their nodes lie as they would if it were there, but nothing is made in it.
//!
//! Source: 2:1 balance is that of octrees, von Herzen and Barr, Accurate triangulations of deformed, intersecting surfaces,
//! 1987; blocks of one size instead of a tree are this project's.

use crate::lattice::Coord;

/// Neighbours of a block, itself included, by [`offset_index`].
pub(crate) const AROUND: usize = 27;
/// The block itself among them.
pub(crate) const SELF: usize = 13;
/// No block.
pub(crate) const ABSENT: u32 = u32::MAX;

/// Index of an offset in −1..=1 along each axis. A larger index is later along z, then y, then x.
#[inline(always)]
pub(crate) const fn offset_index(d: [i32; 3]) -> usize {
    (d[0] + 1 + 3 * (d[1] + 1) + 9 * (d[2] + 1)) as usize
}

/// The offset of an index.
#[inline(always)]
pub(crate) const fn offset(index: usize) -> [i32; 3] {
    [index as i32 % 3 - 1, index as i32 / 3 % 3 - 1, index as i32 / 9 - 1]
}

/// Listed blocks, their levels and neighbours. Reusable.
#[derive(Default)]
pub(crate) struct Levels {
    pub(crate) at: Vec<Coord>,
    pub(crate) level: Vec<u8>,
    pub(crate) hidden: Vec<bool>,
    /// Indices of the blocks around each, or [`ABSENT`].
    pub(crate) near: Vec<[u32; AROUND]>,
}

impl Levels {
    /// Number of blocks.
    pub(crate) fn len(&self) -> usize {
        self.at.len()
    }

    /// Takes blocks with their neighbours, wishes, at most `coarsest`, and whether they are hidden, and balances.
    pub(crate) fn take(&mut self, blocks: impl IntoIterator<Item = (Coord, [u32; AROUND], u8, bool)>, coarsest: u8) {
        self.at.clear();
        self.near.clear();
        self.level.clear();
        self.hidden.clear();
        for (at, near, wish, hidden) in blocks {
            self.at.push(at);
            self.near.push(near);
            self.level.push(wish.min(coarsest));
            self.hidden.push(hidden);
        }
        self.balance(coarsest);
    }

    /// Lists blocks in this order, each once.
    #[cfg(test)]
    pub(crate) fn list(
        &mut self,
        blocks: impl IntoIterator<Item = Coord>,
        coarsest: u8,
        mut wish: impl FnMut(Coord) -> u8,
    ) {
        let places: Vec<Coord> = blocks.into_iter().collect();
        let index: std::collections::BTreeMap<Coord, u32> = places.iter().copied().zip(0..).collect();
        assert_eq!(index.len(), places.len(), "each block once");
        let near = |at: Coord| {
            std::array::from_fn(|o| index.get(&crate::lattice::plus(at, offset(o))).copied().unwrap_or(ABSENT))
        };
        self.take(places.iter().map(|&at| (at, near(at), wish(at), false)), coarsest);
    }

    /// Lowers levels until neighbours differ by one at most: from the finest level on, so that each block is done once.
    /// The result is the largest that is balanced and not above the wishes, whatever the order.
    fn balance(&mut self, coarsest: u8) {
        for level in 0..coarsest {
            for block in 0..self.len() {
                if self.level[block] == level {
                    for &near in self.near[block].iter().filter(|&&near| near != ABSENT) {
                        let near = &mut self.level[near as usize];
                        *near = (*near).min(level + 1);
                    }
                }
            }
        }
    }

    /// Index of the neighbour at an offset, if it is listed.
    #[inline(always)]
    pub(crate) fn neighbour(&self, block: usize, offset: usize) -> Option<usize> {
        let near = self.near[block][offset];
        (near != ABSENT).then_some(near as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lattice::plus;

    #[test]
    fn levels_are_the_largest_balanced_ones_below_the_wish() {
        let blocks = || (0..9 * 9 * 2).map(|i| [i % 9 - 4, i / 9 % 9 - 4, i / 81 - 1]);
        let wish = |b: Coord| if b == [0, 0, 0] { 0 } else { 3 };
        let mut levels = Levels::default();
        levels.list(blocks(), 3, wish);
        assert_eq!(levels.len(), 9 * 9 * 2);
        for (block, &at) in levels.at.iter().enumerate() {
            // Distance from the fine block in steps to a neighbour, corners included.
            let steps = at.iter().map(|v| v.abs()).max().unwrap_or(0);
            assert_eq!(i32::from(levels.level[block]), steps.min(3), "{at:?}");
            for o in 0..AROUND {
                let found = levels.neighbour(block, o).map(|n| levels.at[n]);
                let want = plus(at, offset(o));
                assert_eq!(found, blocks().any(|b| b == want).then_some(want));
            }
        }
    }

    #[test]
    fn offsets_have_one_index_each() {
        for o in 0..AROUND {
            assert_eq!(offset_index(offset(o)), o);
        }
        assert_eq!(offset(SELF), [0; 3]);
    }
}
