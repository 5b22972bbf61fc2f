//! Marching layers: the whole surface of one block, a layer of bricks at a time, with what is known of two layers.
//!
//! ```text
//! layer + 1   ┌────┬────┐   lists of particles, sides of nodes
//! layer       │    │    │   lists, sides, values, outward vectors; then the four slabs of cells between, one by one
//!             └────┴────┘
//! slab z      two slices' vertex numbers (x, y) and those between them (z); cells to do: one bit each
//! ```
//!
//! A brick is 4×4×4 nodes. The particles that reach a layer's bricks are entered in one list a brick
//! ([`lists`](crate::bricks::lists)), and all nodes of bricks that have any are evaluated, 16 at a time. So nothing is missed,
//! no cube need be followed from another, and a block needs no margin.
//!
//! Then the layer below is finished: the nodes at ends of crossed edges are found by shift and exclusive-or of the bricks'
//! bits; those get values, outward vectors and user data, whole planes of a brick at once; then each of its four slabs gets
//! its vertices, 16 at a time, and its cells' triangles, in the viewer's order if there is one. Rows of bricks that no edge
//! is crossed in are passed by.
//!
//! Source: Rosenberg & Birdwell, Real-time particle isosurface extraction, 2008: slices, todo lists and vertices shared
//! between cubes from section 4, order from section 5, projections of single slabs from section 6. The complete search, and
//! layers of bricks whose nodes are lanes, are this project's.

mod bricks;
mod fill;
mod shade;
mod sides;
mod triangles;
mod vertices;

use crate::{
    bricks::lists::{Heights, Room, SIDE},
    lookup::columns::{Extent, Near, provide},
    march::slices::{Blend, Lap, March, Rows, Skin, Todo, WIDEST},
    math::simd::{Kernel, LANES, Simd},
};
use bricks::Bricks;
use fill::NODES;
use sides::LOWEST;
use triangles::ROW;
use vertices::{Ends, Places};

/// Slices whose bits are kept: two layers'.
const RING: usize = 2 * SIDE;
/// Triangles from which on a slab's end is a time to drain: often enough that a piece stays small, rarely enough to cost nothing.
const DRAINED: usize = 512;
/// Most slabs between two slices that share vertices: their numbers are kept for two slices along x and y, and between.
const NUMBERED: usize = 5;

/// What one thread needs to march: kept between blocks and frames.
pub(crate) struct Work<C> {
    heights: Heights,
    /// By the layer's parity.
    layers: [Bricks<C>; 2],
    /// Nodes that are inside, of the last slices.
    inside: [Rows; RING],
    /// Numbers of vertices, by the edge's lower node: along x, y of the even slice, of the odd one, along z between.
    numbers: Vec<u32>,
    ends: Ends,
    places: Places,
    /// Triangles on their way into the piece. Kept, since zeroing as many for each slab costs more than to make them.
    triangles: Vec<[u32; 3]>,
    todo: Todo,
    near: Near,
    slopes: Vec<f32>,
    needs: Needs,
}

impl<C: Copy + Default> Default for Work<C> {
    fn default() -> Self {
        Self {
            heights: Heights::default(),
            layers: [Bricks::default(), Bricks::default()],
            inside: [[0; WIDEST]; RING],
            numbers: Vec::new(),
            ends: Ends::default(),
            places: [[0.0; WIDEST]; 3],
            triangles: vec![[0; 3]; 2 * ROW],
            todo: Todo::default(),
            near: Near::default(),
            slopes: Vec::new(),
            needs: Needs::default(),
        }
    }
}

/// How much room the largest block so far needed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Needs {
    room: Room,
    nodes: usize,
    bricks: usize,
    /// Bricks with values, and with shades.
    used: [usize; 2],
    corners: usize,
}

impl Needs {
    /// Room for both.
    pub(crate) fn join(&self, other: &Self) -> Self {
        Self {
            room: self.room.join(&other.room),
            nodes: self.nodes.max(other.nodes),
            bricks: self.bricks.max(other.bricks),
            used: [0, 1].map(|i| self.used[i].max(other.used[i])),
            corners: self.corners.max(other.corners),
        }
    }
}

impl<C: Copy + Default> Work<C> {
    /// The most that any block needed here.
    pub(crate) fn needs(&self) -> Needs {
        self.needs
    }

    /// Makes room, so that whichever thread gets the largest block allocates nothing.
    pub(crate) fn provide(&mut self, needs: &Needs) {
        if self.needs == *needs {
            return;
        }
        self.needs = *needs;
        self.heights.provide(&needs.room);
        for layer in &mut self.layers {
            layer.lists.provide(&needs.room);
            layer.provide(needs.bricks, needs.used, needs.corners);
        }
        provide(&mut self.numbers, NUMBERED * needs.nodes);
        self.near.provide(needs.room.longest() + 2 * LANES);
        provide(&mut self.slopes, needs.room.longest() + 2 * LANES);
    }
}

