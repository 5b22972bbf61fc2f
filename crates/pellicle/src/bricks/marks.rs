//! The narrow band of the paper: nodes near surface particles are marked, and triangles are made in cells whose eight nodes
//! are.
//!
//! ```text
//! nodes   octet ──► for each brick, the nodes in the box of some surface particle
//! of      octet ──► for each brick, the cells between marked nodes, and the edges along x, y, z that such a cell has
//! ```
//!
//! Bricks with a marked node are filled, whole, by all particles in reach, so a marked node has its true value and no second
//! layer appears inside. Cells at the border of what is marked are left out, crossed or not, and with them the edges that no
//! other cell has: **the surface may end there**. Nothing follows it further; that is the paper's method.
//!
//! Marks are made in the order of the particles, but a union knows no order: the bytes are the same for any number of
//! threads. Making them is serial, as in the paper.
//!
//! Source: Akinci, Ihmsen, Akinci, Teschner, Parallel surface reconstruction for particle-based fluids, 2012, sections 4.1
//! and 4.2, algorithm 1. Masks of bricks in place of arrays over the whole grid are this project's.

use rayon::prelude::*;

use super::{
    band::neighbour,
    budget::Budget,
    store::{Octet, Store},
};
use crate::{
    Error,
    fill::eighths,
    lattice::{BRICK, Coord, OCTET},
    lookup::directory::Cursor,
    math::bits::{corner_sets, ones, shift_up},
};

/// A box of nodes: first and last along each axis; empty where the last is below the first.
pub(crate) type Nodes = [[i32; 2]; 3];

/// Cells and edges of a brick that may take part in the surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mark {
    pub(crate) cells: u64,
    pub(crate) edges: [u64; 3],
}

impl Mark {
    /// All.
    const ALL: Self = Self { cells: u64::MAX, edges: [u64::MAX; 3] };
    const NONE: Self = Self { cells: 0, edges: [0; 3] };
}

/// Marks of a store's octets, by their index there. Reusable.
#[derive(Default)]
pub(crate) struct Marks {
    nodes: Vec<[u64; 8]>,
    of: Vec<[Mark; 8]>,
}

impl Marks {
    /// Forgets all marks: everything may take part.
    pub(crate) fn clear(&mut self) {
        self.nodes.clear();
        self.of.clear();
    }

    /// Whether nothing is marked, so that everything may take part.
    pub(crate) fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Marks the nodes of boxes and wants the bricks that hold one.
    ///
    /// # Errors
    /// [`Error::Memory`] before more is marked than fits.
    pub(crate) fn want(&mut self, store: &mut Store<1>, boxes: &[Nodes], budget: Budget) -> Result<(), Error> {
        // The octets that a box takes at most; saturated, since a fine lattice may have more than a number holds.
        let octets = |nodes: &Nodes| {
            let along = |axis: &[i32; 2]| u64::try_from(i64::from(axis[1] >> 3) - i64::from(axis[0] >> 3) + 1);
            nodes.iter().map(|axis| along(axis).unwrap_or(0)).fold(1, u64::saturating_mul)
        };
        let bytes = |octets: u64| octets.saturating_mul(Store::<1>::bytes(1, 8) + Self::BYTES_PER_OCTET);
        for (i, nodes) in boxes.iter().enumerate() {
            let held = store.octet_count() as u64;
            if budget.fits(bytes(held.saturating_add(octets(nodes)))).is_err() {
                // The boxes left, what they share counted more than once: too much, but known to be enough.
                let left = boxes[i..].iter().map(octets).fold(held, u64::saturating_add);
                budget.fits(bytes(left))?;
            }
            self.mark(store, nodes);
        }
        Ok(())
    }

    /// Bytes that marks take beside the store's own.
    pub(crate) const BYTES_PER_OCTET: u64 = (size_of::<[u64; 8]>() + size_of::<[Mark; 8]>()) as u64;

