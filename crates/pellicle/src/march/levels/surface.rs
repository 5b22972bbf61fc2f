//! The passes over all blocks: sample, number, count, sum, emit.
//!
//! Source: this project; transition cells are Lengyel 2010, see [`super`].

use std::{
    ops::Range,
    sync::{Mutex, PoisonError},
};

use super::{
    Grid, NodeSet, Samples, Source,
    around::Around,
    cells, order,
    rows::{Row, Rows, number},
    vertices::{self, Place, Vertices},
};
use crate::{
    Error,
    bricks::levels::AROUND,
    march::slices::Sight,
    math::ranges::{PerItem, for_each_part},
};

/// What a thread keeps from block to block.
pub(crate) struct Work<S, C> {
    pub(crate) scratch: S,
    samples: Samples<C>,
    nodes: NodeSet,
}

impl<S: Default, C> Default for Work<S, C> {
    fn default() -> Self {
        Self { scratch: S::default(), samples: Samples::default(), nodes: Vec::new() }
    }
}

impl<S, C: Copy + Default> Work<S, C> {
    /// Makes room for a block of `side` cells.
    pub(crate) fn provide(&mut self, side: usize) {
        let nodes = (side + 1).pow(3);
        grow(&mut self.samples.values, nodes);
        grow(&mut self.samples.outward, nodes);
        grow(&mut self.samples.corners, nodes);
        self.nodes.reserve((side + 1).pow(2).saturating_sub(self.nodes.len()));
    }
}

/// One for each thread.
pub(crate) type Pool<S, C> = Vec<Mutex<Work<S, C>>>;

/// Sees to it that there is a work for every thread of the current rayon pool.
pub(crate) fn fit_pool<S: Default, C>(pool: &mut Pool<S, C>) {
    pool.resize_with(rayon::current_num_threads().max(pool.len()), Mutex::default);
}

/// Runs `work` with what nobody else uses: that of this thread, if it is one of the pool's.
fn with<S, C>(pool: &Pool<S, C>, work: impl FnOnce(&mut Work<S, C>)) {
    let mine = rayon::current_thread_index().unwrap_or(0) % pool.len();
    work(&mut pool[mine].lock().unwrap_or_else(PoisonError::into_inner));
}

/// A surface of blocks: sampled, numbered and counted. Reusable.
#[derive(Default)]
pub(crate) struct Surface {
    pub(crate) rows: Rows,
    /// Triangles of each block.
    triangles: Vec<u32>,
    /// First triangle of each block, and the end.
    first_triangle: Vec<usize>,
}

impl Surface {
    /// Number of blocks.
    pub(crate) fn blocks(&self) -> usize {
        self.rows.levels.len()
    }

    /// Where the vertices of some blocks are.
    pub(crate) fn vertices(&self, blocks: &Range<usize>) -> Range<usize> {
        let at = |block: usize| self.rows.first_vertex[block] as usize;
        at(blocks.start)..at(blocks.end)
    }

    /// Where the triangles of some blocks are.
    pub(crate) fn triangles(&self, blocks: &Range<usize>) -> Range<usize> {
        self.first_triangle[blocks.start]..self.first_triangle[blocks.end]
    }

    /// Bytes that find vertices and triangles.
    pub(crate) fn bytes(&self) -> usize {
        self.rows.bytes() + self.blocks() * (size_of::<u32>() + size_of::<usize>())
    }

    fn grid(&self, block: usize) -> Grid {
        Grid { first: self.rows.first_node(block), stride: self.rows.stride(block), n: self.rows.cells(block) }
    }

