//! Sets of 4×4×4 nodes as one `u64`: bit i + 4j + 16k is node (i, j, k).

/// Position of node (i, j, k), each in 0..4.
#[inline(always)]
pub(crate) const fn node_bit(i: usize, j: usize, k: usize) -> usize {
    i + 4 * j + 16 * k
}

/// The nodes on side `d` (-1: index 0, 1: index 3, 0: all) along each axis.
pub(crate) const fn side_mask(d: [i32; 3]) -> u64 {
    let mut mask = 0;
    let mut n = 0;
    while n < 64 {
        let at = [n & 3, n >> 2 & 3, n >> 4];
        let mut inside = true;
        let mut a = 0;
        while a < 3 {
            inside &= d[a] == 0 || at[a] == if d[a] < 0 { 0 } else { 3 };
            a += 1;
        }
        mask |= (inside as u64) << n;
        n += 1;
    }
    mask
}

/// The set seen one node further along x: bit (i, j, k) of the result is bit (i + 1, j, k) of `here`, taken from `next`,
/// the neighbour in +x, where that lies beyond.
#[inline(always)]
pub(crate) const fn shift_x(here: u64, next: u64) -> u64 {
    const LAST: u64 = side_mask([1, 0, 0]);
    (here >> 1 & !LAST) | (next << 3 & LAST)
}

/// As [`shift_x`], along y.
#[inline(always)]
pub(crate) const fn shift_y(here: u64, next: u64) -> u64 {
    const LAST: u64 = side_mask([0, 1, 0]);
    (here >> 4 & !LAST) | (next << 12 & LAST)
}

/// As [`shift_x`], along z.
#[inline(always)]
pub(crate) const fn shift_z(here: u64, next: u64) -> u64 {
    here >> 16 | next << 48
}

/// The set seen one node further back along `axis` (0, 1, 2): bit n of the result is bit n − 1 along that axis of `here`, taken
/// from `below`, the neighbour there, where that lies beyond.
#[inline(always)]
pub(crate) const fn shift_up(axis: usize, here: u64, below: u64) -> u64 {
    const FIRST: [u64; 3] = [side_mask([-1, 0, 0]), side_mask([0, -1, 0]), side_mask([0, 0, -1])];
    let step = 1 << (2 * axis);
    (here << step & !FIRST[axis]) | (below >> (3 * step) & FIRST[axis])
}

/// The eight corner sets of a brick's 64 cells. `bricks[c]` is the set of the brick at offset (c & 1, c >> 1 & 1, c >> 2);
/// bit n of result `c` is the node at that offset from node n.
#[inline(always)]
pub(crate) fn corner_sets(bricks: &[u64; 8]) -> [u64; 8] {
    let m = bricks;
    let x: [u64; 4] = std::array::from_fn(|yz| shift_x(m[2 * yz], m[2 * yz + 1]));
    // After x: [dx][y z]; after y: [dx][dy][z].
    let after_y = |here: [u64; 4]| -> [[u64; 2]; 2] {
        [[here[0], here[2]], [shift_y(here[0], here[1]), shift_y(here[2], here[3])]]
    };
    let y = [after_y([m[0], m[2], m[4], m[6]]), after_y(x)];
    std::array::from_fn(|c| {
        let [low, high] = y[c & 1][c >> 1 & 1];
        if c >> 2 == 0 { low } else { shift_z(low, high) }
    })
}

/// Transposes an 8×8 bit matrix: bit c of byte r of the result is bit r of byte c.
///
/// Source: Henry S. Warren, Hacker's Delight, section 7-3 (the method of swapping ever larger blocks).
#[inline(always)]
pub(crate) const fn transpose8(mut m: u64) -> u64 {
    let mut t = (m ^ m >> 7) & 0x00aa_00aa_00aa_00aa;
    m ^= t ^ t << 7;
    t = (m ^ m >> 14) & 0x0000_cccc_0000_cccc;
    m ^= t ^ t << 14;
    t = (m ^ m >> 28) & 0x0000_0000_f0f0_f0f0;
    m ^ t ^ t << 28
}

/// Positions of the set bits, lowest first.
#[inline(always)]
pub(crate) fn ones(mut set: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        if set == 0 {
            return None;
        }
        let at = set.trailing_zeros() as usize;
        set &= set - 1;
        Some(at)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corner_sets_see_the_right_node_of_the_right_brick() {
        // One set bit at a time, in each of the eight bricks.
        for brick in 0..8 {
            for node in 0..64 {
                let mut bricks = [0u64; 8];
                bricks[brick] = 1 << node;
                let sets = corner_sets(&bricks);
                for (c, set) in sets.iter().enumerate() {
                    for n in 0..64 {
                        let at = |a: usize| (n >> (2 * a) & 3) + (c >> a & 1);
                        let owner = (at(0) >> 2) | (at(1) >> 2) << 1 | (at(2) >> 2) << 2;
                        let bit = node_bit(at(0) & 3, at(1) & 3, at(2) & 3);
                        assert_eq!(set >> n & 1 == 1, owner == brick && bit == node, "c {c} n {n}");
                    }
                }
            }
        }
    }

    #[test]
    fn shifting_up_sees_the_node_before_or_the_last_of_the_brick_below() {
        for axis in 0..3 {
            for node in 0..64 {
                let at = node >> (2 * axis) & 3;
                let step = 1 << (2 * axis);
                let (here, below) = (shift_up(axis, 1 << node, 0), shift_up(axis, 0, 1 << node));
                assert_eq!(here, if at < 3 { 1 << (node + step) } else { 0 }, "{axis} {node}");
                assert_eq!(below, if at == 3 { 1 << (node - 3 * step) } else { 0 }, "{axis} {node}");
            }
        }
    }

    #[test]
    fn transpose_swaps_rows_and_columns() {
        for bit in 0..64 {
            assert_eq!(transpose8(1 << bit), 1 << ((bit & 7) * 8 + bit / 8));
        }
    }

    #[test]
    fn sides_are_faces_edges_and_corners() {
        assert_eq!(side_mask([0, 0, 0]), u64::MAX);
        assert_eq!(side_mask([-1, 0, 0]).count_ones(), 16);
        assert_eq!(side_mask([1, -1, 0]).count_ones(), 4);
        assert_eq!(side_mask([1, 1, 1]), 1 << 63);
    }
}