    fn mark(&mut self, store: &mut Store<1>, nodes: &Nodes) {
        let octets = nodes.map(|[first, last]| first.div_euclid(OCTET)..=last.div_euclid(OCTET));
        for z in octets[2].clone() {
            for y in octets[1].clone() {
                for x in octets[0].clone() {
                    let at = [x, y, z];
                    let (mut bricks, mut sets) = (0, [0; 8]);
                    for (brick, set) in sets.iter_mut().enumerate() {
                        let first = std::array::from_fn(|a| at[a] * OCTET + BRICK * (brick >> a & 1) as i32);
                        *set = box_in_brick(nodes, first);
                        bricks |= u8::from(*set != 0) << brick;
                    }
                    if bricks == 0 {
                        continue;
                    }
                    let index = store.want(at, eighths::of_bricks(bricks), |_| 0);
                    self.nodes.resize(store.octet_count(), [0; 8]);
                    self.nodes[index].iter_mut().zip(sets).for_each(|(nodes, set)| *nodes |= set);
                }
            }
        }
    }

    /// Makes cells and edges of the nodes, when all are marked.
    pub(crate) fn close(&mut self, store: &Store<1>) {
        let nodes = &self.nodes;
        let nodes_of = |octet: Option<&Octet>, brick: usize| octet.map_or(0, |o| nodes[o.index as usize][brick]);
        let cells = |octet: &Octet| {
            let mut cursor = Cursor::default();
            std::array::from_fn::<u64, 8, _>(|brick| {
                let sets = std::array::from_fn(|c| {
                    let (at, index) = neighbour(octet.at, brick, offset(c));
                    nodes_of(store.find(&mut cursor, at), index)
                });
                corner_sets(&sets).into_iter().fold(u64::MAX, |all, set| all & set)
            })
        };
        let cells: Vec<[u64; 8]> = store.octets.par_iter().map(cells).collect();
        let cells = &cells;
        let mark = |octet: &Octet| {
            let mut cursor = Cursor::default();
            let mut marks = [Mark::NONE; 8];
            for brick in ones(octet.filled.into()) {
                let below = std::array::from_fn(|c| {
                    let (at, index) = neighbour(octet.at, brick, offset(c).map(|v| -v));
                    store.find(&mut cursor, at).map_or(0, |o| cells[o.index as usize][index])
                });
                marks[brick] = Mark { cells: below[0], edges: std::array::from_fn(|axis| edges(axis, &below)) };
            }
            marks
        };
        store.octets.par_iter().map(mark).collect_into_vec(&mut self.of);
    }

    /// What of a filled brick may take part.
    #[inline(always)]
    pub(crate) fn of(&self, octet: &Octet, brick: usize) -> Mark {
        self.of.get(octet.index as usize).map_or(Mark::ALL, |bricks| bricks[brick])
    }

    /// Number of marked nodes.
    pub(crate) fn nodes(&self) -> u64 {
        self.nodes.iter().flatten().map(|set| u64::from(set.count_ones())).sum()
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        self.of.len() as u64 * Self::BYTES_PER_OCTET
    }
}

/// Offset `c` of 8: one step along the axes whose bit is set.
fn offset(c: usize) -> Coord {
    std::array::from_fn(|a| (c >> a & 1) as i32)
}

/// The nodes of a box that lie in the brick whose first node is `first`.
fn box_in_brick(nodes: &Nodes, first: Coord) -> u64 {
    // Along one axis four bits: those from the box's first node on, less those behind its last.
    let along = |a: usize| {
        let [low, high] = nodes[a].map(|n| i64::from(n) - i64::from(first[a]));
        (0..i64::from(BRICK)).fold(0, |bits, n| bits | u64::from(low <= n && n <= high) << n)
    };
    let (x, y, z) = (along(0), along(1), along(2));
    let mut row = 0;
    for n in 0..4 {
        row |= (x * (y >> n & 1)) << (4 * n);
    }
    let mut all = 0;
    for n in 0..4 {
        all |= (row * (z >> n & 1)) << (16 * n);
    }
    all
}

