//! Eighths of bricks: 2×2×2 nodes, the least that is asked for and filled.
//!
//! The 64 eighths of an octet are a set like the 64 nodes of a brick: bit i + 4j + 16k is eighth (i, j, k). A brick's own eight are a
//! byte, x lowest bit, as an octet's bricks are. So are an eighth's nodes.
//!
//! Source: this project.

use super::{Values, brick_origin, node_offset};
use crate::{lookup::gather::Box3, math::bits::ones};

/// Values of an eighth's nodes, x fastest.
pub(crate) type Eight = [f32; 8];

/// Position of eighth (or node) `index` of 8 among the 64 of a block of 4×4×4, counted from the block's corner.
const fn spread(index: usize) -> usize {
    (index & 1) | (index >> 1 & 1) << 2 | (index >> 2) << 4
}

/// The nodes of each eighth, in its brick's set; as well the eighths of each brick, in its octet's.
pub(crate) const OF: [u64; 8] = {
    let mut table = [0; 8];
    let mut i = 0;
    while i < 64 {
        table[i / 8] |= 1 << (2 * spread(i / 8) + spread(i % 8));
        i += 1;
    }
    table
};

/// The eighths of some of an octet's bricks.
#[inline(always)]
pub(crate) fn of_bricks(bricks: u8) -> u64 {
    let mut set = 0;
    for brick in 0..8 {
        set |= if bricks >> brick & 1 != 0 { OF[brick] } else { 0 };
    }
    set
}

/// Bricks that have one of these eighths.
#[inline(always)]
pub(crate) fn bricks_with(eighths: u64) -> u8 {
    let mut bricks = 0;
    for brick in 0..8 {
        bricks |= u8::from(eighths & OF[brick] != 0) << brick;
    }
    bricks
}

/// Those of an octet's eighths that are the brick's.
#[inline(always)]
pub(crate) fn of_brick(eighths: u64, brick: usize) -> u8 {
    let own = eighths >> (2 * spread(brick));
    (own & 3 | own >> 2 & 0xc | own >> 12 & 0x30 | own >> 14 & 0xc0) as u8
}

/// The other way round: eighths of a brick, in its octet's set.
#[inline(always)]
pub(crate) fn in_octet(eighths: u8, brick: usize) -> u64 {
    deposit(eighths, brick)
}

/// The nodes of some of a brick's eighths.
#[inline(always)]
pub(crate) fn nodes(eighths: u8) -> u64 {
    of_bricks(eighths)
}

/// The eighths of a brick, in its octet's set, whose node `node` of 8 is in a set of the brick's nodes.
#[inline(always)]
pub(crate) fn with_node(nodes: u64, node: usize, brick: usize) -> u64 {
    // Every other bit along each axis: they are moved together along x, then y, then z.
    let every_other = nodes >> spread(node) & 0x0000_0505_0000_0505;
    let x = (every_other | every_other >> 1) & 0x0000_0303_0000_0303;
    let xy = (x | x >> 4) & 0x0000_0033_0000_0033;
    ((xy | xy >> 16) & 0x0033_0033) << (2 * spread(brick))
}

/// The nodes of an eighth that a byte says, in its brick's set.
#[inline(always)]
pub(crate) fn deposit(nodes: u8, eighth: usize) -> u64 {
    let n = u64::from(nodes);
    (n & 3 | (n & 0xc) << 2 | (n & 0x30) << 12 | (n & 0xc0) << 14) << (2 * spread(eighth))
}

/// For each node of a brick: its eighth (bits 3..), and its number there.
const PLACES: [u8; 64] = {
    let mut table = [0; 64];
    let mut i = 0;
    while i < 64 {
        table[2 * spread(i / 8) + spread(i % 8)] = i as u8;
        i += 1;
    }
    table
};

/// Values of those eighths of a brick that are known, one behind the other.
#[derive(Clone, Copy)]
pub(crate) struct Known<'a> {
    pub(crate) eighths: u8,
    pub(crate) values: &'a [Eight],
}

