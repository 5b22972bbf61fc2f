//! Nodes of a lattice as one number each: 21 bits of every coordinate, which tell those of neighbors apart, above one that marks
//! the middle of a cell.
//!
//! Source: this project.

/// Number of [directions](direction), the one that leads nowhere among them.
pub(super) const DIRECTIONS: u32 = 27;

/// Lowest bit of each coordinate, the last one's first.
const ONES: u64 = 1 << 1 | 1 << 22 | 1 << 43;

/// The node with these coordinates. Their bits run over half way round, far from where meshes begin.
#[inline(always)]
pub(super) fn packed(coordinates: [i64; 3]) -> u64 {
    const HALF: u64 = 1 << 20;
    coordinates.iter().fold(0, |key, c| key << 21 | ((*c as u64).wrapping_add(HALF) & 0x1f_ffff)) << 1
}

/// The middle of the cell above a node.
pub(super) fn middle_of(node: u64) -> u64 {
    node | 1
}

/// A coordinate, as far as its bits go.
#[inline(always)]
pub(super) fn coordinate(node: u64, axis: usize) -> i32 {
    (node >> (43 - 21 * axis)) as i32
}

/// Number of the direction from one node to another of which no coordinate differs by more than one, below
/// [`DIRECTIONS`]; `None` for nodes farther apart, where a coordinate's bits run over, and between a corner and a middle.
#[inline(always)]
pub(super) fn direction(from: u64, to: u64) -> Option<u32> {
    // 0, 1 or 2 for each coordinate.
    let off = to.wrapping_sub(from).wrapping_add(ONES);
    let is_near = off & !(3 * ONES) == 0 && off & off >> 1 & ONES == 0;
    // They meet in bit 42 as digits to base three.
    is_near.then_some(((off >> 1).wrapping_mul(1 << 42 | 3 << 21 | 9) >> 42 & 31) as u32)
}

/// The step in the direction of this number.
pub(super) const fn step_of(direction: u32) -> [i32; 3] {
    let digits = [direction / 9 % 3, direction / 3 % 3, direction % 3];
    [digits[0] as i32 - 1, digits[1] as i32 - 1, digits[2] as i32 - 1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_direction_to_a_neighbor_has_a_number_and_no_other_step_has() {
        // Where bits run over, none is taken for another, but their numbers mean nothing.
        for (from, runs_over) in [([5, -1, 0], false), ([5, (1 << 20) - 1, 7], true)] {
            let mut seen = [false; DIRECTIONS as usize];
            for offset in 0..125 {
                let by = [offset / 25 - 2, offset / 5 % 5 - 2, offset % 5 - 2];
                let to = packed([0, 1, 2].map(|a| from[a] + by[a]));
                let number = direction(packed(from), to);
                assert!(runs_over || number.is_some() == by.iter().all(|s| s.abs() < 2), "{by:?}");
                assert!(runs_over || number.is_none_or(|n| step_of(n).map(i64::from) == by), "{by:?}");
                assert!(number.is_none_or(|n| !std::mem::replace(&mut seen[n as usize], true)), "{by:?}");
            }
        }
        let node = packed([5, -1, 0]);
        assert_eq!(direction(node, middle_of(node)), None);
    }
}
