//! Draw order: which cube of a slab, and which triangle of a cube, comes first as seen from the viewer.
//!
//! A ray from the viewer crosses cubes in an order in which no coordinate's distance from the viewer's own cube ever
//! falls. So any order of cubes in which those distances never grow (or never fall) along each axis is right from back to
//! front (or front to back), however edge-on a slab is seen: here rows by their distance from the viewer's, then cubes.
//! Within a cube triangles are put in order by tables, one for each of the eight octants in which the viewer can be.
//!
//! Source: Rosenberg & Birdwell 2008, section 5; product orders in place of sorting by distance are this project's.

use super::slice::{Todo, WIDEST};
use crate::{
    lattice::Coord,
    march::tables::{CASES, MOST, edge_corner},
};

/// The order in which triangles are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DrawOrder {
    /// The farthest first: what transparent surfaces need.
    BackToFront,
    /// The nearest first: hidden fragments of opaque surfaces are rejected early.
    FrontToBack,
}

/// How strictly the order is kept by a march that makes triangles in another one: that from
/// [particles' seeds](super::Seeds::Particles), which steps back to a lower slab where a seed was missing, and follows the
/// surface within a slab. A complete search and blocks with levels make triangles in order and are exact either way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Sorting {
    /// Triangles come as the march makes them: of those that overlap, a thousandth or less in the wrong order. Nothing is kept back.
    #[default]
    Fast,
    /// Triangles of a block are kept back until all are made, and then written slab by slab, row by row, cube by cube: 12
    /// bytes a triangle and 8 a cube more of a block's working memory.
    Exact,
}

/// The viewer as one block sees him.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Sight {
    pub(crate) order: DrawOrder,
    pub(crate) sorting: Sorting,
    /// His cube, counted from the extent's first node; may lie anywhere.
    pub(crate) cube: [i64; 3],
}

/// The places below the viewer's along an axis, bit by bit; with his own where the nearest come first.
fn lower_side(viewer: i64, order: DrawOrder) -> u64 {
    match viewer + i64::from(order == DrawOrder::FrontToBack) {
        ..=0 => 0,
        n @ 1..64 => (1u64 << n) - 1,
        _ => u64::MAX,
    }
}

/// The next cube of a slab: the first along x and y without a viewer.
#[inline(always)]
pub(crate) fn next(todo: &mut Todo, sight: Option<&Sight>) -> Option<(usize, usize)> {
    let Some(sight) = sight else { return todo.pop() };
    if todo.is_empty() {
        return None;
    }
    let y = sight.first(1, todo.filled);
    let x = sight.first(0, todo.rows[y]);
    todo.take(x, y);
    Some((x, y))
}

/// Of some bits, which are not none, that farthest from the end of `below` (or nearest to it), on the lower side first.
#[inline(always)]
fn pick(bits: u64, below: u64, order: DrawOrder) -> usize {
    let low = bits & below;
    let first = |bits: u64| bits.trailing_zeros() as usize;
    let last = |bits: u64| 63 - bits.leading_zeros() as usize;
    match (order, low != 0) {
        (DrawOrder::BackToFront, true) => first(low),
        (DrawOrder::BackToFront, false) => last(bits),
        (DrawOrder::FrontToBack, true) => last(low),
        (DrawOrder::FrontToBack, false) => first(bits),
    }
}

impl Sight {
    /// The viewer as a block sees him whose first node is this, with cubes of `stride` cells of the finest lattice.
    pub(crate) fn in_block(self, first: Coord, stride: i32) -> Self {
        let cube = std::array::from_fn(|a| (self.cube[a] - i64::from(first[a])).div_euclid(stride.into()));
        Self { cube, ..self }
    }

    /// Of some places along an axis, which are not none, the one that comes first.
    #[inline(always)]
    pub(crate) fn first(&self, axis: usize, places: u64) -> usize {
        pick(places, lower_side(self.cube[axis], self.order), self.order)
    }

    /// A number that is the larger the later a cube comes, by slab, row and place in the row: 21 bits.
    #[inline(always)]
    pub(crate) fn place(&self, cube: [usize; 3]) -> u32 {
        (0..3).rev().fold(0, |place, a| {
            let (at, last) = (cube[a] as u32, WIDEST as u32 - 1);
            // One side of the viewer comes first, and is gone through in the other direction than the second.
            let low = lower_side(self.cube[a], self.order) >> at & 1 == 1;
            let along = match (self.order, low) {
                (DrawOrder::BackToFront, true) => at,
                (DrawOrder::BackToFront, false) => WIDEST as u32 + last - at,
                (DrawOrder::FrontToBack, true) => last - at,
                (DrawOrder::FrontToBack, false) => WIDEST as u32 + at,
            };
            place << 7 | along
        })
    }

