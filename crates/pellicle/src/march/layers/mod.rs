//! Marching layers: the whole surface of one block, a layer of bricks at a time, with what is known of two layers.
//!
//! ```text
//! layer + 1   ┌────┬────┐   lists of particles, sides of nodes
//! layer       │    │    │   lists, sides, values, outward vectors; then the four slabs of cells between, one by one
//!             └────┴────┘
//! slab z      two slices' vertex numbers (x, y) and those between them (z); cells to do: one bit each
//! ```
//!
//! A brick is 4×4×4 nodes. Bounds prove some bricks of a layer to be on one side; the particles that reach the others are
//! entered in one list a brick ([`lists`](crate::bricks::lists)), and all their nodes are evaluated, 16 at a time. So nothing
//! is missed, no cube need be followed from another, and a block needs no margin.
//!
//! Then the layer below is finished: the nodes at ends of crossed edges are found by shift and exclusive-or of the rows'
//! bits; those get values, outward vectors and user data, whole planes of a brick at once; then each of its four slabs gets
//! its vertices, row by row, and its cells' triangles, in the viewer's order if there is one.
//!
//! Source: Rosenberg & Birdwell, Real-time particle isosurface extraction, 2008: slices, todo lists and vertices shared
//! between cubes from section 4, order from section 5, projections of single slabs from section 6. The complete search, and
//! layers of bricks whose nodes are lanes, are this project's.

mod bricks;
mod fill;
mod shade;
mod vertices;

use crate::{
    bricks::lists::{Heights, Room, SIDE},
    lookup::columns::{Extent, Near, Want, provide},
    march::slices::{Blend, Lap, March, Rows, Skin, Todo, WIDEST},
    math::{
        bits::ones,
        simd::{Kernel, LANES, Simd},
    },
};
use bricks::Bricks;
use fill::NODES;

/// Slices whose bits are kept: two layers'.
const RING: usize = 2 * SIDE;
/// Most slabs between two slices that share vertices: their numbers are kept for two slices along x and y, and between.
const NUMBERED: usize = 5;

/// What one thread needs to march: kept between blocks and frames.
pub(crate) struct Work<C> {
    heights: Heights,
    /// By the layer's parity.
    layers: [Bricks<C>; 2],
    /// Nodes that are inside, and nodes at the ends of crossed edges, of the last slices.
    inside: [Rows; RING],
    needed: [Rows; RING],
    /// Numbers of vertices, by the edge's lower node: along x, y of the even slice, of the odd one, along z between.
    numbers: Vec<u32>,
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
            needed: [[0; WIDEST]; RING],
            numbers: Vec::new(),
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
    shades: usize,
    corners: usize,
}

impl Needs {
    /// Room for both.
    pub(crate) fn join(&self, other: &Self) -> Self {
        Self {
            room: self.room.join(&other.room),
            nodes: self.nodes.max(other.nodes),
            bricks: self.bricks.max(other.bricks),
            shades: self.shades.max(other.shades),
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
            layer.provide(needs.bricks, needs.shades, needs.corners);
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
        self.piece.shared.sort_unstable();
        self.piece.times.march += lap.next();
    }
}

/// Bricks of a layer along x and y.
fn bricks_of(extent: Extent) -> [usize; 2] {
    [0, 1].map(|a| extent.nodes[a].div_ceil(SIDE))
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
        let bricks: usize = bricks_of(extent).iter().product();
        let want = Want { varied: B::WANT.varied, who: B::WANT.who || self.scene.shading.data() };
        let (scene, work) = (self.scene, &mut *self.work);
        let here = &mut work.layers[layer % 2];
        here.begin(bricks);
        let (lists, falloff) = (&mut here.lists, scene.blend.falloff());
        lists.begin(s, falloff, scene.iso, extent, layer, scene.particles, &work.heights, want);
        for z in SIDE * layer..SIDE * (layer + 1) {
            work.inside[z % RING] = [0; WIDEST];
            work.needed[z % RING] = [0; WIDEST];
        }
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
            + 2 * RING * size_of::<Rows>()
            + 4 * work.numbers.len()
            + size_of::<Todo>();
        counts.render_bytes = counts.render_bytes.max(render as u64);
        let needs = Needs {
            room: here.lists.room(&work.heights),
            nodes: extent.nodes[0] * extent.nodes[1],
            bricks,
            shades: even.shades().max(odd.shades()),
            corners,
        };
        work.needs = work.needs.join(&needs);
    }

