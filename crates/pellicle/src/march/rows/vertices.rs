//! Writes the vertices of counted rows to their places.
//!
//! Source: this project; see [`super`].

use std::ops::Range;

use super::{
    Grid, Row,
    classify::Signs,
    count::{corner_words, four_rows},
};
use crate::{
    field::volume::Scalar,
    math::{
        bits::ones,
        simd::{Kernel, Simd, Unit},
    },
};

/// Writes the vertices of some rows.
pub(crate) struct Vertices<'a> {
    pub(crate) unit: Unit,
    pub(crate) signs: &'a Signs,
    /// Number of the isovalue, and the isovalue.
    pub(crate) iso: (usize, f64),
    pub(crate) rows: Range<usize>,
    /// Offsets from the volume's origin, one for each crossing of those rows.
    pub(crate) to: &'a mut [[f32; 3]],
}

/// The same for a type of samples.
pub(super) struct Typed<'g, 'a, 't, T> {
    pub(super) grid: &'g Grid<'a, T>,
    pub(super) task: Vertices<'t>,
}

impl<T: Scalar> Kernel for Typed<'_, '_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let (grid, Vertices { signs, iso, to, rows, .. }) = (self.grid, self.task);
        let shape = &grid.shape;
        let mut to = to.iter_mut();
        for row in rows {
            let [Some(own), y, z, _] = four_rows(shape, signs, iso.0, row) else { continue };
            let (j, k) = (row % shape.nodes[1], row / shape.nodes[1]);
            let from = grid.row(j, k, iso.1);
            let [along, step_y, step_z] = shape.directions;
            let edges = Edges { from, there: from, ahead: 1, start: shape.row_start(row), along, step: along };
            for w in 0..own.len() {
                let corners = corner_words(&[own; 4], w);
                edges.write(w, (corners[0] ^ corners[1]) & shape.with_next(w), &mut to);
            }
            if let Some(next) = y {
                let edges = Edges { there: grid.row(j + 1, k, iso.1), ahead: 0, step: step_y, ..edges };
                (0..own.len()).for_each(|w| edges.write(w, own[w] ^ next[w], &mut to));
            }
            if let Some(next) = z {
                let edges = Edges { there: grid.row(j, k + 1, iso.1), ahead: 0, step: step_z, ..edges };
                (0..own.len()).for_each(|w| edges.write(w, own[w] ^ next[w], &mut to));
            }
        }
    }
}

/// Edges that begin in one row, along one axis.
#[derive(Clone, Copy)]
struct Edges<'a, T> {
    from: Row<'a, T>,
    /// Node i of `from` leads to node i + `ahead` of this row.
    there: Row<'a, T>,
    ahead: usize,
    /// Place of the row's node 0.
    start: [f64; 3],
    /// Step from a node of the row to the next.
    along: [f64; 3],
    /// The edges themselves.
    step: [f64; 3],
}

impl<T: Scalar> Edges<'_, T> {
    /// Writes the vertices of one word's crossed edges.
    #[inline(always)]
    fn write(&self, w: usize, crossed: u64, to: &mut std::slice::IterMut<'_, [f32; 3]>) {
        for (bit, to) in ones(crossed).zip(to) {
            let i = 64 * w + bit;
            let t = part(self.from.get(i), self.there.get(i + self.ahead));
            *to = std::array::from_fn(|a| (self.start[a] + i as f64 * self.along[a] + t * self.step[a]) as f32);
        }
    }
}

/// Where on an edge between relative values `a` and `b`, of which one is above 0 and one is not, the surface crosses it.
#[inline(always)]
pub(crate) fn part(a: f64, b: f64) -> f64 {
    // 64-bit integers may round to the isovalue at both ends.
    if a == b { 0.5 } else { (a / (a - b)).clamp(0.0, 1.0) }
}
