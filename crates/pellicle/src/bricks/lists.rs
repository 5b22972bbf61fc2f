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
//! spans     particle, row of bricks, one bit for each brick of the row that it reaches
//! bounds    upper, lower: 16 a row of bricks;  open, inside: one bit a brick
//! range     brick ──► its entries                 (counted, then written: no linked lists)
//! entries   x, y, z from the brick's first node in cells, 1/R², and (z − plane)²/R² of the brick's four planes: 32 bytes
//! ```
//!
//! Within a list entries come in canonical order: by nearest node along z, then by the caller's index. Distances are formed
//! from whole cells and fractions of a cell apart, in the frame of the brick, which is the same in every block that has it:
//! a node has the same value in every block, to the last bit.
//!
//! Memory: 32 bytes an entry, 4 more each for strengths and for who it is where these are wanted; 8 a span.
//!
//! Source: Rosenberg & Birdwell, Real-time particle isosurface extraction, 2008, section 6, whose last paragraphs propose
//! projections of one slab each; interval bounds are Snyder 1992, Interval analysis for computer graphics. Lists of whole
//! bricks, so that lanes are nodes, are this project's.

use super::boxes::{BOX, MARGIN, SLACK, STARTS};
use crate::{
    field::falloff::Falloff,
    lattice::{BRICK, Coord},
    lookup::columns::{Extent, Near, Placed, Want, provide},
    math::{
        bits::ones,
        simd::{LANES, Simd},
    },
};

/// Nodes of a brick along an axis.
pub(crate) const SIDE: usize = BRICK as usize;
/// Coordinate of a brick's last node.
const LAST: f32 = (SIDE - 1) as f32;

const _: () = assert!(SIDE == BOX, "bricks begin where boxes do");

/// One particle as one brick sees it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Entry {
    /// From the brick's first node, in cells.
    pub(crate) at: [f32; 3],
    pub(crate) per_reach_sq: f32,
    /// Square of the distance along z from each plane of nodes, in reaches.
    pub(crate) rest: [f32; SIDE],
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
        self.reach = (reach + 0.5).ceil() as i32;
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

/// The bricks of one row that one particle reaches.
#[derive(Debug, Clone, Copy)]
struct Span {
    particle: u32,
    row: u16,
    bricks: u16,
}

/// How much room the largest layer so far needed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Room {
    entries: usize,
    varied: usize,
    named: usize,
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
            varied: self.varied.max(other.varied),
            named: self.named.max(other.named),
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
    want: Want,
    spans: Vec<Span>,
    upper: Vec<f32>,
    lower: Vec<f32>,
    /// For each row of bricks: those that bounds do not decide, and those that are inside for certain.
    pub(crate) open: Vec<u16>,
    pub(crate) inside: Vec<u16>,
    /// Bricks that have a list, by row.
    listed: Vec<u16>,
    range: Vec<[u32; 2]>,
    /// Entries in use; the arrays behind them, the last two only where wanted, may be longer.
    len: usize,
    entries: Vec<Entry>,
    strengths: Vec<f32>,
    who: Vec<u32>,
}

