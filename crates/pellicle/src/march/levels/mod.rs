//! Marching cubes on blocks with a cell size each, without cracks where the sizes change.
//!
//! ```text
//! blocks   listed, with balanced levels, and what lies around each    bricks::levels, around
//! sample   every node of a block, its high border included ──► signs  Source, rows
//! number   owned crossed edges, a base for each row                   rows
//! count    triangles of cells and transition cells                    cells
//! sum      where each block's vertices and triangles go
//! emit     into slices of the caller's                                vertices, cells
//! ```
//!
//! Between a coarse block and a finer one lies a layer of *transition cells*, one on each face of a coarse cell: their fine
//! side is the faces of the fine cells, their coarse side that of the coarse cell, their sides those of the next transition
//! cell, around the edges and corners of blocks, too. Cells of all kinds draw the same segments on the faces that they
//! share ([`super::tables`]), so the surface is a closed 2-manifold whatever the signs and however the levels lie. A vertex
//! is a crossed edge and gets its number by counting.
//!
//! A node must have one value, whichever block asks for it: that is the source's duty. Nodes that touch an absent block
//! are outside; a field that is not is cut off there, and closed.
//!
//! Transition cells have no room of their own: the coarse nodes on the border move a quarter of a coarse cell away from the
//! finer blocks (`around`), and vertices on their edges move along, but only along the surface: the part of the move along
//! the normal is left out, so that no vertex leaves the surface to first order.
//!
//! Source: Lengyel, Transition cells for dynamic multiresolution marching cubes, 2010, with tables, edges and corners of
//! this project's.

pub(crate) mod around;
mod cells;
pub(crate) mod rows;
mod vertices;

#[cfg(test)]
mod tests;

use std::sync::{Mutex, PoisonError};

use crate::{
    Error,
    bricks::levels::AROUND,
    lattice::Coord,
    math::{
        ranges::{PerItem, for_each_part},
        simd::LANES,
    },
};
use around::{Around, side};
use rows::{Row, Rows, WIDEST, number};

pub(crate) use vertices::{Place, Vertices};

/// The nodes of one block: `n` + 1 along each axis, the first at `first`, `stride` apart, on the finest lattice.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grid {
    pub(crate) first: Coord,
    pub(crate) stride: i32,
    pub(crate) n: usize,
}

impl Grid {
    /// Places from one row of samples to the next: whole vectors.
    #[inline(always)]
    pub(crate) fn pitch(&self) -> usize {
        (self.n + 1).next_multiple_of(LANES)
    }

    /// Places of all samples.
    pub(crate) fn len(&self) -> usize {
        self.pitch() * (self.n + 1).pow(2)
    }

    /// Place of a node's sample.
    #[inline(always)]
    pub(crate) fn place(&self, [i, j, k]: [usize; 3]) -> usize {
        i + self.pitch() * (j + (self.n + 1) * k)
    }
}

/// Values and gradients of one block's nodes, row after row.
#[derive(Default)]
pub(crate) struct Samples {
    pub(crate) values: Vec<f32>,
    /// Along x, y, z, per fine cell or any other unit of length: only the direction is used.
    pub(crate) gradients: [Vec<f32>; 3],
}

/// Rows of nodes: bit j of word k is row (j, k).
pub(crate) type RowSet = [u64; WIDEST + 1];

/// A field, sampled block by block. A node's value and gradient depend on the node alone, not on the block that asks.
pub(crate) trait Source: Sync {
    /// What one thread needs.
    type Scratch: Default + Send;

    /// Writes the values of all nodes of listed block `block`.
    fn values(&self, scratch: &mut Self::Scratch, block: usize, grid: Grid, to: &mut [f32]);

    /// Writes values and gradients of the rows in `rows`, at least.
    fn gradients(&self, scratch: &mut Self::Scratch, block: usize, grid: Grid, rows: &RowSet, to: &mut Samples);
}

/// What each thread keeps from block to block.
type Pool<C> = Vec<Mutex<(C, Samples)>>;

/// A surface of blocks: sampled, numbered and counted. Reusable.
#[derive(Default)]
pub(crate) struct Surface {
    pub(crate) rows: Rows,
    vertices: Vec<u32>,
    triangles: Vec<u32>,
    /// First triangle of each block, and the end.
    first_triangle: Vec<usize>,
}

impl Surface {
    /// Number of vertices.
    pub(crate) fn vertex_count(&self) -> usize {
        self.rows.first_vertex.last().map_or(0, |&end| end as usize)
    }

    /// Number of triangles.
    pub(crate) fn triangle_count(&self) -> usize {
        self.first_triangle.last().copied().unwrap_or(0)
    }

    /// The nodes of a block.
    pub(crate) fn grid(&self, block: usize) -> Grid {
        Grid {
            first: self.rows.first_node(block),
            stride: 1 << self.rows.blocks.level[block],
            n: self.rows.cells(block),
        }
    }

