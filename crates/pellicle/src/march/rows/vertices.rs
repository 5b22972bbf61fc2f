//! Writes the vertices of counted rows to their places.
//!
//! Source: this project; see [`super`].

use std::ops::Range;

use super::{
    Grid, Iso, Row, Rows, Shape, Values,
    classify::Signs,
    count::{Cases, Counted, GROUP, corner_words, four_rows},
    relative,
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
        prefetch(s, grid, signs, iso, rows.clone());
        let (mut to, mut at) = (to, Gathered::NONE);
        for row in rows {
            if counted.place(row).vertices[0] == counted.place(row + 1).vertices[0] {
                continue;
            }
            let [Some(own), y, z, yz] = four_rows(shape, signs, iso.number, row) else { continue };
            write_edges(grid, iso, row, [own, y.unwrap_or(own), z.unwrap_or(own)], &mut at, &mut to);
            if let (true, [Some(y), Some(z), Some(yz)]) = (iso.level != Level::Classic, [y, z, yz]) {
                write_inner(grid, iso, row, &[own, y, z, yz], &mut to);
            }
        }
    }
}

/// Makes the vertices of rows that have just been classified, while their samples are in the cache.
///
/// Of all that a sparse surface costs, reading its samples a second time from memory is the most. Vertices so made wait for their
/// place until all are counted.
pub(crate) struct Fresh<'a> {
    pub(crate) unit: Unit,
    /// Signs of all isovalues, from row `first` on, `words` a row and isovalue.
    pub(crate) bits: &'a [u64],
    pub(crate) first: usize,
    pub(crate) isos: usize,
    /// One isovalue, whose level is [`Level::Classic`].
    pub(crate) iso: Iso,
    /// The rows, [`GROUP`] at most; those that follow them, along y and z, must have signs, too.
    pub(crate) rows: Range<usize>,
}

/// The same for a type of samples.
pub(super) struct TypedFresh<'g, 'a, 't, T> {
    pub(super) grid: &'g Grid<'a, T>,
    pub(super) task: Fresh<'t>,
}

/// Bytes of samples for one of vertices, at least, that are kept until they have their places. Where the surface is denser,
/// copying vertices would cost more than reading samples again.
const SPARSE: usize = 4;

impl Fresh<'_> {
    /// Signs of a row and of those that follow it along y and z; its own again where the lattice has none: no crossing leads there.
    #[inline(always)]
    fn three_rows(&self, shape: &Shape, row: usize) -> [&[u64]; 3] {
        let ([_, ny, nz], words) = (shape.nodes, shape.words());
        let rows = [row, if row % ny + 1 < ny { row + 1 } else { row }, if row / ny + 1 < nz { row + ny } else { row }];
        let mut signs = [&[][..]; 3];
        for (row, to) in rows.into_iter().zip(&mut signs) {
            let start = ((row - self.first) * self.isos + self.iso.number) * words;
            *to = &self.bits[start..start + words];
        }
        signs
    }
}

impl<T: Scalar> Kernel for TypedFresh<'_, '_, '_, T> {
    /// None where the surface is dense.
    type Output = Vec<[f32; 3]>;

    #[inline(always)]
    fn run<S: Simd>(self, _: S) -> Vec<[f32; 3]> {
        let (grid, task, shape) = (self.grid, &self.task, &self.grid.shape);
        let (mut count, mut ends) = (0, [0; GROUP]);
        for (row, end) in task.rows.clone().zip(&mut ends) {
            let [own, y, z] = task.three_rows(shape, row);
            for w in 0..own.len() {
                count += along_x(shape, own, w).count_ones() as usize;
                count += (own[w] ^ y[w]).count_ones() as usize + (own[w] ^ z[w]).count_ones() as usize;
            }
            *end = count;
        }
        let samples = task.rows.len() * shape.nodes[0] * size_of::<T>();
        if count * size_of::<[f32; 3]>() * SPARSE > samples {
            return Vec::new();
        }
        let mut vertices = vec![[0.0; 3]; count];
        let (mut to, mut at, mut start) = (&mut vertices[..], Gathered::NONE, 0);
        for (row, end) in task.rows.clone().zip(ends) {
            if end > start {
                let [own, y, z] = task.three_rows(shape, row);
                write_edges(grid, task.iso, row, [own, y, z], &mut at, &mut to);
            }
            start = end;
        }
        vertices
    }
}