    /// The triangles of a case in the order in which they are drawn, seen from `cube`.
    #[inline(always)]
    pub(crate) fn triangles(&self, cube: [usize; 3], case: usize) -> impl Iterator<Item = [u8; 3]> + use<> {
        // Along an axis on which the cube lies above the viewer, higher is farther.
        let octant = (0..3).fold(0, |octant, a| octant | usize::from(cube[a] as i64 > self.cube[a]) << a);
        let len = usize::from(CASES[case].len);
        let back_to_front = self.order == DrawOrder::BackToFront;
        (0..len).map(move |i| {
            let i = if back_to_front { i } else { len - 1 - i };
            CASES[case].triangles[usize::from(FAR_FIRST[octant][case][i])]
        })
    }
}

/// For each octant and case, its triangles with the farthest first, by the sum of their corners' depths, each on the
/// middle of its edge.
static FAR_FIRST: [[[u8; MOST]; 256]; 8] = {
    let mut table = [[[0; MOST]; 256]; 8];
    let mut octant = 0;
    while octant < 8 {
        let mut case = 0;
        while case < 256 {
            table[octant][case] = far_first(octant, case);
            case += 1;
        }
        octant += 1;
    }
    table
};

const fn far_first(octant: usize, case: usize) -> [u8; MOST] {
    let (mut sorted, mut depths) = ([0u8; MOST], [0i32; MOST]);
    let mut t = 0;
    while t < CASES[case].len as usize {
        let (mut depth, mut i) = (0, 0);
        while i < 3 {
            depth += edge_depth(octant, CASES[case].triangles[t][i] as usize);
            i += 1;
        }
        let mut at = t;
        while at > 0 && depths[at - 1] < depth {
            (depths[at], sorted[at]) = (depths[at - 1], sorted[at - 1]);
            at -= 1;
        }
        (depths[at], sorted[at]) = (depth, t as u8);
        t += 1;
    }
    sorted
}

/// Depth of the middle of an edge, in half cells.
const fn edge_depth(octant: usize, edge: usize) -> i32 {
    let (corner, mut depth, mut a) = (edge_corner(edge), 0, 0);
    while a < 3 {
        let along = 2 * (corner >> a & 1) as i32 + (edge / 4 == a) as i32;
        depth += if octant >> a & 1 == 1 { along } else { -along };
        a += 1;
    }
    depth
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubes_never_come_nearer_before_those_behind_them() {
        for (order, cube) in [
            (DrawOrder::BackToFront, [3, 5, 0]),
            (DrawOrder::FrontToBack, [3, 5, 0]),
            (DrawOrder::BackToFront, [-9, 70, 0]),
            (DrawOrder::FrontToBack, [64, -1, 0]),
        ] {
            let (sight, mut todo) = (Sight { order, cube, sorting: Sorting::Fast }, Todo::default());
            let (mut came, mut last) = (Vec::new(), None);
            (0..8).for_each(|y| (0..8).for_each(|x| todo.push(x, y)));
            while let Some((x, y)) = next(&mut todo, Some(&sight)) {
                came.push([x as i64 - cube[0], y as i64 - cube[1]]);
                let place = Some(sight.place([x, y, 0]));
                assert!(place > last, "places go up as cubes come: {order:?} from {cube:?}");
                last = place;
            }
            assert_eq!(came.len(), 64);
            for (i, a) in came.iter().enumerate() {
                for b in &came[i + 1..] {
                    // On the same side along both axes, and farther along both: behind.
                    let same_side = (0..2).all(|k| a[k] * b[k] >= 0);
                    let behind =
                        |p: &[i64; 2], q: &[i64; 2]| same_side && p != q && (0..2).all(|k| p[k].abs() >= q[k].abs());
                    let wrong = if order == DrawOrder::BackToFront { behind(b, a) } else { behind(a, b) };
                    assert!(!wrong, "{order:?} from {cube:?}: {a:?} before {b:?}");
                }
            }
        }
    }

    #[test]
    fn triangles_of_a_cube_come_farthest_first() {
        let sight = Sight { order: DrawOrder::BackToFront, cube: [9, 9, 9], sorting: Sorting::Fast };
        // Two opposite corners inside: the one at the origin is farther from a viewer beyond the other.
        let case = 1 | 1 << 7;
        let triangles: Vec<_> = sight.triangles([0; 3], case).collect();
        assert_eq!(triangles.len(), 2);
        assert!(triangles[0].iter().all(|&e| edge_corner(e.into()) == 0), "{triangles:?}");
        let reversed: Vec<_> = Sight { order: DrawOrder::FrontToBack, ..sight }.triangles([0; 3], case).collect();
        assert_eq!(reversed, [triangles[1], triangles[0]]);
    }
}
