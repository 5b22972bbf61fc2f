//! The scatter approach: particles add themselves to every node that they reach, one thread.
//!
//! ```text
//! sums     tile of 4 × 4 nodes of a plane ──► C vectors of 16, side by side: a particle's tiles are few runs of memory
//! values   node by node, x fastest, made of the sums at the end
//! ```
//!
//! What helps it: particles come in Z-order, a small cell at a time, so that the sums of one cell's particles are loaded and
//! stored once for all of them; tiles that the cell does not reach are left out, row by row; sums that nothing touched are
//! neither read nor mapped by the system. The whole grid may be done in blocks, whose sums stay in a cache; then a particle
//! is visited once for each block that it reaches. Cell and block are searched for (`--search`).
//!
//! Source: Akinci et al. 2012, section 4.1: the most efficient serial implementation.

use pellicle::internals::{Brought, Kernel, LANES, Simd, Summed, zeros};

use super::grid::{Grid, TILE};
use super::handlers::{Handlers, z_index};

/// Values of all nodes of a grid. One without particles gets the field's value of nothing.
pub struct Scatter<'a, F, const C: usize> {
    pub field: &'a F,
    pub handlers: &'a Handlers,
    pub grid: &'a Grid,
    /// Nodes along a block's edge, whole tiles; `None` for one block.
    pub block: Option<usize>,
    pub values: &'a mut [f32],
}

/// Nodes from `first` to before `end` along each axis; whole tiles.
#[derive(Clone, Copy)]
struct Block {
    first: [usize; 3],
    end: [usize; 3],
}

impl Block {
    /// Where the sums of a tile begin.
    #[inline(always)]
    fn tile<const C: usize>(&self, x: usize, y: usize, z: usize) -> usize {
        let tiles = [0, 1].map(|a| (self.end[a] - self.first[a]) / TILE);
        let at = [x - self.first[0] / TILE, y - self.first[1] / TILE];
        (((z - self.first[2]) * tiles[1] + at[1]) * tiles[0] + at[0]) * C * LANES
    }

    fn sums<const C: usize>(&self) -> usize {
        (0..3).map(|a| self.end[a] - self.first[a]).product::<usize>() * C
    }
}

impl<F: Summed<C>, const C: usize> Kernel for Scatter<'_, F, C> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { field, handlers, grid, block, values } = self;
        let Some(edge) = block else {
            let all = Block { first: [0; 3], end: grid.nodes };
            let mut sums = zeros(all.sums::<C>());
            for cell in 0..handlers.starts.len() - 1 {
                spread(s, field, handlers, grid, cell, all, &mut sums);
            }
            finish(s, field, grid, all, &sums, values);
            return;
        };
        let mut sums = Vec::new();
        // A cell farther from a block than a support, and one more for rounding, does not reach it.
        let per_cell = 1.0 / handlers.edge;
        for z in (0..grid.nodes[2]).step_by(edge) {
            for y in (0..grid.nodes[1]).step_by(edge) {
                for x in (0..grid.nodes[0]).step_by(edge) {
                    let first = [x, y, z];
                    let mut end = first;
                    let mut cells = [[0; 2]; 3];
                    for a in 0..3 {
                        end[a] = (first[a] + edge).min(grid.nodes[a]);
                        let low = (f64::from(grid.at(first[a])) - 1.0001) * per_cell;
                        let high = (f64::from(grid.at(end[a] - 1)) + 1.0001) * per_cell;
                        cells[a] = [low.max(0.0) as usize, (high as usize + 1).min(handlers.cells[a])];
                    }
                    let block = Block { first, end };
                    sums.clear();
                    sums.resize(block.sums::<C>(), 0.0);
                    for cz in cells[2][0]..cells[2][1] {
                        for cy in cells[1][0]..cells[1][1] {
                            for cx in cells[0][0]..cells[0][1] {
                                spread(s, field, handlers, grid, z_index([cx, cy, cz]), block, &mut sums);
                            }
                        }
                    }
                    finish(s, field, grid, block, &sums, values);
                }
            }
        }
    }
}