/// The edges along `axis` that one of the four cells around them has. `below` are the cells of the brick and of those below it:
/// bit a of the index is one step back along axis a.
fn edges(axis: usize, below: &[u64; 8]) -> u64 {
    let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
    let either = |at: usize| below[at] | shift_up(b, below[at], below[at | 1 << b]);
    let (here, back) = (either(0), either(1 << c));
    here | shift_up(c, here, back)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_are_cut_at_bricks() {
        let nodes: Nodes = [[-3, 5], [2, 2], [3, 4]];
        for first in [[-4, 0, 0], [0, 0, 0], [4, 0, 4], [4, 0, 0], [8, 0, 0], [0, 4, 0]] {
            for n in 0..64 {
                let at: [i32; 3] = std::array::from_fn(|a| first[a] + (n >> (2 * a) & 3));
                let inside = (0..3).all(|a| nodes[a][0] <= at[a] && at[a] <= nodes[a][1]);
                assert_eq!(box_in_brick(&nodes, first) >> n & 1 == 1, inside, "{first:?} {n}");
            }
        }
    }

    #[test]
    fn cells_lie_between_marked_nodes_and_edges_along_such_cells() {
        let boxes: [Nodes; 3] = [[[-2, 3], [5, 9], [-1, 6]], [[3, 7], [6, 8], [2, 3]], [[20, 20], [0, 9], [0, 9]]];
        let (mut store, mut marks) = (Store::default(), Marks::default());
        marks.want(&mut store, &boxes, Budget { bytes: u64::MAX, taken: 0 }).unwrap();
        // All of their bricks count as filled.
        store.fill_nothing();
        marks.close(&store);
        let node = |at: Coord| boxes.iter().any(|nodes| (0..3).all(|a| nodes[a][0] <= at[a] && at[a] <= nodes[a][1]));
        let plus = |at: Coord, c: usize| std::array::from_fn(|a| at[a] + offset(c)[a]);
        let cell = |at: Coord| (0..8).all(|c| node(plus(at, c)));
        let edge = |at: Coord, axis: usize| {
            (0..8).filter(|c| c >> axis & 1 == 0).any(|c| cell(std::array::from_fn(|a| at[a] - offset(c)[a])))
        };
        let mut seen = [0; 3];
        for octet in &store.octets {
            for brick in ones(octet.filled.into()) {
                let mark = marks.of(octet, brick);
                for n in 0..64 {
                    let at: Coord = std::array::from_fn(|a| {
                        octet.at[a] * OCTET + BRICK * (brick >> a & 1) as i32 + (n >> (2 * a) & 3)
                    });
                    assert_eq!(mark.cells >> n & 1 == 1, cell(at), "cell {at:?}");
                    for axis in 0..3 {
                        assert_eq!(mark.edges[axis] >> n & 1 == 1, edge(at, axis), "edge {axis} of {at:?}");
                        seen[2] += usize::from(edge(at, axis));
                    }
                    seen[0] += usize::from(node(at));
                    seen[1] += usize::from(cell(at));
                }
            }
        }
        // The boxes share no node but those of the first two at x = 3, and the last one is too thin for a cell.
        let nodes = 6 * 5 * 8 + 5 * 3 * 2 - 3 * 2 + 100;
        assert_eq!((seen[0], marks.nodes()), (nodes as usize, nodes));
        assert!(seen[1] >= 5 * 4 * 7 + 4 * 2 && seen[2] > seen[1], "{seen:?}");
    }

    #[test]
    fn more_than_fits_is_refused_before_it_is_marked() {
        let boxes: [Nodes; 2] = [[[0, 7]; 3], [[-1_000_000_000, 1_000_000_000]; 3]];
        let (mut store, mut marks) = (Store::default(), Marks::default());
        let refused = marks.want(&mut store, &boxes, Budget { bytes: 1 << 20, taken: 0 });
        assert!(matches!(refused, Err(Error::Memory { .. })));
        assert_eq!(store.octet_count(), 1);
    }
}
