//! The particles that reach the bricks of one layer of a block: a two-dimensional insertion, one list a brick.
//!
//! A brick is 4×4×4 nodes of the lattice, 4-aligned in the world. Every particle is tried against 4×4 bricks at once and
//! entered in those that it reaches. Only one layer's lists exist at a time (two while the slabs between them are marched),
//! so that memory follows the area of a layer, not the volume of a block.
//!
//! ```text
//! seen      a particle as the layer sees it, 48 bytes: whole and broken part of x, y; (z − plane)²/R² of the four planes
//! touches   which of 4×4 bricks one of the seen reaches, a few of them, before they are entered
//! chains    brick ──► its first piece, how many it has, and where the next entry goes
//! pieces    16 entries, each one of the seen;  next: the piece behind it
//! ```
//!
//! Within a list entries come in canonical order: by nearest node along z, then by the caller's index. Distances are formed
//! from whole cells, which are exact in any frame, and fractions of a cell apart, so they do not depend on the block that
//! has the brick: a node has the same value in every block, to the last bit. At the block's far faces bricks have but one
//! plane of nodes, and are entered as what they are.
//!
//! Nothing is bounded first: for each particle and brick, bounds by the least and the largest distance cost as much as the
//! values of all 64 nodes, whose lanes are full.
//!
//! Memory: 48 bytes a particle of the layer, 68 for every 16 entries of a brick begun.
//!
//! Source: Rosenberg & Birdwell, Real-time particle isosurface extraction, 2008, section 6, whose last paragraphs propose
//! projections of one slab each. Lists of whole bricks, so that lanes are nodes, are this project's.

use crate::{
    lattice::{BRICK, Coord},
    lookup::columns::{Extent, Near, Placed, provide},
    math::simd::{LANES, Simd},
};

/// Nodes of a brick along an axis.
pub(crate) const SIDE: usize = BRICK as usize;

/// More than a distance within a block is off by rounding, in cells.
const CLOSE: f32 = 1e-4;

/// Where 4×4 bricks begin along x and y, from the first.
const ACROSS_X: [f32; LANES] = across(1);
const ACROSS_Y: [f32; LANES] = across(SIDE);

const fn across(step: usize) -> [f32; LANES] {
    let mut to = [0.0; LANES];
    let mut lane = 0;
    while lane < LANES {
        to[lane] = (SIDE * (lane / step % SIDE)) as f32;
        lane += 1;
    }
    to
}

/// One particle as the bricks of a layer see it, lengths in cells.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Seen {
    /// Its nearest node along x and y, from the block's first: whole numbers.
    node: [f32; 2],
    /// From there.
    offset: [f32; 2],
    /// From the layer's first plane.
    pub(crate) z: f32,
    pub(crate) per_reach_sq: f32,
    pub(crate) strength: f32,
    who: u32,
    /// Square of the distance along z from each plane of nodes, in reaches.
    pub(crate) rest: [f32; SIDE],
}

impl Seen {
    #[inline(always)]
    fn new(who: u32, p: &Placed, first: Coord) -> Self {
        let [x, y, z] = [0, 1, 2].map(|a| (p.node[a] - first[a]) as f32);
        let (z, per_reach_sq) = (z + p.offset[2], 1.0 / (p.reach * p.reach));
        let mut rest = [0.0; SIDE];
        for (plane, rest) in rest.iter_mut().enumerate() {
            let dz = plane as f32 - z;
            *rest = dz * dz * per_reach_sq;
        }
        let offset = [p.offset[0], p.offset[1]];
        Self { node: [x, y], offset, z, per_reach_sq, strength: p.strength, who, rest }
    }

    /// What is left along an axis (x, y) from here to 16 nodes, given by whole numbers from the block's first.
    #[inline(always)]
    pub(crate) fn away<S: Simd>(&self, s: S, nodes: S::F, axis: usize) -> S::F {
        s.sub(s.sub(nodes, s.splat(self.node[axis])), s.splat(self.offset[axis]))
    }
}

/// A block's particles in canonical order, to be found by height.
#[derive(Default)]
pub(crate) struct Heights {
    order: Vec<u32>,
    bins: Vec<u32>,
    /// Most cells between a node and the nearest node of a particle that reaches it.
    reach: i32,
}

