//! Eighths of bricks: 2×2×2 nodes, the least that is asked for and filled.
//!
//! The 64 eighths of an octet are a set like the 64 nodes of a brick: bit i + 4j + 16k is eighth (i, j, k). A brick's own eight are a
//! byte, x lowest bit, as an octet's bricks are.
//!
//! Source: this project.

use super::{brick_origin, node_offset};
use crate::lookup::gather::Box3;

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

/// One eighth of one brick, in the octet's set.
#[inline(always)]
pub(crate) fn bit(brick: usize, eighth: usize) -> u64 {
    1 << (2 * spread(brick) + spread(eighth))
}

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
                assert_eq!(bricks_with(1 << bit), 1 << brick);
            }
            assert_eq!(OF[brick].count_ones(), 8);
            for node in 0..8 {
                for eighth in 0..8 {
                    let own = 1 << (2 * spread(eighth) + spread(node));
                    assert_eq!(with_node(own, node, brick), bit(brick, eighth));
                    assert_eq!(with_node(!own, node, brick), OF[brick] & !bit(brick, eighth));
                }
            }
        }
        assert_eq!(of_bricks(0xff), u64::MAX);
    }
}
