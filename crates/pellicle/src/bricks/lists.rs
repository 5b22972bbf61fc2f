//! The particles that reach the bricks of one layer of a block: a two-dimensional insertion, one list a brick.
//!
//! A brick is 4×4×4 nodes of the lattice, 4-aligned in the world. First the bricks are found that a particle's reach touches,
//! and what bounds say of them: where contributions are not negative and never grow with the distance, the field within a
//! brick lies between the sum of what each particle brings at its largest distance from the brick's nodes and the sum of
//! what it brings at its least. Particles are then entered in those bricks alone that this does not decide. Only one
//! layer's lists exist at a time (two while the slabs between them are marched), so that memory follows the area of a layer,
//! not the volume of a block.
//!
//! ```text
//! seen      a particle as the layer sees it, 48 bytes: whole and broken part of x, y; (z − plane)²/R² of the four planes
//! spans     which of the seen, row of bricks, one bit for each brick of the row that it reaches
//! bounds    upper, lower: 16 a row of bricks;  open, inside: one bit a brick
//! range     brick ──► its entries                 (counted while spans are noted: no linked lists)
//! entries   which of the seen
//! ```
//!
//! Within a list entries come in canonical order: by nearest node along z, then by the caller's index. Distances are formed
//! from whole cells, which are exact in any frame, and fractions of a cell apart, so they do not depend on the block that
//! has the brick: a node has the same value in every block, to the last bit. At the block's far faces bricks have but one
//! plane of nodes; they are bounded and entered as what they are.
//!
//! Memory: 48 bytes a particle of the layer, 8 a span, 4 an entry.
//!
//! Source: Rosenberg & Birdwell, Real-time particle isosurface extraction, 2008, section 6, whose last paragraphs propose
//! projections of one slab each; interval bounds are Snyder 1992, Interval analysis for computer graphics. Lists of whole
//! bricks, so that lanes are nodes, are this project's.

use super::boxes::{BOX, MARGIN, SLACK, STARTS};
use crate::{
    field::falloff::Falloff,
    lattice::{BRICK, Coord},
    lookup::columns::{Extent, Near, Placed, provide},
    math::{
        bits::ones,
        simd::{LANES, Simd},
    },
};

/// Nodes of a brick along an axis.
pub(crate) const SIDE: usize = BRICK as usize;
const _: () = assert!(SIDE == BOX, "bricks begin where boxes do");

/// More than the end of a reach within a block is off by rounding, in cells.
const CLOSE: f32 = 1e-3;

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

/// The bricks of one row that one of the seen reaches.
#[derive(Debug, Clone, Copy)]
struct Span {
    seen: u32,
    row: u16,
    bricks: u16,
}

/// How much room the largest layer so far needed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Room {
    entries: usize,
    seen: usize,
    spans: usize,
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
            entries: self.entries.max(other.entries),
            seen: self.seen.max(other.seen),
            spans: self.spans.max(other.spans),
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

/// The lists of one layer. Reusable: [`begin`](Self::begin) keeps the memory.
#[derive(Default)]
pub(crate) struct Lists {
    /// Bricks along x and y, and the layer's first node.
    count: [usize; 2],
    first: Coord,
    /// Coordinate of a brick's last node, counted from its first: along x brick by brick, along y of the last row, along z.
    last_x: [f32; LANES],
    last_y: f32,
    last_z: f32,
    seen: Vec<Seen>,
    spans: Vec<Span>,
    upper: Vec<f32>,
    lower: Vec<f32>,
    /// How many reach each brick: 16 a row.
    reaching: Vec<f32>,
    /// For each row of bricks: those that bounds do not decide, and those that are inside for certain.
    pub(crate) open: Vec<u16>,
    pub(crate) inside: Vec<u16>,
    range: Vec<[u32; 2]>,
    /// Entries in use; the array behind them may be longer.
    len: usize,
    entries: Vec<u32>,
    longest: usize,
}

/// One brick's list.
#[derive(Clone, Copy)]
pub(crate) struct List<'a> {
    /// In canonical order, which of the seen.
    pub(crate) entries: &'a [u32],
    pub(crate) seen: &'a [Seen],
    /// The brick's first node along x and y, from the block's.
    pub(crate) first: [f32; 2],
}