impl Heights {
    /// Counting sort by nearest node along z; stable, and `of` comes by the caller's index.
    pub(crate) fn sort(&mut self, extent: Extent, particles: &[Placed], of: &[u32]) {
        let reach = of.iter().fold(0.0f32, |most, &i| most.max(particles[i as usize].reach));
        // Half a cell nearer than its nearest node at most, and nothing at the end of its reach.
        self.reach = (reach + 0.5).ceil() as i32 - 1;
        let bins = extent.nodes[2] + 2 * self.reach as usize;
        let lowest = extent.first[2] - self.reach;
        let bin = |i: u32| ((particles[i as usize].node[2] - lowest).max(0) as usize).min(bins - 1);
        self.bins.clear();
        self.bins.resize(bins + 1, 0);
        for &i in of {
            self.bins[bin(i) + 1] += 1;
        }
        for b in 1..=bins {
            self.bins[b] += self.bins[b - 1];
        }
        self.order.clear();
        self.order.resize(of.len(), 0);
        for &i in of {
            let at = &mut self.bins[bin(i)];
            self.order[*at as usize] = i;
            *at += 1;
        }
        // Every bin now ends where it did; the next one begins there.
        self.bins.rotate_right(1);
        self.bins[0] = 0;
    }

    /// The particles that may reach a layer of bricks, in canonical order.
    fn of_layer(&self, layer: usize) -> &[u32] {
        let bins = self.bins.len() - 1;
        // Bins count from `reach` cells below the block.
        let low = (SIDE * layer).min(bins);
        let high = (SIDE * (layer + 1) + 2 * self.reach as usize).min(bins);
        &self.order[self.bins[low] as usize..self.bins[high] as usize]
    }

    /// Makes room, so that blocks as large need no allocation.
    pub(crate) fn provide(&mut self, room: &Room) {
        provide(&mut self.order, room.particles);
        provide(&mut self.bins, room.bins);
    }

    /// Bytes in use, for the present block.
    pub(crate) fn bytes(&self) -> usize {
        4 * (self.order.len() + self.bins.len())
    }
}

/// How much room the largest layer so far needed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Room {
    pieces: usize,
    seen: usize,
    bricks: usize,
    rows: usize,
    particles: usize,
    bins: usize,
    longest: usize,
}

impl Room {
    /// Room for both.
    pub(crate) fn join(&self, other: &Self) -> Self {
        Self {
            pieces: self.pieces.max(other.pieces),
            seen: self.seen.max(other.seen),
            bricks: self.bricks.max(other.bricks),
            rows: self.rows.max(other.rows),
            particles: self.particles.max(other.particles),
            bins: self.bins.max(other.bins),
            longest: self.longest.max(other.longest),
        }
    }

    /// Most particles of a brick.
    pub(crate) fn longest(&self) -> usize {
        self.longest
    }
}

/// Entries of a piece of a list.
const PIECE: usize = 16;

/// One brick's list: pieces, each with the number of the next one.
#[derive(Debug, Clone, Copy, Default)]
struct Chain {
    head: u32,
    /// Where the next entry goes, among all pieces' entries: the end of a piece when that is full, and at first.
    end: u32,
    pieces: u32,
}

impl Chain {
    /// Number of entries.
    #[inline(always)]
    fn len(&self) -> usize {
        match self.pieces {
            0 => 0,
            pieces => (pieces as usize - 1) * PIECE + (self.end as usize - 1) % PIECE + 1,
        }
    }
}

/// The lists of one layer. Reusable: [`begin`](Self::begin) keeps the memory.
#[derive(Default)]
pub(crate) struct Lists {
    /// Bricks along x.
    width: u32,
    /// The layer's first node, and its last, counted from there.
    first: Coord,
    last: Coord,
    seen: Vec<Seen>,
    chains: Vec<Chain>,
    pieces: Vec<[u32; PIECE]>,
    /// For each piece, the one behind it.
    next: Vec<u32>,
    /// For each row of bricks, those that a particle reaches.
    pub(crate) reached: Vec<u16>,
}

/// One brick's list: in canonical order, which of the seen.
#[derive(Clone, Copy)]
pub(crate) struct List<'a> {
    chain: Chain,
    pieces: &'a [[u32; PIECE]],
    next: &'a [u32],
    pub(crate) seen: &'a [Seen],
    /// The brick's first node along x and y, from the block's.
    pub(crate) first: [f32; 2],
}

/// Most touches that are noted before they are entered.
const TOUCHES: usize = 32;

/// Which of 4×4 bricks, at least one, a particle reaches; the first of the sixteen; which of the seen.
#[derive(Debug, Clone, Copy, Default)]
struct Touch {
    bricks: u32,
    first: u32,
    seen: u32,
}

