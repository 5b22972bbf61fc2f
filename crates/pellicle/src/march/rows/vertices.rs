//! Writes the vertices of counted rows to their places.
//!
//! Source: this project; see [`super`].

use std::ops::Range;

use super::{
    Grid, Iso, Row, Rows,
    classify::Signs,
    count::{Cases, Counted, corner_words, four_rows},
};
use crate::{
    field::volume::Scalar,
    march::{
        cubes::count::crossed_cells,
        resolve::{Level, crossing, inner_place},
    },
    math::simd::{Kernel, Portable, Simd, Unit},
};

/// Writes the vertices of some rows.
pub(crate) struct Vertices<'a> {
    pub(crate) unit: Unit,
    pub(crate) signs: &'a Signs,
    pub(crate) counted: &'a Counted,
    pub(crate) iso: Iso,
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
    fn run<S: Simd>(self, s: S) {
        let (grid, Vertices { signs, counted, iso, to, rows, .. }) = (self.grid, self.task);
        let shape = &grid.shape;
        // Few vertices lie far apart in memory: each would be waited for.
        if to.len() * 16 < rows.len() * shape.nodes[0] {
            prefetch(s, grid, signs, iso, rows.clone());
        }
        let mut to = to;
        let mut at = Gathered { node: [0; 64], ends: [[0.0; 64]; 2] };
        for row in rows {
            if counted.place(row).vertices[0] == counted.place(row + 1).vertices[0] {
                continue;
            }
            let [Some(own), y, z, yz] = four_rows(shape, signs, iso.number, row) else { continue };
            let (j, k) = (row % shape.nodes[1], row / shape.nodes[1]);
            let from = grid.row(j, k, iso.value);
            let [along, step_y, step_z] = shape.directions;
            let edges = Edges { from, there: from, ahead: 1, start: shape.row_start(row), along, step: along };
            for w in 0..own.len() {
                let next = if w + 1 < own.len() { own[w + 1] } else { 0 };
                edges.write(w, (own[w] ^ (own[w] >> 1 | next << 63)) & shape.with_next(w), &mut at, &mut to);
            }
            if let Some(next) = y {
                let edges = Edges { there: grid.row(j + 1, k, iso.value), ahead: 0, step: step_y, ..edges };
                for w in 0..own.len() {
                    edges.write(w, own[w] ^ next[w], &mut at, &mut to);
                }
            }
            if let Some(next) = z {
                let edges = Edges { there: grid.row(j, k + 1, iso.value), ahead: 0, step: step_z, ..edges };
                for w in 0..own.len() {
                    edges.write(w, own[w] ^ next[w], &mut at, &mut to);
                }
            }
            if let (true, [Some(y), Some(z), Some(yz)]) = (iso.level != Level::Classic, [y, z, yz]) {
                write_inner(grid, iso, row, &[own, y, z, yz], &mut to);
            }
        }
    }
}

/// Asks for the samples that the vertices of some rows are read from; the upper end of an x edge comes with the lower.
#[inline(always)]
fn prefetch<S: Simd, T: Scalar>(s: S, grid: &Grid<'_, T>, signs: &Signs, iso: Iso, rows: Range<usize>) {
    for row in rows {
        let [Some(own), y, z, _] = four_rows(&grid.shape, signs, iso.number, row) else { continue };
        let (j, k) = (row % grid.shape.nodes[1], row / grid.shape.nodes[1]);
        let from = grid.row(j, k, iso.value);
        for w in 0..own.len() {
            let next = if w + 1 < own.len() { own[w + 1] } else { 0 };
            ask(s, &from, w, own[w] ^ (own[w] >> 1 | next << 63));
        }
        for (beyond, at) in [(y, [j + 1, k]), (z, [j, k + 1])] {
            let Some(beyond) = beyond else { continue };
            let there = grid.row(at[0], at[1], iso.value);
            for w in 0..own.len() {
                ask(s, &from, w, own[w] ^ beyond[w]);
                ask(s, &there, w, own[w] ^ beyond[w]);
            }
        }
    }
}

/// Asks for some samples of one word.
#[inline(always)]
fn ask<S: Simd, T: Scalar>(s: S, row: &Row<'_, T>, w: usize, nodes: u64) {
    let mut left = nodes;
    while left != 0 {
        if let Some(sample) = row.sample(64 * w + left.trailing_zeros() as usize) {
            s.prefetch(sample);
        }
        left &= left - 1;
    }
}

/// Edges of one word: their lower nodes, and the relative values of both ends.
struct Gathered {
    node: [i32; 64],
    ends: [[f64; 64]; 2],
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
    /// Writes the vertices of one word's crossed edges: gathers both ends of each, then works on all of them at once.
    #[inline(always)]
    fn write(&self, w: usize, crossed: u64, at: &mut Gathered, to: &mut &mut [[f32; 3]]) {
        let mut left = crossed;
        let mut n = 0;
        while left != 0 {
            let i = 64 * w + left.trailing_zeros() as usize;
            left &= left - 1;
            at.node[n & 63] = i as i32;
            at.ends[0][n & 63] = self.from.get(i);
            at.ends[1][n & 63] = self.there.get(i + self.ahead);
            n += 1;
        }
        let Some(to) = to.split_off_mut(..n.min(64)) else { return };
        for (e, to) in to.iter_mut().enumerate() {
            let t = crossing(at.ends[0][e & 63], at.ends[1][e & 63]);
            *to = place(&self.start, at.node[e & 63], &self.along, t, &self.step);
        }
    }
}

/// Place of a vertex on the edge from node `i` of a row, at part `t` of its `step`.
#[inline(always)]
pub(super) fn place(start: &[f64; 3], i: i32, along: &[f64; 3], t: f64, step: &[f64; 3]) -> [f32; 3] {
    let mut at = [0.0; 3];
    for a in 0..3 {
        at[a] = (start[a] + f64::from(i) * along[a] + t * step[a]) as f32;
    }
    at
}

/// Writes the inner vertices of a row of cells.
pub(super) fn write_inner(grid: &dyn Rows, iso: Iso, row: usize, rows: &[&[u64]; 4], to: &mut &mut [[f32; 3]]) {
    let shape = grid.shape();
    let start = shape.row_start(row);
    for w in 0..rows[0].len() {
        let corners = corner_words(rows, w);
        let mut cells = Cases::new(Portable, &corners, crossed_cells(&corners) & shape.with_next(w));
        while let Some((cell, case)) = cells.next() {
            if !iso.is_hard(case) {
                continue;
            }
            let i = 64 * w + cell;
            let resolved = iso.resolve(grid, row, i, case);
            for &edges in &resolved.inner[..resolved.inner_len] {
                let Some(to) = to.split_off_first_mut() else { return };
                let node = [i, row % shape.nodes[1], row / shape.nodes[1]];
                *to = grid.in_cell(&start, node, inner_place(edges, &grid.corners(node, iso.value)));
            }
        }
    }
}
