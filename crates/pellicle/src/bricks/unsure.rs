//! Which coarse cells samples leave unsure: the first step of the [band](super::band).
//!
//! A cell is sure if its corners are all clearly inside, or all clearly outside. Of fields that prove what is outside, samples tell only
//! what is inside: an octant of a cell is, if values interpolated between its corners are above a bound all through it. Such
//! fields bend on the scale of several cells, so that this is as safe as to ask for more of each corner, and leaves less to be filled.
//!
//! Source: this project.

use super::{
    band::{COARSE_SETS, ask, neighbour, node_bit_of},
    store::{Octet, Store},
};
use crate::{
    fill::Values,
    lattice::{BRICK, Coord, OCTET},
    lookup::directory::Cursor,
    math::bits::{corner_sets, node_bit, ones},
};

/// Calls `work` with the coordinates of each coarse cell of an octet that is not sure, and with those of its octants that are not:
/// all of them, or, with a bound, those in which values interpolated between the cell's corners are not all above.
pub(super) fn for_each_unsure(
    coarse: &Store<COARSE_SETS>,
    octet: &Octet,
    bound: Option<f32>,
    mut work: impl FnMut(Coord, u8),
) {
    let mut cursor = Cursor::default();
    for brick in ones(octet.filled.into()) {
        let (mut maybe, mut surely) = ([0; 8], [0; 8]);
        let mut values = [None; 8];
        for c in 0..8 {
            let d = std::array::from_fn(|a| (c >> a & 1) as i32);
            let (at, index) = neighbour(octet.at, brick, d);
            let owner = if at == octet.at { Some(octet) } else { coarse.find(&mut cursor, at) };
            if let Some(owner) = owner {
                // A brick that nothing reaches is outside: its sets stay empty.
                maybe[c] = coarse.set(owner, index, 0).unwrap_or(0);
                surely[c] = coarse.set(owner, index, 2).unwrap_or(0);
                values[c] = (surely[c] != 0 && bound.is_some()).then(|| coarse.values(owner, index));
            }
        }
        let any_maybe = corner_sets(&maybe).into_iter().fold(0, |a, b| a | b);
        let all_surely = corner_sets(&surely).into_iter().fold(u64::MAX, |a, b| a & b);
        let mut tell = |cell: usize, octants: u8| {
            let node = [cell & 3, cell >> 2 & 3, cell >> 4];
            work(
                std::array::from_fn(|a| octet.at[a] * OCTET + BRICK * (brick >> a & 1) as i32 + node[a] as i32),
                octants,
            );
        };
        ones(any_maybe & !all_surely).for_each(|cell| tell(cell, u8::MAX));
        let Some(bound) = bound else { continue };
        for cell in ones(all_surely) {
            let corners = std::array::from_fn(|c| {
                let node = [0, 1, 2].map(|a| (cell >> (2 * a) & 3) + (c >> a & 1));
                let owner = node.iter().enumerate().fold(0, |owner, (a, n)| owner | n >> 2 << a);
                values[owner].map_or(f32::NEG_INFINITY, |values: &Values| {
                    values[node_bit(node[0] & 3, node[1] & 3, node[2] & 3)]
                })
            });
            let octants = !octants_above(&corners, bound);
            if octants != 0 {
                tell(cell, octants);
            }
        }
    }
}

/// Those of a cell's octants in which values interpolated between its corners are all above a bound.
fn octants_above(corners: &[f32; 8], bound: f32) -> u8 {
    // Corners, and the middles of edges, faces and the cell: 3×3×3.
    let mut above = 0u32;
    let mut values = [0.0; 27];
    for c in 0..8 {
        values[2 * (c & 1) + 6 * (c >> 1 & 1) + 18 * (c >> 2)] = corners[c];
    }
    for (stride, starts) in [(1, &[0, 6, 18, 24][..]), (3, &[0, 1, 2, 18, 19, 20]), (9, &[0, 1, 2, 3, 4, 5, 6, 7, 8])] {
        for &start in starts {
            values[start + stride] = 0.5 * (values[start] + values[start + 2 * stride]);
        }
    }
    for (i, &value) in values.iter().enumerate() {
        above |= u32::from(value > bound) << i;
    }
    let x = above & above >> 1;
    let xy = x & x >> 3;
    let all = xy & xy >> 9;
    (0..8).fold(0, |octants, o| octants | ((all >> ((o & 1) + 3 * (o >> 1 & 1) + 9 * (o >> 2)) & 1) as u8) << o)
}

/// Adds the fine eighths that make up some octants of a coarse cell. Coarse steps are powers of two from 2 on; where they are 2 the cell
/// has nodes in its first octant alone.
pub(super) fn push_eighths(found: &mut Vec<(Coord, u64)>, cell: Coord, octants: u8, multiple: i32) {
    let side = multiple / 2;
    let first = cell.map(|c| c * side);
    if side == 1 {
        if octants & 1 != 0 {
            ask(found, first.map(|e| e >> 2), 1 << node_bit_of(first));
        }
        return;
    }
    for octant in ones(octants.into()) {
        let half = side / 2;
        let first: Coord = std::array::from_fn(|a| first[a] + half * (octant >> a & 1) as i32);
        for z in first[2]..first[2] + half {
            for y in first[1]..first[1] + half {
                for x in first[0]..first[0] + half {
                    let eighth = [x, y, z];
                    ask(found, eighth.map(|e| e >> 2), 1 << node_bit_of(eighth));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_octant_is_above_where_all_that_is_interpolated_in_it_is() {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / (1 << 24) as f32
        };
        let mut seen = [0; 2];
        for _ in 0..500 {
            let corners: [f32; 8] = std::array::from_fn(|_| random());
            let found = octants_above(&corners, 0.35);
            for octant in 0..8 {
                // What is linear along each axis is least at a corner.
                let least = (0..8).map(|c| {
                    let at = [0, 1, 2].map(|a| 0.5 * ((octant >> a & 1) + (c >> a & 1)) as f32);
                    let share = |c: usize| -> f32 {
                        (0..3).map(|a| if c >> a & 1 != 0 { at[a] } else { 1.0 - at[a] }).product()
                    };
                    (0..8).map(|c| share(c) * corners[c]).sum::<f32>()
                });
                let least = least.fold(f32::MAX, f32::min);
                assert_eq!(found >> octant & 1 == 1, least > 0.35, "{corners:?}, octant {octant}: {least}");
                seen[usize::from(found >> octant & 1)] += 1;
            }
        }
        assert!(seen[0] > 500 && seen[1] > 500, "{seen:?}");
    }

    #[test]
    fn octants_of_a_cell_are_its_eighths_or_bricks() {
        let asked = |cell, octants, multiple| {
            let mut found = Vec::new();
            push_eighths(&mut found, cell, octants, multiple);
            found
        };
        // The cell's only eighth is in its first octant.
        assert_eq!(asked([5, 0, -1], 0b1, 2), [([1, 0, -1], 1 << (1 + 16 * 3))]);
        assert_eq!(asked([5, 0, -1], 0b1111_1110, 2), []);
        assert_eq!(asked([1, 0, 0], 0b1000_0010, 4), [([0; 3], 1 << 3 | 1 << (2 + 1 + 4 + 16))]);
        let all = asked([1, 0, 0], u8::MAX, 8).into_iter().fold(0, |all, (at, set)| {
            assert_eq!(at, [1, 0, 0]);
            all | set
        });
        assert_eq!(all, u64::MAX);
    }
}
