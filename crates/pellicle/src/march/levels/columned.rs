//! Fields of particles as a source: nodes are looked up in columns, as the marching slices do, so a node has the same value
//! there and at every level, and that of the marching layers up to rounding.
//!
//! Boxes that bounds prove free of a crossing are not looked through. A node that touches no other box gets the value of
//! one beside it: between the two lies a box whose nodes are all on one side of the isovalue.
//!
//! Source: this project; look-up and bounds as in [`columns`](crate::lookup::columns), [`boxes`](crate::bricks::boxes).

use super::{Grid, NodeSet, Samples, Source};
use crate::{
    bricks::{
        blocks::Blocks,
        boxes::{BOX, Boxes},
    },
    lookup::columns::{Border, Columns, Extent, Near, Room, Want},
    march::slices::{Blend, Counts, Neighbours, Scene, Skin},
    math::{
        bits::ones,
        simd::{Kernel, Simd, Unit},
    },
};

/// What one thread needs, and what it counted.
#[derive(Default)]
pub(crate) struct Scratch {
    columns: Columns,
    near: Near,
    boxes: Boxes,
    slopes: Vec<f32>,
    room: Room,
    pub(crate) counts: Counts,
}

impl Scratch {
    /// The most that any block needed here.
    pub(crate) fn room(&self) -> Room {
        self.room
    }

    /// Makes room, so that whichever thread gets the largest block of `side` cells allocates nothing.
    pub(crate) fn provide(&mut self, room: &Room, side: usize) {
        self.room = *room;
        self.columns.provide(room);
        self.near.provide(room.longest);
        self.boxes.provide([side; 3]);
        self.slopes.resize(room.longest.max(self.slopes.len()), 0.0);
    }

    fn tally(&mut self) {
        self.room = self.room.join(&self.columns.room());
        self.counts.contributions += self.near.kept;
        self.counts.looked_at += self.near.seen;
    }
}

/// A field of particles that are given block by block.
pub(crate) struct Columned<'a, B, K> {
    pub(crate) unit: Unit,
    pub(crate) scene: &'a Scene<'a, B, K>,
    pub(crate) blocks: &'a Blocks,
}

impl<B: Blend, K: Skin> Source for Columned<'_, B, K> {
    type Scratch = Scratch;
    type Corner = K::Corner;
    type Vertex = K::Vertex;

    fn values(&self, scratch: &mut Scratch, block: usize, grid: Grid, to: &mut [f32]) {
        self.enter(scratch, block, grid);
        self.unit.run(Values { scene: self.scene, grid, scratch, to });
    }

    fn shade(&self, scratch: &mut Scratch, block: usize, grid: Grid, nodes: &NodeSet, to: &mut Samples<K::Corner>) {
        self.enter(scratch, block, grid);
        self.unit.run(Shade { scene: self.scene, grid, scratch, nodes, to });
    }

    fn mix(&self, ends: [K::Corner; 2], t: f32) -> K::Vertex {
        self.scene.skin.vertex(ends, t)
    }
}

/// The nodes of a block on the finest lattice: columns and boxes are made of all of them, at every level.
fn finest(grid: Grid) -> Extent {
    Extent { first: grid.first, nodes: [grid.n * grid.stride as usize + 1; 3] }
}

impl<B: Blend, K: Skin> Columned<'_, B, K> {
    /// Enters the block's particles into columns.
    fn enter(&self, scratch: &mut Scratch, block: usize, grid: Grid) {
        let Scratch { columns, near, counts, .. } = scratch;
        let members = self.blocks.members(&self.blocks.blocks[block]);
        columns.build(finest(grid), Border::Open, self.scene.particles, members, B::WANT.varied);
        columns.prepare(near);
        counts.entries += columns.entries() as u64;
        counts.cache_bytes = counts.cache_bytes.max(columns.bytes() as u64);
        (near.seen, near.kept) = (0, 0);
    }
}

/// Values of a block's nodes.
struct Values<'a, B, K> {
    scene: &'a Scene<'a, B, K>,
    grid: Grid,
    scratch: &'a mut Scratch,
    to: &'a mut [f32],
}

