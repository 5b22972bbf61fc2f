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
        tables::{CASES, MOST},
    },
    math::simd::{Kernel, Simd},
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
struct Ranks {
    edges: [u64; 8],
    first: [u32; 8],
}

impl Ranks {
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
            self.first[l] += self.edges[l].count_ones();
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

    /// Numbers of the vertices on the twelve edges of a cell; those of uncrossed edges mean nothing.
    #[inline(always)]
    fn vertices(&self, cell: usize) -> [u32; 16] {
        let before = (1u64 << cell) - 1;
        let mut rank = [0; 8];
        for l in 0..8 {
            rank[l] = self.first[l] + (self.edges[l] & before).count_ones();
        }
        let mut vertices = [0; 16];
        for l in 0..4 {
            vertices[l] = rank[l];
            vertices[4 + 2 * l] = rank[4 + l];
            vertices[5 + 2 * l] = rank[4 + l] + (self.edges[4 + l] >> cell & 1) as u32;
        }
        vertices
    }
}

impl Kernel for Triangles<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { grid, signs, counted, iso, to, .. } = self;
        let shape = grid.shape();
        let flip = shape.is_left_handed();
        let mut written = 0;
        for row in self.rows {
            if counted.place(row).triangles == counted.place(row + 1).triangles {
                continue;
            }
            let [Some(own), Some(y), Some(z), Some(yz)] = four_rows(shape, signs, iso.number, row) else { continue };
            let rows = [own, y, z, yz];
            let mut inner = counted.place(row).vertices[3];
            let mut ranks = Ranks::new(counted, shape.nodes[1], row);
            for w in 0..own.len() {
                let corners = corner_words(&rows, w);
                let with_next = shape.with_next(w);
                ranks.advance(&corners, with_next);
                let mut cells = Cases::new(s, &corners, crossed_cells(&corners) & with_next);
                while let Some((cell, case)) = cells.next() {
                    let vertices = ranks.vertices(cell);
                    let len;
                    if iso.is_hard(case) {
                        let resolved = iso.resolve(grid, row, 64 * w + cell, case);
                        len = resolved.len;
                        inner += write_resolved(&resolved, vertices, inner, flip, &mut to[written..written + len]);
                    } else {
                        let case = &CASES[usize::from(case)];
                        len = usize::from(case.len);
                        let to = &mut to[written..written + len];
                        for t in 0..len.min(MOST) {
                            to[t] = corners_of(case.triangles[t], &vertices, flip);
                        }
                    }
                    written += len;
                }
            }
        }
    }
}

/// Numbers of a triangle's corners.
#[inline(always)]
fn corners_of([a, b, c]: [u8; 3], vertices: &[u32; 16], flip: bool) -> [u32; 3] {
    let [a, b, c] = [vertices[usize::from(a & 15)], vertices[usize::from(b & 15)], vertices[usize::from(c & 15)]];
    if flip { [a, c, b] } else { [a, b, c] }
}

/// Writes the triangles of a resolved cell, whose inner vertices begin at number `inner`; tells how many those are.
#[inline(never)]
fn write_resolved(cell: &Resolved, mut vertices: [u32; 16], inner: u32, flip: bool, to: &mut [[u32; 3]]) -> u32 {
    for i in 0..MOST_INNER {
        vertices[12 + i] = inner.wrapping_add(i as u32);
    }
    for (to, &triangle) in to.iter_mut().zip(&cell.triangles) {
        *to = corners_of(triangle, &vertices, flip);
    }
    cell.inner_len as u32
}
