//! Signs to exact counts: where every row's vertices and triangles will go.
//!
//! Source: this project; see [`super`].

use std::ops::Range;

use rayon::prelude::*;

use super::{
    Iso, Rows, Shape,
    classify::Signs,
    places::{self, Places},
};
use crate::{
    Error,
    march::{cubes::count::crossed_cells, tables::COUNTS},
    math::simd::{Kernel, Simd, Unit},
};

/// Of each row: vertices of edges along x, y, z, and of cells.
pub(crate) type Place = places::Place<4>;

/// The counted rows of a lattice, and the end.
pub(crate) type Counted = Places<4>;

impl Counted {
    /// Counts the rows from `first_row` on for one isovalue; those before it count as empty. Vertices are numbered from
    /// `first_vertex` on.
    ///
    /// # Errors
    /// [`Error::Count`] when the vertices exceed `u32`.
    pub(crate) fn new(
        unit: Unit,
        grid: &dyn Rows,
        signs: &Signs,
        iso: Iso,
        first_row: usize,
        first_vertex: u32,
    ) -> Result<Self, Error> {
        let shape = grid.shape();
        let mut places = vec![Place::default(); shape.rows() + 1];
        let last = shape.rows();
        places[..last].par_chunks_mut(GROUP).enumerate().for_each(|(group, to)| {
            let (begin, end) = (group * GROUP, group * GROUP + to.len());
            let rows = begin.max(first_row).min(end)..end;
            let to = &mut to[rows.start - begin..];
            unit.run(CountRows { grid, signs, iso, rows, to });
        });
        Self::of(places, first_vertex)
    }
}

/// Rows that one task handles.
pub(crate) const GROUP: usize = 32;

/// The four rows whose nodes are the corners of a row of cells: (j, k), (j + 1, k), (j, k + 1), (j + 1, k + 1).
/// `None` where the lattice ends.
#[inline(always)]
pub(crate) fn four_rows<'a>(shape: &Shape, signs: &'a Signs, iso: usize, row: usize) -> [Option<&'a [u64]>; 4] {
    let [_, ny, nz] = shape.nodes;
    let (j, k) = (row % ny, row / ny);
    let mut rows = [None; 4];
    for (r, to) in rows.iter_mut().enumerate() {
        let (y, z) = (r & 1, r >> 1);
        if j + y < ny && k + z < nz {
            *to = Some(signs.row(row + y + z * ny, iso));
        }
    }
    rows
}

/// The same word of four rows, and each seen one node further.
///
/// Here and in what follows plain loops stand where `map` would do: closures in the adaptors of arrays are compiled apart,
/// without the vector unit's instructions.
#[inline(always)]
pub(crate) fn corner_words(rows: &[&[u64]; 4], w: usize) -> [u64; 8] {
    let mut corners = [0; 8];
    for r in 0..4 {
        let (here, next) = (rows[r][w], if w + 1 < rows[r].len() { rows[r][w + 1] } else { 0 });
        corners[2 * r] = here;
        corners[2 * r + 1] = here >> 1 | next << 63;
    }
    corners
}

/// Whether all nodes of a word's cells, in four rows, are on one side: nothing crosses there.
#[inline(always)]
pub(crate) fn is_uniform(rows: &[&[u64]; 4], w: usize) -> bool {
    let (mut any, mut all, mut any_next, mut all_next) = (0, u64::MAX, 0, u64::MAX);
    for row in rows {
        any |= row[w];
        all &= row[w];
        if w + 1 < row.len() {
            any_next |= row[w + 1];
            all_next &= row[w + 1];
        }
    }
    any | any_next & 1 == 0 || all & (all_next | !1) == u64::MAX
}

/// The cells of a set, lowest first, with their case numbers.
pub(crate) struct Cases<'a, S> {
    simd: S,
    corners: &'a [u64; 8],
    left: u64,
}

impl<'a, S: Simd> Cases<'a, S> {
    #[inline(always)]
    pub(crate) fn new(simd: S, corners: &'a [u64; 8], cells: u64) -> Self {
        Self { simd, corners, left: cells }
    }

    /// The next cell and its case.
    #[inline(always)]
    pub(crate) fn next(&mut self) -> Option<(usize, u8)> {
        if self.left == 0 {
            return None;
        }
        let cell = self.left.trailing_zeros();
        self.left &= self.left - 1;
        Some((cell as usize, self.simd.bits_at(self.corners, cell)))
    }
}

/// Vertices and triangles of some rows.
struct CountRows<'a> {
    grid: &'a dyn Rows,
    signs: &'a Signs,
    iso: Iso,
    rows: Range<usize>,
    to: &'a mut [Place],
}

impl Kernel for CountRows<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let (shape, iso) = (self.grid.shape(), self.iso);
        for (row, to) in self.rows.zip(self.to) {
            let [Some(own), y, z, yz] = four_rows(shape, self.signs, iso.number, row) else { continue };
            // A neighbour that is missing is replaced by the row itself: no crossing leads there.
            let rows = [own, y.unwrap_or(own), z.unwrap_or(own), yz.unwrap_or(own)];
            let has_cells = yz.is_some();
            for w in 0..own.len() {
                if is_uniform(&rows, w) {
                    continue;
                }
                let corners = corner_words(&rows, w);
                let with_next = shape.with_next(w);
                to.vertices[0] += ((corners[0] ^ corners[1]) & with_next).count_ones();
                to.vertices[1] += (corners[0] ^ corners[2]).count_ones();
                to.vertices[2] += (corners[0] ^ corners[4]).count_ones();
                let crossed = if has_cells { crossed_cells(&corners) & with_next } else { 0 };
                let mut triangles = 0u32;
                let mut cells = Cases::new(s, &corners, crossed);
                while let Some((cell, case)) = cells.next() {
                    if iso.is_hard(case) {
                        let resolved = iso.resolve(self.grid, row, 64 * w + cell, case);
                        triangles += resolved.len as u32;
                        to.vertices[3] += resolved.inner_len as u32;
                    } else {
                        triangles += u32::from(COUNTS[usize::from(case)]);
                    }
                }
                to.triangles += u64::from(triangles);
            }
        }
    }
}