impl Known<'_> {
    /// The value of a node, whose eighth is known.
    #[inline(always)]
    pub(crate) fn at(&self, node: usize) -> f32 {
        let place = usize::from(PLACES[node]);
        self.values[rank(self.eighths, place >> 3)][place & 7]
    }

    /// Values of the brick's nodes, x fastest; 0 where none is known.
    #[inline(always)]
    pub(crate) fn all(&self) -> Values {
        let mut all = [0.0; 64];
        for (eighth, values) in ones(self.eighths.into()).zip(self.values) {
            let corner = 2 * spread(eighth);
            for row in 0..4 {
                let at = corner + 4 * (row & 1) + 16 * (row >> 1);
                all[at..at + 2].copy_from_slice(&values[2 * row..2 * row + 2]);
            }
        }
        all
    }
}

/// How many of a set of eighths come before one.
#[inline(always)]
pub(crate) fn rank(eighths: u8, eighth: usize) -> usize {
    (eighths & ((1 << eighth) - 1)).count_ones() as usize
}

/// The values of a brick's nodes, x fastest, by eighth.
#[inline(always)]
pub(crate) fn split(values: &Values, to: &mut [Eight]) {
    for (eighth, to) in to.iter_mut().enumerate() {
        let corner = 2 * spread(eighth);
        for row in 0..4 {
            let at = corner + 4 * (row & 1) + 16 * (row >> 1);
            to[2 * row..2 * row + 2].copy_from_slice(&values[at..at + 2]);
        }
    }
}

/// First node of an eighth of a brick, along each axis, from the octet's corner.
#[inline(always)]
pub(crate) fn origin(brick: usize, eighth: usize) -> [i32; 3] {
    let mut first = brick_origin(brick);
    for a in 0..3 {
        first[a] += 2 * (eighth >> a & 1) as i32;
    }
    first
}

/// The box of an eighth's nodes, in its octet's frame.
#[inline(always)]
pub(crate) fn place(brick: usize, eighth: usize, step: f64) -> Box3 {
    let first = origin(brick, eighth);
    let (mut low, mut high) = ([0.0; 3], [0.0; 3]);
    for a in 0..3 {
        (low[a], high[a]) = (node_offset(first[a], step), node_offset(first[a] + 1, step));
    }
    Box3 { low, high }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eighths_of_bricks_are_blocks_of_eight() {
        for brick in 0..8 {
            for eighth in 0..8 {
                let first = origin(brick, eighth).map(|n| n as usize / 2);
                let bit = first[0] + 4 * first[1] + 16 * first[2];
                assert_eq!(OF[brick] >> bit & 1, 1);
                assert_eq!(of_brick(1 << bit, brick), 1 << eighth);
                assert_eq!(in_octet(1 << eighth, brick), 1 << bit);
                assert_eq!(bricks_with(1 << bit), 1 << brick);
            }
            assert_eq!(OF[brick].count_ones(), 8);
            for node in 0..8 {
                for eighth in 0..8 {
                    let own = 1 << (2 * spread(eighth) + spread(node));
                    assert_eq!(with_node(own, node, brick), in_octet(1 << eighth, brick));
                    assert_eq!(with_node(!own, node, brick), OF[brick] & !in_octet(1 << eighth, brick));
                }
            }
        }
        assert_eq!(of_bricks(0xff), u64::MAX);
    }

    #[test]
    fn values_by_eighth_are_those_of_the_brick() {
        let brick: Values = std::array::from_fn(|node| node as f32);
        let mut by_eighth = [[0.0; 8]; 8];
        split(&brick, &mut by_eighth);
        for eighth in 0..8 {
            for n in 0..8 {
                let node = by_eighth[eighth][n] as usize;
                assert_eq!(deposit(1 << n, eighth), 1 << node);
                assert_eq!(OF[eighth] >> node & 1, 1);
            }
        }
        for eighths in 0..=u8::MAX {
            let values: Vec<Eight> = ones(eighths.into()).map(|eighth| by_eighth[eighth]).collect();
            let known = Known { eighths, values: &values };
            let all = known.all();
            for node in 0..64 {
                if nodes(eighths) >> node & 1 != 0 {
                    assert_eq!([known.at(node), all[node]], [node as f32; 2]);
                } else {
                    assert_eq!(all[node], 0.0);
                }
            }
        }
    }
}
