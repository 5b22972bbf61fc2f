//! Triangles of a block in the viewer's order.
//!
//! Cells come in the product order of [`slices`](crate::march::slices): no coordinate's distance from the viewer's own cell
//! ever grows (back to front). Here that holds along all three axes and on both sides of him, since a block's signs are all
//! known.
//!
//! ```text
//!            coarse cell                    A transition cell is the outer quarter of its coarse cell: from the border's
//!     ┌───────────────┬─────┐               coarse nodes, which have moved inwards, to the face.
//!     │               │     │  fine
//!     │               │  t  │  block        Back to front, for a viewer at A, who is not beyond the face, it is behind
//!  A  │               │     │               the rest of its cell and comes before it; for one at B it comes after it.
//!     └───────────────┴─────┘   B
//! ```
//!
//! So a cell and its transition cells take the cell's place among the others: with any other place they would be drawn before
//! or behind cells that are on their other side. Where a cell has several, on faces that meet, they are cut apart by the
//! plane that halves the angle between the faces; of two, the viewer is on the side of the one beyond whose face he is farther.
//!
//! Within a transition cell triangles come by the depths of their edges' middles, as within cubes. It is right up to what
//! cells of different shape do to it: around an edge or corner of a block nodes move sideways too, and vertices move along
//! the surface only.
//!
//! Source: this project; the shape of transition cells is Lengyel 2010, see [`super`].

use super::{
    cells::{Face, vertices},
    rows::{Rows, case},
};
use crate::march::{
    slices::{DrawOrder, Sight},
    tables::transition::{EDGES, MOST, TRANSITIONS, Transition, edge_ends},
};

/// A cell among its transition cells, which are told by their faces.
const CELL: usize = 6;

/// Writes the triangles of a block in this viewer's order, as many as [`count`](super::cells::count) says.
pub(super) fn write(rows: &Rows, block: usize, sight: Sight, to: &mut [[u32; 3]]) {
    let sight = sight.in_block(rows.first_node(block), rows.stride(block));
    let faces = std::array::from_fn(|face| {
        let finer = rows.around[block].finer >> face & 1 == 1;
        finer.then(|| Face::new(rows, block, face)).flatten()
    });
    let mut writer = Writer { rows, block, sight, faces, to, next: 0 };
    let n = rows.view(block).n;
    let all = (1u64 << n) - 1;
    for_each(&sight, 2, all, |k| {
        for_each(&sight, 1, all, |j| {
            let (signs, crossed) = rows.view(block).cells(j, k);
            let cells = crossed | writer.beside_faces(j, k, n);
            for_each(&sight, 0, cells, |i| writer.cell([i, j, k], case(&signs, i)));
        });
    });
}

/// Calls `work` with some places along an axis, in the viewer's order.
#[inline(always)]
fn for_each(sight: &Sight, axis: usize, mut places: u64, mut work: impl FnMut(usize)) {
    while places != 0 {
        let at = sight.first(axis, places);
        places &= !(1 << at);
        work(at);
    }
}

/// One block on its way out.
struct Writer<'a> {
    rows: &'a Rows,
    block: usize,
    /// The viewer, in cells of the block.
    sight: Sight,
    /// Faces beyond which cells are finer.
    faces: [Option<Face>; 6],
    to: &'a mut [[u32; 3]],
    next: usize,
}

