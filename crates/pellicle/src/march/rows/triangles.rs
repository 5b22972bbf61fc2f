//! Writes the triangles of counted rows to their places.
//!
//! Source: this project; see [`super`].

use std::ops::Range;

use super::{
    Iso, Rows,
    classify::Signs,
    count::{Cases, Counted, corner_words, four_rows},
};
use crate::{
    march::{
        cubes::count::crossed_cells,
        resolve::{MOST_INNER, Resolved},
        tables::{CASES, COUNTS, MOST},
    },
    math::simd::{Kernel, LANES, Simd},
};

/// Writes the triangles of some rows.
pub(crate) struct Triangles<'a> {
    pub(crate) grid: &'a dyn Rows,
    pub(crate) signs: &'a Signs,
    pub(crate) counted: &'a Counted,
    pub(crate) iso: Iso,
    pub(crate) rows: Range<usize>,
    pub(crate) to: &'a mut [[u32; 3]],
}

/// Crossed edges of one word and the number of each list's first, by list: x edges of the four rows, y edges of rows
/// (j, k) and (j, k + 1), z edges of rows (j, k) and (j + 1, k).
struct Lists {
    edges: [u64; 8],
    first: [u32; 8],
}

impl Lists {
    /// At the beginning of a row of cells.
    #[inline(always)]
    fn new(counted: &Counted, ny: usize, row: usize) -> Self {
        let own = counted.place(row).vertices;
        let y = counted.place(row + 1).vertices;
        let z = counted.place(row + ny).vertices;
        let yz = counted.place(row + ny + 1).vertices;
        Self { edges: [0; 8], first: [own[0], y[0], z[0], yz[0], own[1], z[1], own[2], y[2]] }
    }

    /// Moves on past the word at hand, to this one.
    #[inline(always)]
    fn advance(&mut self, corners: &[u64; 8], with_next: u64) {
        for l in 0..8 {
            self.first[l] = self.first[l].wrapping_add(self.edges[l].count_ones());
        }
        let c = corners;
        for r in 0..4 {
            self.edges[r] = (c[2 * r] ^ c[2 * r + 1]) & with_next;
        }
        self.edges[4] = c[0] ^ c[2];
        self.edges[5] = c[4] ^ c[6];
        self.edges[6] = c[0] ^ c[4];
        self.edges[7] = c[2] ^ c[6];
    }
}

/// The lane of [`Simd::ranks`] of a cell's lists that has the number of the vertex on an edge: the cell's x edges are each
/// in a list of their own, of its y and z edges pairs follow each other in one.
const fn lane(edge: usize) -> u8 {
    if edge < 4 { edge as u8 } else { (4 + (edge - 4) / 2 + 8 * (edge & 1)) as u8 }
}

/// For each case, the lanes that make its triangles; turned round in the second table.
static LANES_OF: [[[u8; LANES]; 256]; 2] = {
    let mut lanes = [[[0; LANES]; 256]; 2];
    let mut case = 0;
    while case < 256 {
        let mut t = 0;
        while t < MOST {
            let [a, b, c] = CASES[case].triangles[t];
            let [a, b, c] = [lane(a as usize), lane(b as usize), lane(c as usize)];
            (lanes[0][case][3 * t], lanes[0][case][3 * t + 1], lanes[0][case][3 * t + 2]) = (a, b, c);
            (lanes[1][case][3 * t], lanes[1][case][3 * t + 1], lanes[1][case][3 * t + 2]) = (a, c, b);
            t += 1;
        }
        case += 1;
    }
    lanes
};

impl Kernel for Triangles<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { grid, signs, counted, iso, to, .. } = self;
        let shape = grid.shape();
        let flip = shape.is_left_handed;
        let table = &LANES_OF[usize::from(flip)];
        let (to, mut written) = (to.as_flattened_mut(), 0);
        for row in self.rows {
            if counted.place(row).triangles == counted.place(row + 1).triangles {
                continue;
            }
            let [Some(own), Some(y), Some(z), Some(yz)] = four_rows(shape, signs, iso.number, row) else { continue };
            let rows = [own, y, z, yz];
            let mut inner = counted.place(row).vertices[3];
            let mut lists = Lists::new(counted, shape.nodes[1], row);
            for w in 0..own.len() {
                let corners = corner_words(&rows, w);
                let with_next = shape.with_next(w);
                lists.advance(&corners, with_next);
                let mut cells = Cases::new(s, &corners, crossed_cells(&corners) & with_next);
                while let Some((cell, case)) = cells.next() {
                    let ranks = s.ranks(&lists.edges, &lists.first, cell as u32);
                    if iso.is_hard(case) {
                        let resolved = iso.resolve(grid, row, 64 * w + cell, case);
                        let mut numbers = [0; LANES];
                        s.store_u(ranks, &mut numbers);
                        let end = written + 3 * resolved.len;
                        inner += write_resolved(&resolved, &numbers, inner, flip, &mut to[written..end]);
                        written = end;
                    } else {
                        let numbers = s.pick(ranks, &table[usize::from(case)]);
                        let end = written + 3 * usize::from(COUNTS[usize::from(case)]);
                        // Triangles to come will be written over what is beyond these.
                        if let Some(to) = to.get_mut(written..written + LANES) {
                            s.store_u(numbers, to);
                        } else {
                            let mut last = [0; LANES];
                            s.store_u(numbers, &mut last);
                            to[written..end].copy_from_slice(&last[..end - written]);
                        }
                        written = end;
                    }
                }
            }
        }
    }
}

/// Writes the triangles of a resolved cell, whose inner vertices begin at number `inner`; tells how many those are.
#[inline(never)]
fn write_resolved(cell: &Resolved, ranks: &[u32; LANES], inner: u32, flip: bool, to: &mut [u32]) -> u32 {
    let mut vertices = [0; 12 + MOST_INNER];
    for edge in 0..12 {
        vertices[edge] = ranks[usize::from(lane(edge))];
    }
    for i in 0..MOST_INNER {
        vertices[12 + i] = inner.wrapping_add(i as u32);
    }
    for (to, &[a, b, c]) in to.as_chunks_mut::<3>().0.iter_mut().zip(&cell.triangles) {
        *to = (if flip { [a, c, b] } else { [a, b, c] }).map(|v| vertices[usize::from(v)]);
    }
    cell.inner_len as u32
}