/// Adds the particles of one cell to the nodes of a block.
#[inline(always)]
fn spread<S: Simd, F: Summed<C>, const C: usize>(
    s: S,
    field: &F,
    handlers: &Handlers,
    grid: &Grid,
    cell: usize,
    block: Block,
    sums: &mut [f32],
) {
    let run = handlers.cell(cell);
    if run.is_empty() {
        return;
    }
    let (mut low, mut high) = ([f32::MAX; 3], [f32::MIN; 3]);
    let mut reach_sq = if F::REACH.is_some() { 0.0f32 } else { 1.0 };
    for i in run.clone() {
        for a in 0..3 {
            low[a] = low[a].min(handlers.axes[a][i]);
            high[a] = high[a].max(handlers.axes[a][i]);
        }
        if let Some(column) = F::REACH {
            reach_sq = reach_sq.max(handlers.columns[column][i]);
        }
    }
    let brought = Brought::new(&handlers.columns);
    let axes = [&handlers.axes[0][..], &handlers.axes[1][..], &handlers.axes[2][..]];
    let mut lanes = [[0.0; LANES]; 2];
    for lane in 0..LANES {
        lanes[0][lane] = grid.at(lane & 3);
        lanes[1][lane] = grid.at(lane >> 2);
    }
    let (lanes_x, lanes_y) = (s.load(&lanes[0]), s.load(&lanes[1]));
    let [z_first, z_end] = grid.within(2, low[2], high[2], reach_sq.sqrt());
    for z in z_first.max(block.first[2])..z_end.min(block.end[2]) {
        let at_z = grid.at(z);
        let off_z = (low[2] - at_z).max(at_z - high[2]).max(0.0);
        let in_plane = reach_sq - off_z * off_z;
        if in_plane < 0.0 {
            continue;
        }
        let [y_first, y_end] = grid.within(1, low[1], high[1], in_plane.sqrt());
        let (y_first, y_end) = (y_first.max(block.first[1]), y_end.min(block.end[1]));
        for y in y_first / TILE..y_end.div_ceil(TILE) {
            let at_y = [grid.at(TILE * y), grid.at(TILE * y + TILE - 1)];
            let off_y = (low[1] - at_y[1]).max(at_y[0] - high[1]).max(0.0);
            let in_row = in_plane - off_y * off_y;
            if in_row < 0.0 {
                continue;
            }
            let [x_first, x_end] = grid.within(0, low[0], high[0], in_row.sqrt());
            let (x_first, x_end) = (x_first.max(block.first[0]), x_end.min(block.end[0]));
            if x_first >= x_end {
                continue;
            }
            let node_y = s.add(s.splat(at_y[0]), lanes_y);
            for x in x_first / TILE..x_end.div_ceil(TILE) {
                let node_x = s.add(s.splat(grid.at(TILE * x)), lanes_x);
                let start = block.tile::<C>(x, y, z);
                let tile = &mut sums[start..start + C * LANES];
                let mut held = [s.splat(0.0); C];
                for c in 0..C {
                    held[c] = s.load(&tile[c * LANES..]);
                }
                add_run(s, field, &mut held, axes, run.clone(), ([node_x, node_y], at_z), &brought);
                for c in 0..C {
                    s.store(held[c], &mut tile[c * LANES..]);
                }
            }
        }
    }
}

/// Adds a run of particles to the sums of 16 nodes of a plane, as road A does it: where registers suffice, distances are computed two
/// particles ahead and kernels one.
#[inline(always)]
pub fn add_run<S: Simd, F: Summed<C>, const C: usize>(
    s: S,
    field: &F,
    held: &mut [S::F; C],
    axes: [&[f32]; 3],
    run: std::ops::Range<usize>,
    node: ([S::F; 2], f32),
    brought: &Brought<'_>,
) {
    if run.is_empty() {
        return;
    }
    if S::IS_WIDE {
        for i in run {
            let (d, dist_sq) = away(s, axes, i, node);
            field.add(s, held, d, field.kernels(s, dist_sq, brought, i), brought, i);
        }
        return;
    }
    let last = run.end - 1;
    let (mut d, dist_sq) = away(s, axes, run.start, node);
    let mut kernels = field.kernels(s, dist_sq, brought, run.start);
    let (mut next_d, mut next_sq) = away(s, axes, (run.start + 1).min(last), node);
    for i in run {
        let next_kernels = field.kernels(s, next_sq, brought, (i + 1).min(last));
        let (then_d, then_sq) = away(s, axes, (i + 2).min(last), node);
        field.add(s, held, d, kernels, brought, i);
        (d, kernels) = (next_d, next_kernels);
        (next_d, next_sq) = (then_d, then_sq);
    }
}

/// From a particle to 16 nodes of a plane, and the square of that.
#[inline(always)]
fn away<S: Simd>(s: S, axes: [&[f32]; 3], i: usize, (node, z): ([S::F; 2], f32)) -> ([S::F; 3], S::F) {
    let (dx, dy) = (s.sub(node[0], s.splat(axes[0][i])), s.sub(node[1], s.splat(axes[1][i])));
    let dz = z - axes[2][i];
    let flat = s.add(s.mul(dx, dx), s.mul(dy, dy));
    ([dx, dy, s.splat(dz)], s.add(flat, s.splat(dz * dz)))
}

/// Makes values of a block's sums.
#[inline(always)]
fn finish<S: Simd, F: Summed<C>, const C: usize>(
    s: S,
    field: &F,
    grid: &Grid,
    block: Block,
    sums: &[f32],
    values: &mut [f32],
) {
    let nothing = field.value(s, &[s.splat(0.0); C]);
    let mut lanes = [0.0; LANES];
    for z in block.first[2]..block.end[2] {
        for y in block.first[1] / TILE..block.end[1] / TILE {
            for x in block.first[0] / TILE..block.end[0] / TILE {
                let tile = &sums[block.tile::<C>(x, y, z)..][..C * LANES];
                // The first channel is a sum of weights, above 0 wherever a particle is near.
                let mut value = nothing;
                if s.gt(s.load(tile), s.splat(0.0)) != 0 {
                    let mut held = [s.splat(0.0); C];
                    for c in 0..C {
                        held[c] = s.load(&tile[c * LANES..]);
                    }
                    value = field.value(s, &held);
                }
                s.store(value, &mut lanes);
                put(grid, [TILE * x, TILE * y, z], &lanes, values);
            }
        }
    }
}

/// Writes a tile's values to their nodes; `values` begins with plane `first[2]` at 0.
#[inline(always)]
pub fn put(grid: &Grid, first: [usize; 3], lanes: &[f32; LANES], values: &mut [f32]) {
    for row in 0..TILE {
        let at = (first[2] * grid.nodes[1] + first[1] + row) * grid.nodes[0] + first[0];
        values[at..at + TILE].copy_from_slice(&lanes[TILE * row..TILE * (row + 1)]);
    }
}