impl Writer<'_> {
    /// The cells of row (j, k) that lie at a face with transition cells.
    fn beside_faces(&self, j: usize, k: usize, n: usize) -> u64 {
        let at = |side: usize| side * (n - 1);
        let all = (1 << n) - 1;
        (0..6).filter(|&face| self.faces[face].is_some()).fold(0, |set, face| {
            let side = face % 2;
            set | match face / 2 {
                0 => 1 << at(side),
                1 if j == at(side) => all,
                2 if k == at(side) => all,
                _ => 0,
            }
        })
    }

    /// How many cells beyond a face the viewer is, as a cell at that face sees him; at most 0 where he is not.
    fn beyond(&self, face: usize, at: [usize; 3]) -> i64 {
        let along = self.sight.cube[face / 2] - at[face / 2] as i64;
        if face & 1 == 0 { -along } else { along }
    }

    /// Writes a cell and its transition cells.
    fn cell(&mut self, at: [usize; 3], case: usize) {
        let last = self.rows.cells(self.block) - 1;
        // From back to front: behind the cell what the viewer is not beyond.
        let mut parts = [(1, CELL); 7];
        let mut count = 1;
        for face in 0..6 {
            if self.faces[face].is_some() && at[face / 2] == face % 2 * last {
                parts[count] = (2 * self.beyond(face, at), face);
                count += 1;
            }
        }
        parts[..count].sort_unstable();
        if self.sight.order == DrawOrder::FrontToBack {
            parts[..count].reverse();
        }
        for &(_, part) in &parts[..count] {
            if part == CELL { self.cube(at, case) } else { self.transition(part, at) }
        }
    }

    fn cube(&mut self, at: [usize; 3], case: usize) {
        let vertices = vertices(self.rows, self.block, at, case);
        for triangle in self.sight.triangles(at, case) {
            self.push(triangle.map(|edge| vertices[usize::from(edge & 15)]));
        }
    }

    fn transition(&mut self, part: usize, at: [usize; 3]) {
        let Some(face) = &self.faces[part] else { return };
        let [u, v] = [at[face.axes[0]], at[face.axes[1]]];
        let case = &TRANSITIONS[face.case(self.rows, u, v)];
        if case.len == 0 {
            return;
        }
        // Which way along u, v and w, which leads out through the face, is farther.
        let farther = [0, 1, 2].map(|i| match face.axes[i] {
            axis if i < 2 => at[axis] as i64 > self.sight.cube[axis],
            _ => self.beyond(part, at) <= 0,
        });
        let (order, wound) = (far_first(case, farther), |t: u8| face.wound(case.triangles[usize::from(t)]));
        let vertices = face.vertices(self.rows, u, v, case);
        let len = usize::from(case.len);
        let back_to_front = self.sight.order == DrawOrder::BackToFront;
        let mut triangles = [[0; 3]; MOST];
        for (i, to) in triangles[..len].iter_mut().enumerate() {
            let i = if back_to_front { i } else { len - 1 - i };
            *to = wound(order[i]).map(|edge| vertices[usize::from(edge)]);
        }
        triangles[..len].iter().for_each(|&triangle| self.push(triangle));
    }

    fn push(&mut self, triangle: [u32; 3]) {
        self.to[self.next] = triangle;
        self.next += 1;
    }
}

/// Middles of a transition cell's edges along u, v, w, in eighths of a coarse cell, of which it is a quarter high.
const MIDDLES: [[i32; 3]; EDGES] = {
    let mut middles = [[0; 3]; EDGES];
    let mut edge = 0;
    while edge < EDGES {
        let (along_v, low) = edge_ends(edge);
        let (u, v, w, step) = if low < 9 {
            (4 * (low % 3), 4 * (low / 3), 2, 2)
        } else {
            (8 * ((low - 9) % 2), 8 * ((low - 9) / 2), 0, 4)
        };
        let (along_u, along_v) = if along_v { (0, step) } else { (step, 0) };
        middles[edge] = [(u + along_u) as i32, (v + along_v) as i32, w];
        edge += 1;
    }
    middles
};

/// A transition cell's triangles, the farthest first, by the sum of their corners' depths, each on the middle of its edge;
/// `farther` tells for u, v, w whether higher is farther.
fn far_first(case: &Transition, farther: [bool; 3]) -> [u8; MOST] {
    let (mut sorted, mut depths) = ([0; MOST], [0; MOST]);
    for t in 0..usize::from(case.len) {
        let edge_depth =
            |edge: u8| -> i32 { (0..3).map(|i| MIDDLES[usize::from(edge)][i] * if farther[i] { 1 } else { -1 }).sum() };
        let depth = case.triangles[t].iter().map(|&edge| edge_depth(edge)).sum();
        let mut at = t;
        while at > 0 && depths[at - 1] < depth {
            (depths[at], sorted[at]) = (depths[at - 1], sorted[at - 1]);
            at -= 1;
        }
        (depths[at], sorted[at]) = (depth, t as u8);
    }
    sorted
}