impl Lists {
    /// Finds what reaches the bricks of layer `layer` of a block, decides by bounds what can be decided, and makes lists for
    /// the other bricks. Without a falloff nothing is decided.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "the layer, the field and the particles, each in two parts")]
    pub(crate) fn begin<S: Simd, W: Falloff>(
        &mut self,
        s: S,
        falloff: Option<&W>,
        iso: f32,
        extent: Extent,
        layer: usize,
        particles: &[Placed],
        heights: &Heights,
    ) {
        self.clear(extent, layer);
        for &i in heights.of_layer(layer) {
            self.touch(s, falloff, i, &particles[i as usize]);
        }
        let all = ((1u32 << self.count[0]) - 1) as u16;
        for row in 0..self.count[1] {
            if falloff.is_some() && self.open[row] != 0 {
                let (upper, lower) = (s.load(&self.upper[LANES * row..]), s.load(&self.lower[LANES * row..]));
                self.open[row] &= s.gt(upper, s.splat(iso * (1.0 - MARGIN)));
                self.inside[row] = self.open[row] & s.gt(lower, s.splat(iso * (1.0 + MARGIN)));
                self.open[row] &= !self.inside[row];
            }
            self.open[row] &= all;
            self.inside[row] &= all;
        }
        let open = std::mem::take(&mut self.open);
        self.add(&open);
        self.open = open;
    }

    fn clear(&mut self, extent: Extent, layer: usize) {
        let last = |a: usize, brick: usize| (SIDE.min(extent.nodes[a] - SIDE * brick) - 1) as f32;
        let [width, rows] = [0, 1].map(|a| extent.nodes[a].div_ceil(SIDE));
        (self.count, self.first) = ([width, rows], extent.first);
        self.first[2] += (SIDE * layer) as i32;
        self.last_x = [last(0, 0); LANES];
        self.last_x[width - 1] = last(0, width - 1);
        (self.last_y, self.last_z) = (last(1, rows - 1), last(2, layer));
        self.seen.clear();
        self.spans.clear();
        for sums in [&mut self.upper, &mut self.lower, &mut self.reaching] {
            sums.clear();
            sums.resize(LANES * rows, 0.0);
        }
        for bits in [&mut self.open, &mut self.inside] {
            bits.clear();
            bits.resize(rows, 0);
        }
        self.range.clear();
        self.range.resize(width * rows, [0; 2]);
        (self.len, self.longest) = (0, 0);
    }

    /// Notes the bricks that a particle reaches, and adds it to their bounds.
    #[inline(always)]
    fn touch<S: Simd, W: Falloff>(&mut self, s: S, falloff: Option<&W>, index: u32, p: &Placed) {
        let [x, y, z] = position(p, self.first);
        let reach_sq = p.reach * p.reach;
        let [near_z, far_z] = squares(z, self.last_z);
        if near_z >= reach_sq {
            return;
        }
        let (seen, side) = (self.seen.len() as u32, SIDE as f32);
        // Rows that are reached for certain, and perhaps one more where it is close.
        let along_y = (reach_sq - near_z).sqrt() + CLOSE;
        let low = ((y - along_y + 1.0) / side).max(0.0) as usize;
        let high = (((y + along_y) / side + 1.0).max(0.0) as usize).min(self.count[1]);
        let (zero, one) = (s.splat(0.0), s.splat(1.0));
        let x = s.sub(s.splat(x), s.load(&STARTS));
        let beyond = s.sub(x, s.load(&self.last_x));
        let near = s.max(s.sub(s.max(s.sub(zero, x), beyond), s.splat(SLACK)), zero);
        let far = s.add(s.max(x, s.sub(zero, beyond)), s.splat(SLACK));
        let (near, far) = (s.mul(near, near), s.mul(far, far));
        let (reach, per_reach_sq, strength) = (s.splat(reach_sq), s.splat(1.0 / reach_sq), s.splat(p.strength));
        for row in low..high {
            let last = if row + 1 == self.count[1] { self.last_y } else { (SIDE - 1) as f32 };
            let [near_y, far_y] = squares(y - (SIDE * row) as f32, last);
            let near = s.add(near, s.splat(near_y + near_z));
            let bricks = s.gt(reach, near);
            if bricks == 0 {
                continue;
            }
            self.spans.push(Span { seen, row: row as u16, bricks });
            self.open[row] |= bricks;
            let lanes = LANES * row..LANES * row + LANES;
            let counts = &mut self.reaching[lanes.clone()];
            s.store(s.add(s.load(counts), s.select(bricks, one, zero)), counts);
            if let Some(falloff) = falloff {
                let sums = &mut self.upper[lanes.clone()];
                let u = s.max(s.sub(one, s.mul(near, per_reach_sq)), zero);
                s.store(s.add(s.load(sums), s.mul(strength, falloff.value(s, u))), sums);
                if far_y + far_z < reach_sq {
                    let far = s.add(far, s.splat(far_y + far_z));
                    let sums = &mut self.lower[lanes];
                    let u = s.max(s.sub(one, s.mul(far, per_reach_sq)), zero);
                    s.store(s.add(s.load(sums), s.mul(strength, falloff.value(s, u))), sums);
                }
            }
        }
        if self.spans.last().is_some_and(|span| span.seen == seen) {
            self.seen.push(Seen::new(index, p, self.first));
        }
    }