    /// Samples the listed blocks, and counts their vertices and triangles.
    ///
    /// # Errors
    /// [`Error::Count`] when the vertices exceed `u32`.
    pub(crate) fn count<S: Source>(
        &mut self,
        source: &S,
        iso: f32,
        pool: &Pool<S::Scratch, S::Corner>,
    ) -> Result<(), Error> {
        self.rows.lay_out();
        let blocks = self.blocks();
        let (mut rows, mut counts) = (std::mem::take(&mut self.rows.rows), std::mem::take(&mut self.triangles));
        counts.clear();
        counts.resize(blocks, 0);
        let data = (&mut rows[..], PerItem(&mut counts[..], 1));
        let sample = |block: usize, (rows, count): (&mut [Row], PerItem<'_, u32>)| {
            if self.rows.levels.hidden[block] {
                return;
            }
            let (grid, around) = (self.grid(block), &self.rows.around[block]);
            with(pool, |Work { scratch, samples, .. }| {
                grow(&mut samples.values, grid.len());
                let values = &mut samples.values[..grid.len()];
                source.values(scratch, block, grid, values);
                close_border(grid, around, iso, values);
                for (row, values) in rows.iter_mut().zip(values.chunks_exact(grid.n + 1)) {
                    row.signs = values.iter().rev().fold(0, |set, &value| set << 1 | u64::from(value > iso));
                }
            });
            count.0[0] = number(rows, grid.n, around);
        };
        for_each_part(0..blocks, data, &|block| self.rows.first[block], &sample);
        self.rows.rows = rows;
        self.rows.place_vertices(&counts)?;
        for_each_part(0..blocks, &mut counts[..], &|block| block, &|block, count: &mut [u32]| {
            let hidden = self.rows.levels.hidden[block];
            count[0] = if hidden { 0 } else { cells::count(&self.rows, block) };
        });
        self.first_triangle.clear();
        let mut end = 0;
        self.first_triangle.push(end);
        self.first_triangle.extend(counts.iter().map(|&count| {
            end += count as usize;
            end
        }));
        self.triangles = counts;
        Ok(())
    }

    /// Writes the triangles of some blocks, each block's in the order of a viewer if there is one: `to` has as many places
    /// as [`triangles`](Self::triangles) says.
    pub(crate) fn write_triangles(&self, blocks: Range<usize>, sight: Option<Sight>, to: &mut [[u32; 3]]) {
        let start = |block: usize| self.first_triangle[block];
        for_each_part(blocks, to, &start, &|block, to: &mut [_]| match sight {
            _ if to.is_empty() => {}
            None => cells::write(&self.rows, block, to),
            Some(sight) => order::write(&self.rows, block, sight, to),
        });
    }

    /// Writes the vertices of some blocks: `to` has as many places as [`vertices`](Self::vertices) says.
    pub(crate) fn write_vertices<S: Source>(
        &self,
        blocks: Range<usize>,
        source: &S,
        place: Place,
        pool: &Pool<S::Scratch, S::Corner>,
        to: Vertices<'_, S::Vertex>,
    ) {
        let start = |block: usize| self.rows.first_vertex[block] as usize;
        for_each_part(blocks, to, &start, &|block, to: Vertices<'_, S::Vertex>| {
            if start(block) == start(block + 1) {
                return;
            }
            let (grid, view) = (self.grid(block), self.rows.view(block));
            with(pool, |Work { scratch, samples, nodes }| {
                grow(&mut samples.values, grid.len());
                grow(&mut samples.outward, grid.len());
                grow(&mut samples.corners, grid.len());
                vertices::nodes_needed(&view, nodes);
                source.shade(scratch, block, grid, nodes, samples);
                close_border(grid, view.around, place.iso, &mut samples.values);
                vertices::write(&view, grid, samples, place, source, to);
            });
        });
    }
}

fn grow<T: Copy + Default>(to: &mut Vec<T>, len: usize) {
    to.resize(to.len().max(len), T::default());
}

/// Nodes that touch an absent block are not inside.
fn close_border(grid: Grid, around: &Around, iso: f32, values: &mut [f32]) {
    if !around.any_open() {
        return;
    }
    let n = grid.n;
    let within = |side: usize| [0..1, 1..n, n..n + 1][side].clone();
    for place in (0..AROUND).map(|p| [p % 3, p / 3 % 3, p / 9]).filter(|&place| around.is_open(place)) {
        for k in within(place[2]) {
            for j in within(place[1]) {
                for i in within(place[0]) {
                    let value = &mut values[grid.place([i, j, k])];
                    *value = value.min(iso);
                }
            }
        }
    }
}
