//! Writes the triangles of counted rows to their places.
//!
//! Source: this project; see [`super`].

use std::ops::Range;

use super::{
    Shape,
    classify::Signs,
    count::{Counted, corner_words, for_each_case, four_rows},
};
use crate::{
    march::{cubes::count::crossed_cells, tables::CASES},
    math::simd::{Kernel, Simd},
};

/// Writes the triangles of some rows.
pub(crate) struct Triangles<'a> {
    pub(crate) shape: &'a Shape,
    pub(crate) signs: &'a Signs,
    pub(crate) counted: &'a Counted,
    /// Number of the isovalue.
    pub(crate) iso: usize,
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
        let [own, y, z, yz] = [row, row + 1, row + ny, row + ny + 1].map(|r| counted.place(r).vertices);
        Self { edges: [0; 8], first: [own[0], y[0], z[0], yz[0], own[1], z[1], own[2], y[2]] }
    }

    /// Moves on past the word at hand, to this one.
    #[inline(always)]
    fn advance(&mut self, corners: &[u64; 8], with_next: u64) {
        for (first, edges) in self.first.iter_mut().zip(self.edges) {
            *first += edges.count_ones();
        }
        let c = corners;
        let along_x = [0, 2, 4, 6].map(|r| (c[r] ^ c[r + 1]) & with_next);
        let [x0, x1, x2, x3] = along_x;
        self.edges = [x0, x1, x2, x3, c[0] ^ c[2], c[4] ^ c[6], c[0] ^ c[4], c[2] ^ c[6]];
    }

    /// Numbers of the vertices on the twelve edges of a cell; those of uncrossed edges mean nothing.
    #[inline(always)]
    fn vertices(&self, cell: usize) -> [u32; 16] {
        let before = (1u64 << cell) - 1;
        let rank: [u32; 8] = std::array::from_fn(|l| self.first[l] + (self.edges[l] & before).count_ones());
        let next = |l: usize| rank[l] + (self.edges[l] >> cell & 1) as u32;
        let [x0, x1, x2, x3, y0, y1, z0, z1] = rank;
        [x0, x1, x2, x3, y0, next(4), y1, next(5), z0, next(6), z1, next(7), 0, 0, 0, 0]
    }
}

impl Kernel for Triangles<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let Self { shape, signs, counted, iso, to, .. } = self;
        let flip = shape.is_left_handed();
        let mut written = 0;
        for row in self.rows {
            if counted.place(row).triangles == counted.place(row + 1).triangles {
                continue;
            }
            let [Some(own), Some(y), Some(z), Some(yz)] = four_rows(shape, signs, iso, row) else { continue };
            let rows = [own, y, z, yz];
            let mut ranks = Ranks::new(counted, shape.nodes[1], row);
            for w in 0..own.len() {
                let corners = corner_words(&rows, w);
                let with_next = shape.with_next(w);
                ranks.advance(&corners, with_next);
                for_each_case(&corners, crossed_cells(&corners) & with_next, |cell, case| {
                    let case = &CASES[usize::from(case)];
                    let vertices = ranks.vertices(cell);
                    let to = &mut to[written..written + usize::from(case.len)];
                    for (to, from) in to.iter_mut().zip(&case.triangles) {
                        let [a, b, c] = from.map(|edge| vertices[usize::from(edge & 15)]);
                        *to = if flip { [a, c, b] } else { [a, b, c] };
                    }
                    written += usize::from(case.len);
                });
            }
        }
    }
}