    /// Makes lists for bricks, one bit each, row by row, that have none yet, behind those that there are.
    #[inline(always)]
    pub(crate) fn add(&mut self, bricks: &[u16]) {
        let width = self.count[0];
        for (row, &listed) in bricks.iter().enumerate() {
            for column in ones(listed.into()) {
                let count = self.reaching[LANES * row + column] as usize;
                self.range[row * width + column] = [self.len as u32; 2];
                self.len += count;
                self.longest = self.longest.max(count);
            }
        }
        // What is there is not cleared: every entry is written.
        self.entries.resize(self.len.max(self.entries.len()), 0);
        for span in &self.spans {
            let row = usize::from(span.row);
            let mut listed = span.bricks & bricks[row];
            let ranges = &mut self.range[row * width..];
            while listed != 0 {
                let end = &mut ranges[listed.trailing_zeros() as usize][1];
                self.entries[*end as usize] = span.seen;
                *end += 1;
                listed &= listed - 1;
            }
        }
    }

    /// Number of entries.
    pub(crate) fn entries(&self) -> usize {
        self.len
    }

    /// The list of one brick; empty for one that has none.
    #[inline(always)]
    pub(crate) fn list(&self, brick: usize) -> List<'_> {
        let [first, end] = self.range[brick].map(|at| at as usize);
        let width = self.count[0];
        let first_node = [brick % width, brick / width].map(|at| (SIDE * at) as f32);
        List { entries: &self.entries[first..end], seen: &self.seen, first: first_node }
    }

    /// The room that the present layer needs.
    pub(crate) fn room(&self, heights: &Heights) -> Room {
        Room {
            entries: self.len,
            seen: self.seen.len(),
            spans: self.spans.len(),
            bricks: self.range.len(),
            rows: self.open.len(),
            particles: heights.order.len(),
            bins: heights.bins.len(),
            longest: self.longest,
        }
    }

    /// Makes room, so that layers as large need no allocation.
    pub(crate) fn provide(&mut self, room: &Room) {
        for v in [&mut self.upper, &mut self.lower, &mut self.reaching] {
            provide(v, LANES * room.rows);
        }
        for v in [&mut self.open, &mut self.inside] {
            provide(v, room.rows);
        }
        provide(&mut self.range, room.bricks);
        provide(&mut self.entries, room.entries);
        provide(&mut self.seen, room.seen);
        provide(&mut self.spans, room.spans);
    }

    /// Bytes in use, for the present layer.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.seen[..])
            + size_of_val(&self.spans[..])
            + 4 * (self.len + self.upper.len() + self.lower.len() + self.reaching.len())
            + size_of_val(&self.range[..])
            + 4 * self.open.len()
    }
}

impl List<'_> {
    /// Finds the particles that reach one node of the brick.
    pub(crate) fn find(&self, node: [usize; 3], near: &mut Near) {
        near.clear();
        for &i in self.entries {
            let seen = &self.seen[i as usize];
            let [dx, dy] = [0, 1].map(|a| (self.first[a] + node[a] as f32 - seen.node[a]) - seen.offset[a]);
            let u = 1.0 - (dx * dx + dy * dy) * seen.per_reach_sq - seen.rest[node[2]];
            if u > 0.0 {
                near.push(u, seen.strength, seen.who);
            }
        }
    }
}

/// Where a particle is from a node, in cells.
#[inline(always)]
fn position(p: &Placed, from: Coord) -> [f32; 3] {
    [0, 1, 2].map(|a| (p.node[a] - from[a]) as f32 + p.offset[a])
}

/// Squares of the least and the largest distance along an axis from nodes 0 to `last`, a little too small and large.
#[inline(always)]
fn squares(at: f32, last: f32) -> [f32; 2] {
    let (near, far) = (((-at).max(at - last) - SLACK).max(0.0), at.max(last - at) + SLACK);
    [near * near, far * far]
}

#[cfg(test)]
mod tests;