    /// Samples the listed blocks, and counts their vertices and triangles.
    ///
    /// # Errors
    /// [`Error::Count`] when the vertices exceed `u32`.
    pub(crate) fn count<S: Source>(&mut self, source: &S, iso: f32, pool: &Pool<S::Scratch>) -> Result<(), Error> {
        self.rows.lay_out();
        let blocks = self.rows.blocks.len();
        let mut rows = std::mem::take(&mut self.rows.rows);
        self.vertices.clear();
        self.vertices.resize(blocks, 0);
        self.triangles.clear();
        self.triangles.resize(blocks, 0);
        let mut vertices = std::mem::take(&mut self.vertices);
        let first = &self.rows.first;
        let data = (&mut rows[..], PerItem(&mut vertices[..], 1));
        for_each_part(
            0..blocks,
            data,
            &|block| first[block],
            &|block, (rows, vertices): (&mut [Row], PerItem<'_, _>)| {
                let grid = self.grid(block);
                let around = &self.rows.around[block];
                with_scratch(pool, |scratch, samples| {
                    samples.values.resize(samples.values.len().max(grid.len()), 0.0);
                    let values = &mut samples.values[..grid.len()];
                    source.values(scratch, block, grid, values);
                    close_border(grid, around, iso, values);
                    sign_rows(grid, iso, values, rows);
                });
                vertices.0[0] = number(rows, grid.n, around);
            },
        );
        (self.rows.rows, self.vertices) = (rows, vertices);
        self.place_vertices()?;
        let mut triangles = std::mem::take(&mut self.triangles);
        for_each_part(0..blocks, &mut triangles[..], &|block| block, &|block, to: &mut [u32]| {
            to[0] = cells::count(&self.rows, block);
        });
        self.triangles = triangles;
        self.first_triangle.clear();
        let mut end = 0;
        self.first_triangle.push(end);
        self.first_triangle.extend(self.triangles.iter().map(|&count| {
            end += count as usize;
            end
        }));
        Ok(())
    }

    fn place_vertices(&mut self) -> Result<(), Error> {
        let needed: u64 = self.vertices.iter().map(|&count| u64::from(count)).sum();
        if needed > u64::from(u32::MAX) {
            return Err(Error::Count { what: "vertices", needed, available: u32::MAX.into() });
        }
        self.rows.first_vertex.clear();
        let mut end = 0;
        self.rows.first_vertex.push(end);
        self.rows.first_vertex.extend(self.vertices.iter().map(|&count| {
            end += count;
            end
        }));
        Ok(())
    }

    /// Writes all triangles: `to` has [`triangle_count`](Self::triangle_count) places.
    pub(crate) fn write_triangles(&self, to: &mut [[u32; 3]]) {
        let first = &self.first_triangle;
        for_each_part(0..self.rows.blocks.len(), to, &|block| first[block], &|block, to: &mut [_]| {
            cells::write(&self.rows, block, to);
        });
    }

    /// Writes all vertices, into slices with [`vertex_count`](Self::vertex_count) places.
    pub(crate) fn write_vertices<S: Source>(
        &self,
        source: &S,
        place: Place,
        pool: &Pool<S::Scratch>,
        to: Vertices<'_>,
    ) {
        let first = &self.rows.first_vertex;
        let start = |block: usize| first[block] as usize;
        for_each_part(0..self.rows.blocks.len(), to, &start, &|block, to: Vertices<'_>| {
            if start(block) == start(block + 1) {
                return;
            }
            let grid = self.grid(block);
            let view = self.rows.view(block);
            with_scratch(pool, |scratch, samples| {
                for part in std::iter::once(&mut samples.values).chain(&mut samples.gradients) {
                    part.resize(part.len().max(grid.len()), 0.0);
                }
                source.gradients(scratch, block, grid, &vertices::rows_needed(&view), samples);
                close_border(grid, view.around, place.iso, &mut samples.values);
                vertices::write(&view, grid, samples, place, to);
            });
        });
    }
}

/// Runs `work` with a scratch that nobody else uses: that of the thread, if it is one of the pool's.
fn with_scratch<C>(pool: &Pool<C>, work: impl FnOnce(&mut C, &mut Samples)) {
    let mine = rayon::current_thread_index().unwrap_or(0) % pool.len();
    let mut guard = pool[mine].lock().unwrap_or_else(PoisonError::into_inner);
    let (scratch, samples) = &mut *guard;
    work(scratch, samples);
}

/// Sees to it that there is a scratch for every thread of the current rayon pool.
pub(crate) fn fit_pool<C: Default>(pool: &mut Pool<C>) {
    let threads = rayon::current_num_threads().max(1);
    pool.resize_with(threads.max(pool.len()), Default::default);
}

/// Nodes that touch an absent block are not inside.
fn close_border(grid: Grid, around: &Around, iso: f32, values: &mut [f32]) {
    if !around.any_open() {
        return;
    }
    let n = grid.n;
    let bounds = |side: usize| [0..1, 1..n, n..n + 1][side].clone();
    for place in (0..AROUND).map(|p| [p % 3, p / 3 % 3, p / 9]).filter(|&place| around.is_open(place)) {
        for k in bounds(place[2]) {
            for j in bounds(place[1]) {
                for i in bounds(place[0]) {
                    let value = &mut values[grid.place([i, j, k])];
                    *value = value.min(iso);
                }
            }
        }
    }
    debug_assert!(side(0, n) == 0 && side(n, n) == 2);
}

/// Signs of all rows.
fn sign_rows(grid: Grid, iso: f32, values: &[f32], rows: &mut [Row]) {
    for (row, values) in rows.iter_mut().zip(values.chunks_exact(grid.pitch())) {
        row.signs = values[..=grid.n].iter().rev().fold(0, |set, &value| set << 1 | u64::from(value > iso));
    }
}