/// One brick's list.
#[derive(Clone, Copy)]
pub(crate) struct List<'a> {
    pub(crate) entries: &'a [Entry],
    /// Empty where all strengths are 1.
    pub(crate) strengths: &'a [f32],
    /// Which particles they are, where that was wanted.
    pub(crate) who: &'a [u32],
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
        want: Want,
    ) {
        self.count = [extent.nodes[0].div_ceil(SIDE), extent.nodes[1].div_ceil(SIDE)];
        (self.first, self.want) = (extent.first, want);
        self.first[2] += (SIDE * layer) as i32;
        self.clear();
        for &i in heights.of_layer(layer) {
            self.touch(s, falloff, i, &particles[i as usize]);
        }
        let all = ((1u32 << self.count[0]) - 1) as u16;
        for row in 0..self.count[1] {
            if falloff.is_some() {
                let (upper, lower) = (s.load(&self.upper[LANES * row..]), s.load(&self.lower[LANES * row..]));
                self.open[row] &= s.gt(upper, s.splat(iso * (1.0 - MARGIN)));
                self.inside[row] = self.open[row] & s.gt(lower, s.splat(iso * (1.0 + MARGIN)));
                self.open[row] &= !self.inside[row];
            }
            self.open[row] &= all;
            self.inside[row] &= all;
        }
        for row in 0..self.count[1] {
            self.listed[row] = self.open[row];
        }
        self.enter(particles);
    }

    /// Makes lists for more bricks, marked in `listed`, which must have none yet.
    pub(crate) fn add(&mut self, bricks: &[u16], particles: &[Placed]) {
        self.listed.copy_from_slice(bricks);
        self.enter(particles);
    }

    fn clear(&mut self) {
        let [width, rows] = self.count;
        self.spans.clear();
        for sums in [&mut self.upper, &mut self.lower] {
            sums.clear();
            sums.resize(LANES * rows, 0.0);
        }
        for bits in [&mut self.open, &mut self.inside, &mut self.listed] {
            bits.clear();
            bits.resize(rows, 0);
        }
        self.range.clear();
        self.range.resize(width * rows, [0; 2]);
        self.len = 0;
    }

    /// Notes the bricks that a particle reaches, and adds it to their bounds.
    #[inline(always)]
    fn touch<S: Simd, W: Falloff>(&mut self, s: S, falloff: Option<&W>, index: u32, p: &Placed) {
        let [x, y, z] = position(p, self.first);
        let reach_sq = p.reach * p.reach;
        let [near_z, far_z] = squares(z);
        if near_z >= reach_sq {
            return;
        }
        let side = SIDE as f32;
        let low = ((y - p.reach - LAST) / side).max(0.0) as usize;
        let high = ((y + p.reach) / side + 1.0).max(0.0) as usize;
        let (zero, one) = (s.splat(0.0), s.splat(1.0));
        let x = s.sub(s.splat(x), s.load(&STARTS));
        let (below, above) = (s.sub(zero, x), s.sub(x, s.splat(LAST)));
        let near = s.max(s.sub(s.max(below, above), s.splat(SLACK)), zero);
        let far = s.add(s.max(x, s.sub(zero, above)), s.splat(SLACK));
        let (near, far) = (s.mul(near, near), s.mul(far, far));
        let (reach, per_reach_sq, strength) = (s.splat(reach_sq), s.splat(1.0 / reach_sq), s.splat(p.strength));
        for row in low..high.min(self.count[1]) {
            let [near_y, far_y] = squares(y - (SIDE * row) as f32);
            let near = s.add(near, s.splat(near_y + near_z));
            let bricks = s.gt(reach, near);
            if bricks == 0 {
                continue;
            }
            self.spans.push(Span { particle: index, row: row as u16, bricks });
            self.open[row] |= bricks;
            if let Some(falloff) = falloff {
                let sums = &mut self.upper[LANES * row..LANES * row + LANES];
                let u = s.max(s.sub(one, s.mul(near, per_reach_sq)), zero);
                s.store(s.add(s.load(sums), s.mul(strength, falloff.value(s, u))), sums);
                if far_y + far_z < reach_sq {
                    let far = s.add(far, s.splat(far_y + far_z));
                    let sums = &mut self.lower[LANES * row..LANES * row + LANES];
                    let u = s.max(s.sub(one, s.mul(far, per_reach_sq)), zero);
                    s.store(s.add(s.load(sums), s.mul(strength, falloff.value(s, u))), sums);
                }
            }
        }
    }

    /// Writes the lists of the bricks marked in `listed` behind those that there are.
    fn enter(&mut self, particles: &[Placed]) {
        let width = self.count[0];
        for span in &self.spans {
            let row = usize::from(span.row);
            for column in ones((span.bricks & self.listed[row]).into()) {
                self.range[row * width + column][1] += 1;
            }
        }
        let mut len = self.len;
        for row in 0..self.count[1] {
            for column in ones(self.listed[row].into()) {
                let range = &mut self.range[row * width + column];
                let count = range[1] as usize;
                *range = [len as u32; 2];
                len += count;
            }
        }
        self.len = len;
        self.reserve();
        for span in &self.spans {
            let row = usize::from(span.row);
            let bricks = span.bricks & self.listed[row];
            if bricks == 0 {
                continue;
            }
            let p = &particles[span.particle as usize];
            let mut corner = self.first;
            corner[1] += (SIDE * row) as i32;
            let [x, y, z] = [0, 1, 2].map(|a| p.node[a] - corner[a]);
            let (y, z) = (y as f32 + p.offset[1], z as f32 + p.offset[2]);
            let per_reach_sq = 1.0 / (p.reach * p.reach);
            let mut rest = [0.0; SIDE];
            for (plane, rest) in rest.iter_mut().enumerate() {
                let dz = plane as f32 - z;
                *rest = dz * dz * per_reach_sq;
            }
            for column in ones(bricks.into()) {
                let end = &mut self.range[row * width + column][1];
                let place = *end as usize;
                *end += 1;
                let x = (x - (SIDE * column) as i32) as f32 + p.offset[0];
                self.entries[place] = Entry { at: [x, y, z], per_reach_sq, rest };
                if self.want.varied {
                    self.strengths[place] = p.strength;
                }
                if self.want.who {
                    self.who[place] = span.particle;
                }
            }
        }
    }

    /// Makes the arrays long enough. What is there is not cleared: every entry is written.
    fn reserve(&mut self) {
        let Self { len, want, .. } = *self;
        let (varied, named) = (if want.varied { len } else { 0 }, if want.who { len } else { 0 });
        let none = Entry { at: [0.0; 3], per_reach_sq: 0.0, rest: [0.0; SIDE] };
        self.entries.resize(len.max(self.entries.len()), none);
        self.strengths.resize(varied.max(self.strengths.len()), 0.0);
        self.who.resize(named.max(self.who.len()), 0);
    }

    /// Number of entries.
    pub(crate) fn entries(&self) -> usize {
        self.len
    }

    /// The list of one brick; empty for one that has none.
    #[inline(always)]
    pub(crate) fn list(&self, brick: usize) -> List<'_> {
        let range = self.range[brick][0] as usize..self.range[brick][1] as usize;
        List {
            entries: &self.entries[range.clone()],
            strengths: if self.want.varied { &self.strengths[range.clone()] } else { &[] },
            who: if self.want.who { &self.who[range] } else { &[] },
        }
    }

    /// Most particles of a brick.
    pub(crate) fn longest(&self) -> usize {
        self.range.iter().map(|range| (range[1] - range[0]) as usize).max().unwrap_or(0)
    }

    /// The room that the present layer needs.
    pub(crate) fn room(&self, heights: &Heights) -> Room {
        Room {
            entries: self.len,
            varied: self.strengths.len(),
            named: self.who.len(),
            spans: self.spans.len(),
            bricks: self.range.len(),
            rows: self.open.len(),
            particles: heights.order.len(),
            bins: heights.bins.len(),
            longest: self.longest(),
        }
    }

    /// Makes room, so that layers as large need no allocation.
    pub(crate) fn provide(&mut self, room: &Room) {
        for v in [&mut self.upper, &mut self.lower] {
            provide(v, LANES * room.rows);
        }
        for v in [&mut self.open, &mut self.inside, &mut self.listed] {
            provide(v, room.rows);
        }
        provide(&mut self.range, room.bricks);
        provide(&mut self.entries, room.entries);
        provide(&mut self.strengths, room.varied);
        provide(&mut self.who, room.named);
        provide(&mut self.spans, room.spans);
    }

    /// Bytes in use, for the present layer.
    pub(crate) fn bytes(&self) -> usize {
        let more = 4 * (usize::from(self.want.varied) + usize::from(self.want.who));
        self.len * (size_of::<Entry>() + more)
            + 4 * (self.upper.len() + self.lower.len())
            + 8 * (self.range.len() + self.spans.len())
            + 6 * self.open.len()
    }
}

impl List<'_> {
    /// Finds the particles that reach one node of the brick.
    pub(crate) fn find(&self, node: [usize; 3], near: &mut Near) {
        near.clear();
        for (i, entry) in self.entries.iter().enumerate() {
            let (dx, dy) = (node[0] as f32 - entry.at[0], node[1] as f32 - entry.at[1]);
            let u = 1.0 - (dx * dx + dy * dy) * entry.per_reach_sq - entry.rest[node[2]];
            if u > 0.0 {
                near.push(u, self.strengths.get(i).copied().unwrap_or(1.0), self.who.get(i).copied().unwrap_or(0));
            }
        }
    }
}

/// Where a particle is from a node, in cells.
#[inline(always)]
fn position(p: &Placed, from: Coord) -> [f32; 3] {
    [0, 1, 2].map(|a| (p.node[a] - from[a]) as f32 + p.offset[a])
}

/// Squares of the least and the largest distance along an axis from a brick's nodes, a little too small and large.
#[inline(always)]
fn squares(at: f32) -> [f32; 2] {
    let (near, far) = (((-at).max(at - LAST) - SLACK).max(0.0), at.max(LAST - at) + SLACK);
    [near * near, far * far]
}

#[cfg(test)]
mod tests;