    /// Finds the side of every node of a layer: by bounds, or by its value.
    #[inline(always)]
    fn find_sides<S: Simd>(&mut self, s: S, extent: Extent, layer: usize) {
        let [width, rows] = bricks_of(extent);
        for row in 0..rows {
            let lists = &self.work.layers[layer % 2].lists;
            let (open, certain) = (lists.open[row], lists.inside[row]);
            self.piece.counts.bounds += u64::from(open.count_ones() + certain.count_ones());
            for column in ones((open | certain).into()) {
                let brick = row * width + column;
                let is_open = open >> column & 1 == 1;
                let inside = if is_open { self.fill(s, extent, layer, brick) } else { u64::MAX };
                self.work.layers[layer % 2].inside[brick] = inside;
                for line in 0..if inside == 0 { 0 } else { SIDE * SIDE } {
                    let bits = inside >> (SIDE * line) & 0b1111;
                    let slice = &mut self.work.inside[(SIDE * layer + line / SIDE) % RING];
                    slice[SIDE * row + line % SIDE] |= bits << (SIDE * column);
                }
            }
        }
    }

    /// Makes the vertices and triangles between a layer and the next one, both of whose nodes' sides are known.
    #[inline(always)]
    fn finish<S: Simd>(&mut self, s: S, extent: Extent, layer: usize) {
        if !self.find_needed(extent, layer) {
            return;
        }
        self.prepare(s, extent, layer, u64::MAX);
        self.prepare(s, extent, layer + 1, (1 << LANES) - 1);
        for z in SIDE * layer..SIDE * (layer + 1) {
            if z == 0 {
                self.number_slice(extent, 0);
            }
            self.number_between(extent, z);
            self.number_slice(extent, z + 1);
            self.march_slab(extent, z);
        }
        self.piece.counts.live_slices = self.piece.counts.live_slices.max(2);
    }

    /// Notes the nodes at the ends of crossed edges that are new with the layer above. Whether there are any.
    fn find_needed(&mut self, extent: Extent, layer: usize) -> bool {
        let [width, height, _] = extent.nodes;
        let (nodes, cells) = (u64::MAX >> (64 - width), u64::MAX >> (65 - width));
        let Work { inside, needed, .. } = &mut *self.work;
        let mut any = 0;
        for z in SIDE * layer + usize::from(layer > 0)..=SIDE * (layer + 1) {
            let (inside, needed) = (&inside[z % RING], &mut needed[z % RING]);
            for y in 0..height {
                let row = inside[y];
                let along_x = (row ^ row >> 1) & cells;
                let along_y = if y + 1 < height { (row ^ inside[y + 1]) & nodes } else { 0 };
                needed[y] |= along_x | along_x << 1 | along_y;
                if y + 1 < height {
                    needed[y + 1] |= along_y;
                }
                any |= along_x | along_y;
            }
        }
        for z in SIDE * layer..SIDE * (layer + 1) {
            for y in 0..height {
                let along_z = (inside[z % RING][y] ^ inside[(z + 1) % RING][y]) & nodes;
                needed[z % RING][y] |= along_z;
                needed[(z + 1) % RING][y] |= along_z;
                any |= along_z;
            }
        }
        any != 0
    }

    /// Visits the crossed cells of a slab whose vertices all have numbers.
    #[inline(always)]
    fn march_slab(&mut self, extent: Extent, z: usize) {
        let work = &mut *self.work;
        let (lower, upper) = (&work.inside[z % RING], &work.inside[(z + 1) % RING]);
        let cells = u64::MAX >> (65 - extent.nodes[0]);
        let mut count = 0;
        for y in 0..extent.nodes[1] - 1 {
            let rows = [lower[y], lower[y + 1], upper[y], upper[y + 1]];
            let any = rows[0] | rows[1] | rows[2] | rows[3];
            let all = rows[0] & rows[1] & rows[2] & rows[3];
            let crossed = (any | any >> 1) & !(all & all >> 1) & cells;
            count += crossed.count_ones();
            work.todo.push_row(y, crossed);
        }
        self.piece.counts.cubes += u64::from(count);
        self.piece.counts.visited += u64::from(count);
        self.make_triangles(extent, z);
    }
}
