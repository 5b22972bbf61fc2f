//! The gather approach without a narrow band: every node of the grid collects its particles, found by Z-index.
//!
//! What helps it: nodes are done in bricks, whose candidates are collected once and then, at choice, thinned for each tile of
//! 16 nodes; bricks that nothing reaches cost a look at their cells; threads take slabs of bricks. Cell, brick and thinning
//! are searched for (`--search`).
//!
//! Source: Akinci et al. 2012, section 4.1: *pure Z-index sort*.

use std::cell::RefCell;

use pellicle::internals::{Brought, Kernel, LANES, Simd, Summed, Unit};
use rayon::prelude::*;

use super::grid::{Grid, TILE};
use super::handlers::{Handlers, z_index};
use super::scatter::{add_run, put};

/// What is to be done.
#[derive(Clone, Copy)]
pub struct Gather<'a, F, const C: usize> {
    pub field: &'a F,
    pub handlers: &'a Handlers,
    pub grid: &'a Grid,
    /// Nodes along a brick's edge: whole tiles.
    pub brick: usize,
    /// Whether candidates are thinned for each tile.
    pub thin: bool,
}

impl<F: Summed<C>, const C: usize> Gather<'_, F, C> {
    /// Values of all nodes, in the current pool.
    pub fn run(&self, unit: Unit, values: &mut [f32]) {
        let slab = self.grid.nodes[0] * self.grid.nodes[1] * self.brick;
        values.par_chunks_mut(slab).enumerate().with_max_len(1).for_each(|(number, values)| {
            LISTS.with_borrow_mut(|lists| unit.run(Slab { of: *self, first: number * self.brick, lists, values }));
        });
    }
}

thread_local! {
    /// A thread's lists, kept from slab to slab.
    static LISTS: RefCell<[List; 2]> = RefCell::default();
}

/// Candidates: axes, then columns.
#[derive(Default)]
struct List {
    axes: [Vec<f32>; 3],
    columns: Vec<Vec<f32>>,
    len: usize,
}

/// Some planes of bricks, from plane `first` on.
struct Slab<'a, F, const C: usize> {
    of: Gather<'a, F, C>,
    first: usize,
    lists: &'a mut [List; 2],
    values: &'a mut [f32],
}

impl<F: Summed<C>, const C: usize> Kernel for Slab<'_, F, C> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { of, first, lists, values } = self;
        let Gather { field, handlers, grid, brick, thin } = of;
        let [all, near] = lists;
        let planes = values.len() / (grid.nodes[0] * grid.nodes[1]);
        let mut lanes = [[0.0; LANES]; 2];
        for lane in 0..LANES {
            lanes[0][lane] = grid.at(lane & 3);
            lanes[1][lane] = grid.at(lane >> 2);
        }
        let (lanes_x, lanes_y) = (s.load(&lanes[0]), s.load(&lanes[1]));
        let nothing = field.value(s, &[s.splat(0.0); C]);
        let mut out = [0.0; LANES];
        for y in (0..grid.nodes[1]).step_by(brick) {
            for x in (0..grid.nodes[0]).step_by(brick) {
                let start = [x, y, first];
                let end = [(x + brick).min(grid.nodes[0]), (y + brick).min(grid.nodes[1]), first + planes];
                let (mut low, mut high) = ([0.0; 3], [0.0; 3]);
                for a in 0..3 {
                    low[a] = grid.at(start[a]);
                    high[a] = grid.at(end[a] - 1);
                }
                all.collect::<S, F, C>(s, handlers, low, high);
                for z in 0..planes {
                    for ty in (y..end[1]).step_by(TILE) {
                        for tx in (x..end[0]).step_by(TILE) {
                            let mut value = nothing;
                            if all.len > 0 {
                                let from = [grid.at(tx), grid.at(ty), grid.at(first + z)];
                                let to = [grid.at(tx + TILE - 1), grid.at(ty + TILE - 1), from[2]];
                                if thin {
                                    near.clear(all.columns.len());
                                    near.append::<S, F, C>(s, &all.axes, &all.columns, 0..all.len, from, to);
                                }
                                let list = if thin { &*near } else { &*all };
                                let node = [s.add(s.splat(from[0]), lanes_x), s.add(s.splat(from[1]), lanes_y)];
                                value = sum(s, field, list, node, from[2]);
                            }
                            s.store(value, &mut out);
                            put(grid, [tx, ty, z], &out, values);
                        }
                    }
                }
            }
        }
    }
}

