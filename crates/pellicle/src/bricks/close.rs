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
    math::bits::{ones, shift_up, shift_x, shift_y, shift_z, side_mask},
};

/// Direction `i` of 27; the 13th is none.
const fn direction(i: usize) -> Coord {
    [i as i32 % 3 - 1, i as i32 / 3 % 3 - 1, i as i32 / 9 - 1]
}

/// For each direction the eighths of an octet on that side.
static SIDES: [u64; 27] = {
    let mut table = [0; 27];
    let mut i = 0;
    while i < 27 {
        table[i] = side_mask(direction(i));
        i += 1;
    }
    table
};

/// For each axis the distance of the directions along it, and the first of each line of three.
const LINES: [(usize, [usize; 9]); 3] =
    [(1, [0, 3, 6, 9, 12, 15, 18, 21, 24]), (3, [0, 1, 2, 9, 10, 11, 18, 19, 20]), (9, [0, 1, 2, 3, 4, 5, 6, 7, 8])];

/// [`shift_x`] and its like, along `axis`.
#[inline(always)]
fn shift_down(axis: usize, here: u64, above: u64) -> u64 {
    match axis {
        0 => shift_x(here, above),
        1 => shift_y(here, above),
        _ => shift_z(here, above),
    }
}

/// Sets of the eighths of 27 octets, seen from the one in the middle: bit e of result `i` is the eighth in direction `i` from its
/// eighth e.
fn seen(of: &[u64; 27]) -> [u64; 27] {
    let mut sets = *of;
    for (axis, (stride, starts)) in LINES.iter().enumerate() {
        for start in starts {
            let [below, here, above] = [0, 1, 2].map(|i| sets[start + i * stride]);
            sets[*start] = shift_up(axis, here, below);
            sets[start + 2 * stride] = shift_down(axis, here, above);
        }
    }
    sets
}

/// The other way round: the eighths, by octet, that lie in direction `i` from one of set `i`.
fn reached(from: &[u64; 27]) -> [u64; 27] {
    let mut sets = *from;
    for (axis, (stride, starts)) in LINES.iter().enumerate() {
        for start in starts {
            let [down, stay, up] = [0, 1, 2].map(|i| sets[start + i * stride]);
            sets[*start] = shift_down(axis, 0, down);
            sets[start + stride] = stay | shift_down(axis, down, 0) | shift_up(axis, up, 0);
            sets[start + 2 * stride] = shift_up(axis, 0, up);
        }
    }
    sets
}

/// For each direction the eighths of an octet whose nodes on that side are inside, by `join`: all of them, or any. `nodes` has for each of
/// an eighth's eight nodes the eighths in which that one is.
#[inline(always)]
fn on_sides(nodes: &[u64; 8], join: impl Fn(u64, u64) -> u64) -> [u64; 27] {
    let mut sets = [0; 27];
    for (c, set) in nodes.iter().enumerate() {
        sets[2 * (c & 1) + 6 * (c >> 1 & 1) + 18 * (c >> 2)] = *set;
    }
    // Lines between two sides that are known already.
    for (stride, starts) in [(1, &[0, 6, 18, 24][..]), (3, &[0, 1, 2, 18, 19, 20]), (9, &LINES[2].1)] {
        for start in starts {
            sets[start + stride] = join(sets[*start], sets[start + 2 * stride]);
        }
    }
    sets
}

/// The eighths, by octet, that disagree with one of `fresh` in the middle one: that are not `known`, and whose sign, `inside`, is not that
/// of all the nodes which touch them. `nodes` as above.
fn disagreeing(nodes: &[u64; 8], fresh: u64, known: &[u64; 27], inside: &[u64; 27]) -> [u64; 27] {
    let (all, any) = (on_sides(nodes, |a, b| a & b), on_sides(nodes, |a, b| a | b));
    let (mut sets, known, inside) = ([0; 27], seen(known), seen(inside));
    for i in 0..27 {
        sets[i] = fresh & !known[i] & (any[i] & !inside[i] | !all[i] & inside[i]);
    }
    reached(&sets)
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
    let (mut known, mut taken) = ([0; 27], [0; 27]);
    for i in 0..27 {
        // Octets that no fresh eighth touches are nobody's business.
        if fresh & SIDES[i] == 0 {
            continue;
        }
        let at = plus(octet.at, direction(i));
        (known[i], taken[i]) = match fine.find(&mut cursor, at) {
            Some(octet) => (octet.known, octet.inside),
            None => (0, inside(at)),
        };
    }
    let mut nodes = [0; 8];
    for brick in ones(eighths::bricks_with(fresh).into()) {
        let Some(set) = fine.set(octet, brick, 0) else { continue };
        for (c, nodes) in nodes.iter_mut().enumerate() {
            *nodes |= eighths::with_node(set, c, brick);
        }
    }
    for (i, eighths) in disagreeing(&nodes, fresh, &known, &taken).into_iter().enumerate() {
        if eighths != 0 {
            ask(found, plus(octet.at, direction(i)), eighths);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The octet and the eighth there of the eighth at `at`, counted from the octet in the middle.
    fn place(at: Coord) -> (usize, u64) {
        let octet = at.iter().rev().fold(0, |octet, v| 3 * octet + ((v >> 2) + 1) as usize);
        (octet, 1 << at.iter().rev().fold(0, |bit, v| 4 * bit + (v & 3)))
    }

    fn coordinates(eighth: usize) -> Coord {
        [0, 1, 2].map(|a| (eighth >> (2 * a) & 3) as i32)
    }

    #[test]
    fn an_eighth_is_seen_from_all_that_touch_it_and_reached_by_them() {
        for e in 0..64 {
            for i in 0..27 {
                let (octet, bit) = place(plus(coordinates(e), direction(i)));
                let (mut sets, mut from) = ([0; 27], [0; 27]);
                (sets[octet], from[i]) = (bit, 1 << e);
                assert_eq!(seen(&sets)[i], 1 << e, "eighth {e}, direction {i}");
                assert_eq!(reached(&from), sets, "eighth {e}, direction {i}");
            }
        }
    }

    #[test]
    fn those_disagree_that_touch_a_node_of_the_other_sign() {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            state ^ state >> 31
        };
        for round in 0..200 {
            // Few odd ones in the first rounds, so that sides of one sign are seen, too.
            let mut sparse = |flip: u64| (if round < 100 { random() & random() & random() } else { random() }) ^ flip;
            let flip = if round % 2 == 0 { 0 } else { u64::MAX };
            let nodes: [u64; 8] = std::array::from_fn(|_| sparse(flip));
            let (fresh, known, inside) =
                (sparse(0), [0; 27].map(|_: u64| sparse(0)), [0; 27].map(|_: u64| sparse(flip)));
            let mut want = [0; 27];
            for e in ones(fresh) {
                for i in 0..27 {
                    let d = direction(i);
                    let (octet, bit) = place(plus(coordinates(e), d));
                    let touches = |c: usize| (0..3).all(|a| d[a] == 0 || (c >> a & 1) as i32 == (d[a] + 1) / 2);
                    let is_inside = inside[octet] & bit != 0;
                    let disagrees = (0..8).any(|c| touches(c) && (nodes[c] >> e & 1 != 0) != is_inside);
                    if disagrees && known[octet] & bit == 0 {
                        want[octet] |= bit;
                    }
                }
            }
            assert_eq!(disagreeing(&nodes, fresh, &known, &inside), want, "round {round}");
        }
    }
}
