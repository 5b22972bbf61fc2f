//! What was filled and disagrees with what was not: the rule that closes the [band](super::band).
//!
//! Source: following the surface from brick to brick is Wyvill, McPheeters, Wyvill 1986; here by eighths of bricks.

use super::{
    band::ask,
    store::{Octet, Store},
};
use crate::{
    fill::eighths,
    lattice::{Coord, plus},
    lookup::directory::Cursor,
    math::bits::{ones, shift_up, shift_x, shift_y, shift_z},
};

/// For each of a brick's eighths and each direction of 27: its nodes, in the brick's set, that touch the eighth there.
static TOUCHING: [[u64; 27]; 8] = {
    let mut table = [[0; 27]; 8];
    let mut i = 0;
    while i < 8 * 27 {
        let (eighth, d) = (i / 27, direction(i % 27));
        let mut n = 0;
        while n < 64 {
            let mut touches = eighths::OF[eighth] >> n & 1 != 0;
            let mut a = 0;
            while a < 3 {
                // Its lower nodes are even, its upper ones odd.
                let side = n >> (2 * a) & 1;
                touches &= d[a] == 0 || side == (d[a] + 1) / 2;
                a += 1;
            }
            table[eighth][i % 27] |= (touches as u64) << n;
            n += 1;
        }
        i += 1;
    }
    table
};

/// Direction `i` of 27; the 13th is none.
const fn direction(i: usize) -> Coord {
    [i as i32 % 3 - 1, i as i32 / 3 % 3 - 1, i as i32 / 9 - 1]
}

/// Sets of the eighths of 27 octets, seen from the one in the middle: bit e of result `i` is the eighth in direction `i` from its
/// eighth e.
fn seen(of: &[u64; 27]) -> [u64; 27] {
    let mut sets = *of;
    for (axis, stride) in [1, 3, 9].into_iter().enumerate() {
        for line in 0..9 {
            // The lines of three along the axis.
            let start = [3 * line, line % 3 + 9 * (line / 3), line][axis];
            let [below, here, above] = [0, 1, 2].map(|i| sets[start + i * stride]);
            sets[start] = shift_up(axis, here, below);
            sets[start + 2 * stride] = [shift_x, shift_y, shift_z][axis](here, above);
        }
    }
    sets
}

/// Adds the eighths without values that disagree with a node of one of `fresh`, which were just filled. `inside` tells, for an
/// octet that nothing was asked of, which of its eighths are inside.
pub(super) fn find_disagreeing(
    fine: &Store<1>,
    octet: &Octet,
    fresh: u64,
    mut inside: impl FnMut(Coord) -> u64,
    found: &mut Vec<(Coord, u64)>,
) {
    let mut cursor = Cursor::default();
    let around: [Option<&Octet>; 27] = std::array::from_fn(|i| fine.find(&mut cursor, plus(octet.at, direction(i))));
    let known = seen(&around.map(|o| o.map_or(0, |o| o.known)));
    let mut taken = [None; 27];
    for (i, known) in known.into_iter().enumerate() {
        let d = direction(i);
        for e in ones(fresh & !known) {
            let p: [i32; 3] = std::array::from_fn(|a| (e as i32 >> (2 * a) & 3) + d[a]);
            let (owner, bit) = p.iter().enumerate().fold((0, 0), |(owner, bit), (a, p)| {
                (owner + ((p >> 2) + 1) as usize * 3usize.pow(a as u32), bit | ((p & 3) as usize) << (2 * a))
            });
            let at = plus(octet.at, direction(owner));
            let (brick, eighth) = (e >> 1 & 1 | e >> 2 & 2 | e >> 3 & 4, e & 1 | e >> 1 & 2 | e >> 2 & 4);
            let Some(set) = fine.set(octet, brick, 0) else { continue };
            let touching = TOUCHING[eighth][i];
            let expected = match set & touching {
                0 => 0,
                all if all == touching => 1,
                _ => {
                    ask(found, at, 1 << bit);
                    continue;
                }
            };
            let taken = *taken[owner].get_or_insert_with(|| around[owner].map_or_else(|| inside(at), |o| o.inside));
            if taken >> bit & 1 != expected {
                ask(found, at, 1 << bit);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_eighth_is_seen_from_all_that_touch_it() {
        for octet in 0..27 {
            for e in 0..64i32 {
                let mut sets = [0; 27];
                sets[octet] = 1 << e;
                let at: Coord = std::array::from_fn(|a| 4 * direction(octet)[a] + (e >> (2 * a) & 3));
                for (i, set) in seen(&sets).into_iter().enumerate() {
                    let from: Coord = std::array::from_fn(|a| at[a] - direction(i)[a]);
                    let is_own = from.iter().all(|v| (0..4).contains(v));
                    let bit = if is_own { 1 << (from[0] + 4 * from[1] + 16 * from[2]) } else { 0 };
                    assert_eq!(set, bit, "octet {octet}, eighth {e}, direction {i}");
                }
            }
        }
    }

    #[test]
    fn nodes_that_touch_are_those_of_the_side() {
        for eighth in 0..8 {
            assert_eq!(TOUCHING[eighth][13], eighths::OF[eighth]);
            for i in 0..27 {
                let across = direction(i).iter().filter(|d| **d != 0).count();
                assert_eq!(TOUCHING[eighth][i].count_ones(), 8 >> across);
            }
        }
        // The upper x side of the first eighth.
        assert_eq!(TOUCHING[0][14], 1 << 1 | 1 << 5 | 1 << 17 | 1 << 21);
    }
}