impl<B: Blend, K: Skin> Kernel for Values<'_, B, K> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(mut self, s: S) {
        let stride = self.grid.stride as usize;
        // Where cells are wider than boxes, neighbouring nodes do not touch the same box.
        let bounds = self.scene.blend.falloff().filter(|_| stride <= BOX);
        if let Some(falloff) = bounds {
            let Scratch { boxes, columns, .. } = &mut *self.scratch;
            boxes.find(s, falloff, self.scene.iso, finest(self.grid), columns.particles());
        }
        for k in 0..=self.grid.n {
            for j in 0..=self.grid.n {
                let wanted = if bounds.is_some() { self.suspects(j * stride, k * stride) } else { u64::MAX };
                self.row(s, j, k, wanted);
            }
        }
        self.scratch.tally();
    }
}

impl<B: Blend, K: Skin> Values<'_, B, K> {
    /// The nodes of a row of the finest lattice that touch a suspect box, below or above.
    #[inline(always)]
    fn suspects(&self, y: usize, z: usize) -> u64 {
        let slabs = z.saturating_sub(1)..(z + 1).min(self.grid.n * self.grid.stride as usize);
        slabs.fold(0, |row, slab| row | self.scratch.boxes.nodes(y, slab))
    }

    /// One row, of which the nodes in `wanted`, bits of the finest lattice, are looked up.
    #[inline(always)]
    fn row<S: Simd>(&mut self, s: S, j: usize, k: usize, wanted: u64) {
        let (n, stride) = (self.grid.n, self.grid.stride as usize);
        let first = self.grid.place([0, j, k]);
        // Nodes from here on have no value yet.
        let mut next = 0;
        for i in (0..=n).filter(|i| wanted >> (i * stride) & 1 == 1) {
            let value = self.value(s, [i, j, k]);
            // Before the first value the row has its side, afterwards that of the last one.
            let beside = if next == 0 { value } else { self.to[first + next - 1] };
            self.to[first + next..first + i].fill(beside);
            self.to[first + i] = value;
            next = i + 1;
        }
        if next <= n {
            let beside = match (next, j, k) {
                (0, 0, 0) => self.value(s, [0; 3]),
                (0, 0, _) => self.to[self.grid.place([0, 0, k - 1])],
                (0, ..) => self.to[self.grid.place([0, j - 1, k])],
                _ => self.to[first + next - 1],
            };
            self.to[first + next..=first + n].fill(beside);
        }
    }

    /// Value of one node.
    #[inline(always)]
    fn value<S: Simd>(&mut self, s: S, [i, j, k]: [usize; 3]) -> f32 {
        let stride = self.grid.stride as usize;
        let Scratch { columns, near, counts, .. } = &mut *self.scratch;
        let width = self.grid.n * stride + 1;
        columns.find(s, stride * (i + width * j), (stride * k) as i32, B::WANT, near);
        counts.corners += 1;
        self.scene.blend.value(s, near, columns.particles())
    }
}

/// What vertices need of the nodes beside them.
struct Shade<'a, B, K: Skin> {
    scene: &'a Scene<'a, B, K>,
    grid: Grid,
    scratch: &'a mut Scratch,
    nodes: &'a NodeSet,
    to: &'a mut Samples<K::Corner>,
}

impl<B: Blend, K: Skin> Kernel for Shade<'_, B, K> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { scene, grid, scratch, nodes, to } = self;
        let (stride, pitch) = (grid.stride as usize, grid.n + 1);
        let width = grid.n * stride + 1;
        let want = Want { who: true, ..B::WANT };
        for (row, &set) in nodes.iter().enumerate() {
            let (j, k) = (row % pitch, row / pitch);
            for i in ones(set) {
                let Scratch { columns, near, slopes, counts, .. } = &mut *scratch;
                columns.find(s, stride * (i + width * j), (stride * k) as i32, want, near);
                let (at, node, particles) = (grid.place([i, j, k]), grid.node([i, j, k]), columns.particles());
                to.values[at] = scene.blend.value(s, near, particles);
                scene.blend.slopes(s, near, particles, slopes);
                let mut outward = [0.0f32; 3];
                for (slope, who) in slopes.iter().zip(near.who()) {
                    let particle = &particles[who];
                    for a in 0..3 {
                        outward[a] += slope * ((node[a] - particle.node[a]) as f32 - particle.offset[a]);
                    }
                }
                to.outward[at] = outward;
                if scene.shading.data() {
                    to.corners[at] = scene.skin.corner(Neighbours::new(near, particles, node));
                }
                counts.shaded += 1;
            }
        }
        scratch.tally();
    }
}