/// Touches to be entered, and how many bricks they have.
#[derive(Default)]
struct Touches {
    list: [Touch; TOUCHES],
    len: usize,
    bricks: u32,
}

/// Goes over a list, a piece at a time.
pub(crate) struct Pieces<'a> {
    list: List<'a>,
}

impl<'a> Iterator for Pieces<'a> {
    type Item = &'a [u32];

    #[inline(always)]
    fn next(&mut self) -> Option<&'a [u32]> {
        let Chain { head, end, pieces } = &mut self.list.chain;
        *pieces = pieces.checked_sub(1)?;
        let piece = *head as usize;
        *head = self.list.next[piece];
        let here = if *pieces == 0 { (*end as usize - 1) % PIECE + 1 } else { PIECE };
        Some(&self.list.pieces[piece][..here])
    }
}

impl Lists {
    /// Finds what reaches the bricks of layer `layer` of a block.
    #[inline(always)]
    pub(crate) fn begin<S: Simd>(
        &mut self,
        s: S,
        extent: Extent,
        layer: usize,
        particles: &[Placed],
        heights: &Heights,
    ) {
        let [width, rows] = [0, 1].map(|a| extent.nodes[a].div_ceil(SIDE));
        (self.width, self.first, self.last) = (width as u32, extent.first, extent.nodes.map(|nodes| nodes as i32 - 1));
        self.first[2] += (SIDE * layer) as i32;
        self.last[2] = (self.last[2] - (SIDE * layer) as i32).min(BRICK - 1);
        self.seen.clear();
        self.pieces.clear();
        self.next.clear();
        self.chains.clear();
        self.chains.resize(width * rows, Chain::default());
        self.reached.clear();
        self.reached.resize(rows, 0);
        let mut touches = Touches::default();
        for &i in heights.of_layer(layer) {
            self.touch(s, &mut touches, heights.reach, i, &particles[i as usize]);
        }
        self.enter(&mut touches);
    }

    /// Notes the bricks that a particle reaches, 4×4 of which are one vector; it reaches no node more than `nodes` from its own.
    #[inline(always)]
    fn touch<S: Simd>(&mut self, s: S, touches: &mut Touches, nodes: i32, index: u32, p: &Placed) {
        let seen = Seen::new(index, p, self.first);
        // A little more than its reach, which makes up for all rounding.
        let reach = p.reach + CLOSE;
        let near_z = (-seen.z).max(seen.z - self.last[2] as f32).max(0.0);
        let left = reach * reach - near_z * near_z;
        if left <= 0.0 {
            return;
        }
        let number = self.seen.len() as u32;
        self.seen.push(seen);
        let left = s.splat(left);
        let at = [0, 1].map(|a| p.node[a] - self.first[a]);
        let [first_column, first_row] = at.map(|at| (at - nodes).max(0) / BRICK);
        let [columns, rows] = [0, 1].map(|a| ((at[a] + nodes).min(self.last[a]) + BRICK) / BRICK);
        for row in (first_row..rows).step_by(SIDE) {
            let near_y = near(s, &ACROSS_Y, at[1] - BRICK * row, p.offset[1], self.last[1] - BRICK * row);
            let those = 0xffffu32 >> (4 * (4 - (rows - row).min(4)));
            for column in (first_column..columns).step_by(SIDE) {
                let near_x = near(s, &ACROSS_X, at[0] - BRICK * column, p.offset[0], self.last[0] - BRICK * column);
                let those = those & (0x1111 * ((1u32 << (columns - column).min(4)) - 1));
                let bricks = u32::from(s.gt(left, s.add(near_x, near_y))) & those;
                let first = column as u32 + self.width * row as u32;
                touches.list[touches.len % TOUCHES] = Touch { bricks, first, seen: number };
                touches.len += usize::from(bricks != 0);
                touches.bricks += bricks.count_ones();
                if touches.len == TOUCHES {
                    self.enter(touches);
                }
            }
        }
    }

