//! Signs to exact counts: where every row's vertices and triangles will go.
//!
//! Source: this project; see [`super`].

use std::ops::Range;

use rayon::prelude::*;

use super::{Shape, classify::Signs};
use crate::{
    Error,
    march::{cubes::count::crossed_cells, tables::COUNTS},
    math::{
        bits::{ones, transpose8},
        simd::{Kernel, Simd, Unit},
    },
};

/// Where a row's vertices and triangles begin, or, before they are summed up, how many it has.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Place {
    /// Vertices of edges along x, y, z, and of cells.
    pub(crate) vertices: [u32; 4],
    pub(crate) triangles: u64,
}

/// The counted rows of a lattice, and the end.
pub(crate) struct Counted {
    places: Vec<Place>,
}

impl Counted {
    /// Counts all rows for isovalue number `iso`.
    ///
    /// # Errors
    /// [`Error::Count`] when the vertices exceed `u32`.
    pub(crate) fn new(unit: Unit, shape: &Shape, signs: &Signs, iso: usize) -> Result<Self, Error> {
        let mut places = vec![Place::default(); shape.rows() + 1];
        let last = shape.rows();
        places[..last].par_chunks_mut(GROUP).enumerate().for_each(|(group, to)| {
            let rows = group * GROUP..group * GROUP + to.len();
            unit.run(CountRows { shape, signs, iso, rows, to });
        });
        let mut counted = Self { places };
        counted.sum()?;
        Ok(counted)
    }

    /// Turns counts into places.
    fn sum(&mut self) -> Result<(), Error> {
        let (mut vertices, mut triangles) = (0u64, 0u64);
        for place in &mut self.places {
            let counts = std::mem::take(place);
            for (start, count) in place.vertices.iter_mut().zip(counts.vertices) {
                // Beyond u32 the numbers are not used: an error follows.
                *start = vertices as u32;
                vertices += u64::from(count);
            }
            place.triangles = triangles;
            triangles += counts.triangles;
        }
        if vertices > u64::from(u32::MAX) {
            return Err(Error::Count { what: "vertices", needed: vertices, available: u32::MAX.into() });
        }
        Ok(())
    }

    /// Where a row begins; `rows` is the end.
    #[inline(always)]
    pub(crate) fn place(&self, row: usize) -> &Place {
        &self.places[row]
    }

    /// Number of vertices.
    pub(crate) fn vertices(&self) -> usize {
        self.places.last().map_or(0, |end| end.vertices[0] as usize)
    }

    /// Number of triangles.
    pub(crate) fn triangles(&self) -> usize {
        self.places.last().map_or(0, |end| end.triangles as usize)
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
    std::array::from_fn(|r| {
        let (y, z) = (r & 1, r >> 1);
        (j + y < ny && k + z < nz).then(|| signs.row(row + y + z * ny, iso))
    })
}

/// The same word of four rows, and each seen one node further.
#[inline(always)]
pub(crate) fn corner_words(rows: &[&[u64]; 4], w: usize) -> [u64; 8] {
    std::array::from_fn(|c| {
        let row = rows[c >> 1];
        if c & 1 == 0 {
            row[w]
        } else {
            let next = if w + 1 < row.len() { row[w + 1] } else { 0 };
            row[w] >> 1 | next << 63
        }
    })
}

/// Calls `each` with every cell of a set and its case number.
#[inline(always)]
pub(crate) fn for_each_case(corners: &[u64; 8], crossed: u64, mut each: impl FnMut(usize, u8)) {
    let mut left = crossed;
    while left != 0 {
        // Eight cells at a time, from the first group that has one.
        let group = left.trailing_zeros() & !7;
        let rows = corners.map(|set| (set >> group) as u8);
        let cases = transpose8(u64::from_le_bytes(rows)).to_le_bytes();
        let here = left & 0xff << group;
        for cell in ones(here) {
            each(cell, cases[cell & 7]);
        }
        left &= !here;
    }
}

/// Vertices and triangles of some rows.
struct CountRows<'a> {
    shape: &'a Shape,
    signs: &'a Signs,
    iso: usize,
    rows: Range<usize>,
    to: &'a mut [Place],
}

impl Kernel for CountRows<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        for (row, to) in self.rows.zip(self.to) {
            let [Some(own), y, z, yz] = four_rows(self.shape, self.signs, self.iso, row) else { continue };
            // A neighbour that is missing is replaced by the row itself: no crossing leads there.
            let rows = [own, y.unwrap_or(own), z.unwrap_or(own), yz.unwrap_or(own)];
            let has_cells = yz.is_some();
            for w in 0..own.len() {
                let corners = corner_words(&rows, w);
                let with_next = self.shape.with_next(w);
                let edges = [(corners[0] ^ corners[1]) & with_next, corners[0] ^ corners[2], corners[0] ^ corners[4]];
                for (count, edges) in to.vertices.iter_mut().zip(edges) {
                    *count += edges.count_ones();
                }
                let crossed = if has_cells { crossed_cells(&corners) & with_next } else { 0 };
                let mut triangles = 0u32;
                for_each_case(&corners, crossed, |_, case| triangles += u32::from(COUNTS[usize::from(case)]));
                to.triangles += u64::from(triangles);
            }
        }
    }
}