/// The field of a list at 16 nodes of a plane.
#[inline(always)]
fn sum<S: Simd, F: Summed<C>, const C: usize>(s: S, field: &F, list: &List, node: [S::F; 2], z: f32) -> S::F {
    let brought = Brought::new(&list.columns);
    let axes = [&list.axes[0][..], &list.axes[1][..], &list.axes[2][..]];
    let mut held = [s.splat(0.0); C];
    add_run(s, field, &mut held, axes, 0..list.len, (node, z), &brought);
    field.value(s, &held)
}

impl List {
    fn clear(&mut self, columns: usize) {
        self.len = 0;
        self.columns.resize_with(columns, Vec::new);
    }

    /// The particles of all cells near a box that are within reach of it.
    #[inline(always)]
    fn collect<S: Simd, F: Summed<C>, const C: usize>(
        &mut self,
        s: S,
        handlers: &Handlers,
        low: [f32; 3],
        high: [f32; 3],
    ) {
        self.clear(handlers.columns.len());
        let mut cells = [[0; 2]; 3];
        for a in 0..3 {
            let first = (f64::from(low[a]) - 1.0001) / handlers.edge;
            let last = (f64::from(high[a]) + 1.0001) / handlers.edge;
            cells[a] = [first.max(0.0) as usize, (last as usize + 1).min(handlers.cells[a])];
        }
        for z in cells[2][0]..cells[2][1] {
            for y in cells[1][0]..cells[1][1] {
                for x in cells[0][0]..cells[0][1] {
                    let run = handlers.cell(z_index([x, y, z]));
                    if !run.is_empty() {
                        self.append::<S, F, C>(s, &handlers.axes, &handlers.columns, run, low, high);
                    }
                }
            }
        }
    }

    /// Those of a run that are within reach of a box.
    #[inline(always)]
    fn append<S: Simd, F: Summed<C>, const C: usize>(
        &mut self,
        s: S,
        axes: &[Vec<f32>; 3],
        columns: &[Vec<f32>],
        run: std::ops::Range<usize>,
        low: [f32; 3],
        high: [f32; 3],
    ) {
        let need = self.len + run.len() + LANES;
        if self.axes[0].len() < need || self.columns.iter().any(|column| column.len() < need) {
            for column in self.axes.iter_mut().chain(&mut self.columns) {
                column.resize(2 * need, 0.0);
            }
        }
        let mut i = run.start;
        while i < run.end {
            let mut dist_sq = s.splat(0.0);
            for a in 0..3 {
                let at = s.load(&axes[a][i..]);
                let off = s.max(s.sub(s.splat(low[a]), at), s.sub(at, s.splat(high[a])));
                let off = s.max(off, s.splat(0.0));
                dist_sq = s.add(dist_sq, s.mul(off, off));
            }
            let reach_sq = match F::REACH {
                Some(column) => s.load(&columns[column][i..]),
                None => s.splat(1.000_01),
            };
            let valid = ((1u32 << (run.end - i).min(LANES)) - 1) as u16;
            let kept = s.gt(reach_sq, dist_sq) & valid;
            if kept != 0 {
                for a in 0..3 {
                    s.compress(s.load(&axes[a][i..]), kept, &mut self.axes[a][self.len..]);
                }
                for (from, to) in columns.iter().zip(&mut self.columns) {
                    s.compress(s.load(&from[i..]), kept, &mut to[self.len..]);
                }
                self.len += kept.count_ones() as usize;
            }
            i += LANES;
        }
    }
}