impl<B: Blend, K: Skin> Kernel for March<'_, B, K, Work<K::Corner>> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(mut self, s: S) {
        self.piece.clear();
        let mut lap = Lap::new(self.scene.clock);
        let extent = Extent { first: self.first, nodes: self.seam.cells.map(|cells| cells + 1) };
        self.work.heights.sort(extent, self.scene.particles, self.members);
        self.work.numbers.resize(NUMBERED * extent.nodes[0] * extent.nodes[1], 0);
        self.find_places(extent);
        let layers = extent.nodes[2].div_ceil(SIDE);
        for layer in 0..layers {
            self.enter(s, extent, layer);
            self.piece.times.enter += lap.next();
            self.find_sides(s, extent, layer);
            self.piece.times.seed += lap.next();
            if layer > 0 {
                self.finish(s, extent, layer - 1);
            }
            self.tally(extent, layer);
            self.piece.times.march += lap.next();
        }
        // The last layer has slabs of its own, unless only the nodes of the block's highest face are in it.
        if SIDE * (layers - 1) < self.seam.cells[2] {
            self.clear(extent, layers);
            self.finish(s, extent, layers - 1);
        }
        self.piece.shared.sort_unstable();
        self.piece.times.march += lap.next();
    }
}

/// Bricks of a layer along x and y.
#[inline(always)]
fn bricks_of(extent: Extent) -> [usize; 2] {
    [extent.nodes[0].div_ceil(SIDE), extent.nodes[1].div_ceil(SIDE)]
}

/// The brick of a layer that holds a node, and the node's place in it.
#[inline(always)]
fn place(width: usize, [x, y, z]: [usize; 3]) -> (usize, usize) {
    (x / SIDE + width * (y / SIDE), x % SIDE + SIDE * (y % SIDE) + SIDE * SIDE * (z % SIDE))
}

impl<B: Blend, K: Skin> March<'_, B, K, Work<K::Corner>> {
    /// User data of a brick's nodes to keep room for.
    fn corners(&self) -> usize {
        if self.scene.shading.data() { NODES } else { 0 }
    }

    /// Enters the particles that reach a layer.
    #[inline(always)]
    fn enter<S: Simd>(&mut self, s: S, extent: Extent, layer: usize) {
        self.clear(extent, layer);
        let (scene, work) = (self.scene, &mut *self.work);
        work.layers[layer % 2].lists.begin(s, extent, layer, scene.particles, &work.heights);
    }

    /// Forgets the layer that had this one's place: all nodes are outside.
    #[inline(always)]
    fn clear(&mut self, extent: Extent, layer: usize) {
        let work = &mut *self.work;
        let here = &mut work.layers[layer % 2];
        if here.rows != 0 {
            for z in SIDE * layer..SIDE * (layer + 1) {
                work.inside[z % RING] = [0; WIDEST];
            }
        }
        here.begin(bricks_of(extent).iter().product());
    }

    /// Counts what a layer held, and how much room it needed.
    fn tally(&mut self, extent: Extent, layer: usize) {
        let (bricks, corners) = (bricks_of(extent).iter().product(), self.corners());
        let (work, counts) = (&mut *self.work, &mut self.piece.counts);
        let [even, odd] = &work.layers;
        let here = &work.layers[layer % 2];
        counts.entries += here.lists.entries() as u64;
        let cache = even.lists.bytes() + odd.lists.bytes() + work.heights.bytes();
        counts.cache_bytes = counts.cache_bytes.max(cache as u64);
        let render = even.bytes(corners)
            + odd.bytes(corners)
            + RING * size_of::<Rows>()
            + size_of::<Places>()
            + size_of::<Ends>()
            + 4 * work.numbers.len()
            + size_of_val(&work.triangles[..])
            + size_of::<Todo>();
        counts.render_bytes = counts.render_bytes.max(render as u64);
        let needs = Needs {
            room: here.lists.room(&work.heights),
            nodes: extent.nodes[0] * extent.nodes[1],
            bricks,
            used: [0, 1].map(|i| even.used()[i].max(odd.used()[i])),
            corners,
        };
        work.needs = work.needs.join(&needs);
    }

    /// Makes the vertices and triangles between a layer and the next one, both of whose nodes' sides are known.
    #[inline(always)]
    fn finish<S: Simd>(&mut self, s: S, extent: Extent, layer: usize) {
        let [even, odd] = &self.work.layers;
        if even.rows | odd.rows == 0 {
            return;
        }
        let [here, above] = self.find_needed(extent, layer);
        let mut rows = 0u64;
        for row in 0..bricks_of(extent)[1] {
            rows |= if here[row] | above[row] == 0 { 0 } else { 0b1111 << (SIDE * row) };
        }
        rows &= u64::MAX >> (64 - extent.nodes[1]);
        if rows == 0 {
            return;
        }
        self.prepare(s, extent, layer, &here, u64::MAX);
        self.prepare(s, extent, layer + 1, &above, LOWEST);
        for z in SIDE * layer..(SIDE * (layer + 1)).min(extent.nodes[2] - 1) {
            if z == 0 {
                self.number_slice(s, extent, 0, rows);
            }
            self.number_between(s, extent, z, rows);
            self.number_slice(s, extent, z + 1, rows);
            self.make_vertices(s, extent);
            self.march_slab(extent, z, rows);
            match self.drain.as_mut() {
                Some(drain) if self.piece.triangles.len() >= DRAINED => drain(self.piece),
                _ => {}
            }
        }
        self.piece.counts.live_slices = self.piece.counts.live_slices.max(2);
    }
}