/// The crossed edges along x of word `w` of a row.
#[inline(always)]
fn along_x(shape: &Shape, own: &[u64], w: usize) -> u64 {
    let next = if w + 1 < own.len() { own[w + 1] } else { 0 };
    (own[w] ^ (own[w] >> 1 | next << 63)) & shape.with_next(w)
}

/// Writes the vertices on the edges that begin in a row: along x, to the row that follows along y, and to that along z. Where the
/// lattice has none, the row's own signs stand for them.
#[inline(always)]
fn write_edges<T: Scalar>(
    grid: &Grid<'_, T>,
    iso: Iso,
    row: usize,
    [own, y, z]: [&[u64]; 3],
    at: &mut Gathered,
    to: &mut &mut [[f32; 3]],
) {
    let shape = &grid.shape;
    let (j, k) = (row % shape.nodes[1], row / shape.nodes[1]);
    let from = grid.row(j, k, iso.value);
    let [along, step_y, step_z] = shape.directions;
    let edges = Edges { from, there: from, ahead: 1, start: shape.row_start(row), along, step: along };
    for w in 0..own.len() {
        edges.write(w, along_x(shape, own, w), at, to);
    }
    let edges = Edges { there: grid.row(j + 1, k, iso.value), ahead: 0, step: step_y, ..edges };
    for w in 0..own.len() {
        edges.write(w, own[w] ^ y[w], at, to);
    }
    let edges = Edges { there: grid.row(j, k + 1, iso.value), step: step_z, ..edges };
    for w in 0..own.len() {
        edges.write(w, own[w] ^ z[w], at, to);
    }
}

/// Asks for the samples that the vertices of some rows are read from, which lie too far apart in memory to be had without a wait for
/// each; the upper end of an x edge comes with the lower.
#[inline(always)]
fn prefetch<S: Simd, T: Scalar>(s: S, grid: &Grid<'_, T>, signs: &Signs, iso: Iso, rows: Range<usize>) {
    for row in rows {
        let [Some(own), y, z, _] = four_rows(&grid.shape, signs, iso.number, row) else { continue };
        let (j, k) = (row % grid.shape.nodes[1], row / grid.shape.nodes[1]);
        let from = grid.row(j, k, iso.value);
        for w in 0..own.len() {
            ask(s, &from, w, along_x(&grid.shape, own, w));
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

/// Edges of one word: their lower nodes, and the values of both ends, NaN where one is absent.
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
        match (self.from.packed(), self.there.packed()) {
            (Some(from), Some(there)) => at.gather(w, crossed, &from, &there, self.ahead),
            _ => at.gather(w, crossed, &self.from, &self.there, self.ahead),
        }
        let Some(to) = to.split_off_mut(..crossed.count_ones() as usize) else { return };
        for (e, to) in to.iter_mut().enumerate() {
            let (a, b) = (relative(at.ends[0][e & 63], self.from.iso), relative(at.ends[1][e & 63], self.from.iso));
            *to = place(&self.start, at.node[e & 63], &self.along, crossing(a, b), &self.step);
        }
    }
}

impl Gathered {
    const NONE: Self = Self { node: [0; 64], ends: [[0.0; 64]; 2] };

    /// Takes the edges of word `w` from nodes of one row to nodes of another, `ahead` further.
    #[inline(always)]
    fn gather<V: Values>(&mut self, w: usize, crossed: u64, from: &V, there: &V, ahead: usize) {
        let (mut left, mut n) = (crossed, 0);
        while left != 0 {
            let i = 64 * w + left.trailing_zeros() as usize;
            left &= left - 1;
            self.node[n & 63] = i as i32;
            self.ends[0][n & 63] = from.value(i);
            self.ends[1][n & 63] = there.value(i + ahead);
            n += 1;
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