    /// Enters the particles in the lists of the bricks that they reach. Bricks come one by one, whosesoever they are: a loop
    /// over each particle's would end where nobody can foretell.
    #[inline(never)]
    fn enter(&mut self, touches: &mut Touches) {
        let across: [u32; LANES] = std::array::from_fn(|lane| (lane % SIDE) as u32 + self.width * (lane / SIDE) as u32);
        let (mut at, mut touch) = (0, touches.list[0]);
        for _ in 0..touches.bricks {
            let brick = touch.first + across[touch.bricks.trailing_zeros() as usize % LANES];
            let mut end = self.chains[brick as usize].end as usize;
            if end.is_multiple_of(PIECE) {
                end = self.begin_piece(brick);
            }
            self.pieces.as_flattened_mut()[end] = touch.seen;
            self.chains[brick as usize].end = end as u32 + 1;
            touch.bricks &= touch.bricks - 1;
            let done = touch.bricks == 0;
            at += usize::from(done);
            let then = touches.list[at % TOUCHES];
            touch = if done { then } else { touch };
        }
        (touches.len, touches.bricks) = (0, 0);
    }

    /// Gives a brick's list a further piece. Gives where that begins.
    #[inline(never)]
    fn begin_piece(&mut self, brick: u32) -> usize {
        let (chain, piece) = (&mut self.chains[brick as usize], self.next.len());
        match chain.pieces {
            0 => {
                chain.head = piece as u32;
                self.reached[(brick / self.width) as usize] |= 1 << (brick % self.width);
            }
            _ => self.next[chain.end as usize / PIECE - 1] = piece as u32,
        }
        chain.pieces += 1;
        self.pieces.push([0; PIECE]);
        self.next.push(0);
        piece * PIECE
    }

    /// Number of entries.
    pub(crate) fn entries(&self) -> usize {
        self.chains.iter().map(Chain::len).sum()
    }

    /// The list of one brick.
    #[inline(always)]
    pub(crate) fn list(&self, brick: usize) -> List<'_> {
        let width = self.width as usize;
        let first = [brick % width, brick / width].map(|at| (SIDE * at) as f32);
        List { chain: self.chains[brick], pieces: &self.pieces, next: &self.next, seen: &self.seen, first }
    }

    /// The room that the present layer needs.
    pub(crate) fn room(&self, heights: &Heights) -> Room {
        Room {
            pieces: self.pieces.len(),
            seen: self.seen.len(),
            bricks: self.chains.len(),
            rows: self.reached.len(),
            particles: heights.order.len(),
            bins: heights.bins.len(),
            longest: self.chains.iter().map(Chain::len).max().unwrap_or(0),
        }
    }

    /// Makes room, so that layers as large need no allocation.
    pub(crate) fn provide(&mut self, room: &Room) {
        provide(&mut self.pieces, room.pieces);
        provide(&mut self.next, room.pieces);
        provide(&mut self.seen, room.seen);
        provide(&mut self.chains, room.bricks);
        provide(&mut self.reached, room.rows);
    }

    /// Bytes in use, for the present layer.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.seen[..])
            + size_of_val(&self.pieces[..])
            + size_of_val(&self.next[..])
            + size_of_val(&self.chains[..])
            + size_of_val(&self.reached[..])
    }
}

impl<'a> List<'a> {
    /// Its entries, some at a time.
    #[inline(always)]
    pub(crate) fn pieces(&self) -> Pieces<'a> {
        Pieces { list: *self }
    }

    /// How many particles.
    #[inline(always)]
    pub(crate) fn len(&self) -> usize {
        self.chain.len()
    }
}

impl List<'_> {
    /// Finds the particles that reach one node of the brick.
    pub(crate) fn find(&self, node: [usize; 3], near: &mut Near) {
        near.clear();
        for &i in self.pieces().flatten() {
            let seen = &self.seen[i as usize];
            let [dx, dy] = [0, 1].map(|a| (self.first[a] + node[a] as f32 - seen.node[a]) - seen.offset[a]);
            let u = 1.0 - (dx * dx + dy * dy) * seen.per_reach_sq - seen.rest[node[2]];
            if u > 0.0 {
                near.push(u, seen.strength, seen.who);
            }
        }
    }
}

/// Squares of the least distances along an axis from 16 bricks, whose first nodes are given, to `node` and `offset`; the last
/// brick ends at `last`.
#[inline(always)]
fn near<S: Simd>(s: S, firsts: &[f32; LANES], node: i32, offset: f32, last: i32) -> S::F {
    let (at, firsts) = (s.splat(node as f32 + offset), s.load(firsts));
    let lasts = s.min(s.add(firsts, s.splat((SIDE - 1) as f32)), s.splat(last as f32));
    let near = s.max(s.max(s.sub(firsts, at), s.sub(at, lasts)), s.splat(0.0));
    s.mul(near, near)
}

#[cfg(test)]
mod tests;
