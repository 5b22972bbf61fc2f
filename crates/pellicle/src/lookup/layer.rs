//! The particles that reach the bricks of one layer of a block: a two-dimensional insertion, one list a brick.
//!
//! A brick is 4×4×4 nodes of the lattice, 4-aligned in the world. Every particle is entered in the bricks of the layer whose
//! boxes of nodes its reach touches, discs cut out of a sphere; a node's particles are then those of its brick's list. Only
//! one layer's lists exist at a time (two while the slabs between them are marched), so that memory follows the area of a
//! layer, not the volume of a block.
//!
//! ```text
//! start     brick ──► range of entries            (one counting pass, no linked lists)
//! entries   x, y, z from the brick's first node in cells, 1/R², and (z − plane)²/R² of the brick's four planes: 32 bytes
//! nearest   1 − (d/R)² at the nearest point of the brick's box, at least 0      (structure of arrays, for bounds)
//! farthest  the same at the farthest point
//! ```
//!
//! Within a list entries come in canonical order: by nearest node along z, then by the caller's index. Distances are formed
//! from whole cells and fractions of a cell apart, in the frame of the brick, which is the same in every block that has it:
//! a node has the same value in every block, to the last bit.
//!
//! Memory: 40 bytes an entry; 4 each for strengths and for who it is where these are wanted.
//!
//! Source: Rosenberg & Birdwell, Real-time particle isosurface extraction, 2008, section 6, whose last paragraphs propose
//! projections of one slab each; lists of whole bricks, so that lanes are nodes, are this project's.

use super::columns::{Extent, Near, Placed, Want, provide};
use crate::{
    lattice::{BRICK, ceil_f32, floor_f32},
    math::simd::{LANES, Simd},
};

/// Nodes of a brick along an axis.
pub(crate) const SIDE: usize = BRICK as usize;
/// Coordinate of a brick's last node.
const LAST: f32 = (SIDE - 1) as f32;
/// What a reach is widened by when particles are entered, relatively and in cells: more than rounding makes of a distance.
/// What it lets in beyond the reach brings exactly nothing.
const WIDER: f32 = 1e-4;
/// More than the rounding of 1 − (d/R)², which is at most 1.
const SLACK: f32 = 2e-6;

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
    first: u16,
    last: u16,
}

/// How much room the largest layer so far needed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Room {
    entries: usize,
    varied: usize,
    named: usize,
    spans: usize,
    bricks: usize,
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

/// The lists of one layer. Reusable: [`enter`](Self::enter) keeps the memory.
#[derive(Default)]
pub(crate) struct Lists {
    start: Vec<u32>,
    cursor: Vec<u32>,
    spans: Vec<Span>,
    entries: Vec<Entry>,
    nearest: Vec<f32>,
    farthest: Vec<f32>,
    /// Empty unless wanted.
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
    /// As long as the entries and 16 more.
    nearest: &'a [f32],
    farthest: &'a [f32],
    spare_strengths: &'a [f32],
}

impl Lists {
    /// Enters the particles that reach layer `layer` of a block into the lists of its bricks.
    pub(crate) fn enter(&mut self, extent: Extent, layer: usize, particles: &[Placed], heights: &Heights, want: Want) {
        let count = [0, 1].map(|a| extent.nodes[a].div_ceil(SIDE));
        let mut first = extent.first;
        first[2] += (SIDE * layer) as i32;
        self.find_spans(count, first, particles, heights.of_layer(layer));
        let len = self.entries();
        self.entries.resize(len.max(self.entries.len()), Entry { at: [0.0; 3], per_reach_sq: 0.0, rest: [0.0; SIDE] });
        for v in [&mut self.nearest, &mut self.farthest] {
            v.resize((len + LANES).max(v.len()), 0.0);
        }
        self.strengths.clear();
        self.who.clear();
        if want.varied {
            self.strengths.resize(len + LANES, 0.0);
        }
        if want.who {
            self.who.resize(len, 0);
        }
        self.write(count[0], first, particles);
    }

    /// Finds which bricks each particle reaches, and counts; afterwards `start` holds where each brick's entries begin.
    fn find_spans(&mut self, count: [usize; 2], first: [i32; 3], particles: &[Placed], near: &[u32]) {
        let side = SIDE as f32;
        self.start.clear();
        self.start.resize(count[0] * count[1] + 2, 0);
        self.spans.clear();
        let last = [count[0] as i32 - 1, count[1] as i32 - 1];
        for &particle in near {
            let p = &particles[particle as usize];
            let [x, y, z] = position(p, first);
            let reach = p.reach + (p.reach + 1.0) * WIDER;
            let dz = outside(z);
            let left = reach * reach - dz * dz;
            if left <= 0.0 {
                continue;
            }
            let half = left.sqrt();
            let low = ceil_f32((y - half - LAST) / side).max(0);
            let high = floor_f32((y + half) / side).min(last[1]);
            for row in low..=high {
                let dy = outside(y - (row * BRICK) as f32);
                let half = (left - dy * dy).max(0.0).sqrt();
                let low = ceil_f32((x - half - LAST) / side).max(0);
                let high = floor_f32((x + half) / side).min(last[0]);
                if low > high {
                    continue;
                }
                let [row, low, high] = [row, low, high].map(|v| v as u16);
                self.spans.push(Span { particle, row, first: low, last: high });
                // One more from the first on, one less behind the last: summed along the row below.
                let at = usize::from(row) * count[0];
                let begin = &mut self.start[at + usize::from(low)];
                *begin = begin.wrapping_add(1);
                let behind = &mut self.start[at + usize::from(high) + 1];
                *behind = behind.wrapping_sub(1);
            }
        }
        let (mut total, mut here) = (0u32, 0u32);
        for start in &mut self.start {
            here = here.wrapping_add(*start);
            *start = total;
            total += here;
        }
        self.start.pop();
    }

    /// Writes every span's entries, each at its brick's cursor.
    fn write(&mut self, width: usize, first: [i32; 3], particles: &[Placed]) {
        self.cursor.clone_from(&self.start);
        let (varied, named) = (!self.strengths.is_empty(), !self.who.is_empty());
        for span in &self.spans {
            let p = &particles[span.particle as usize];
            let per_reach_sq = 1.0 / (p.reach * p.reach);
            let [row, low, high] = [span.row, span.first, span.last].map(usize::from);
            let corner = |column: usize| [first[0] + (SIDE * column) as i32, first[1] + (SIDE * row) as i32, first[2]];
            let at = position(p, corner(low));
            let mut rest = [0.0; SIDE];
            for (plane, rest) in rest.iter_mut().enumerate() {
                let dz = plane as f32 - at[2];
                *rest = dz * dz * per_reach_sq;
            }
            let (near, far) = (squares(at[1]), squares(at[2]));
            let (near_yz, far_yz) = (near[0] + far[0], near[1] + far[1]);
            for column in low..=high {
                let cursor = &mut self.cursor[row * width + column];
                let place = *cursor as usize;
                *cursor += 1;
                let x = (p.node[0] - corner(column)[0]) as f32 + p.offset[0];
                let [near_x, far_x] = squares(x);
                self.entries[place] = Entry { at: [x, at[1], at[2]], per_reach_sq, rest };
                self.nearest[place] = (1.0 - (near_x + near_yz) * per_reach_sq + SLACK).clamp(0.0, 1.0);
                self.farthest[place] = (1.0 - (far_x + far_yz) * per_reach_sq - SLACK).max(0.0);
                if varied {
                    self.strengths[place] = p.strength;
                }
                if named {
                    self.who[place] = span.particle;
                }
            }
        }
    }

    /// Number of entries.
    pub(crate) fn entries(&self) -> usize {
        self.start.last().map_or(0, |&end| end as usize)
    }

    /// The list of one brick.
    #[inline(always)]
    pub(crate) fn list(&self, brick: usize) -> List<'_> {
        let range = self.start[brick] as usize..self.start[brick + 1] as usize;
        let spare = range.start..range.end + LANES;
        let (varied, named) = (!self.strengths.is_empty(), !self.who.is_empty());
        List {
            entries: &self.entries[range.clone()],
            strengths: if varied { &self.strengths[range.clone()] } else { &[] },
            who: if named { &self.who[range] } else { &[] },
            nearest: &self.nearest[spare.clone()],
            farthest: &self.farthest[spare.clone()],
            spare_strengths: if varied { &self.strengths[spare] } else { &[] },
        }
    }

    /// The room that the present layer needs.
    pub(crate) fn room(&self, heights: &Heights) -> Room {
        let longest = self.start.windows(2).map(|w| (w[1] - w[0]) as usize).max().unwrap_or(0);
        Room {
            entries: self.entries(),
            varied: self.strengths.len(),
            named: self.who.len(),
            spans: self.spans.len(),
            bricks: self.start.len() + 1,
            particles: heights.order.len(),
            bins: heights.bins.len(),
            longest,
        }
    }

    /// Makes room, so that layers as large need no allocation.
    pub(crate) fn provide(&mut self, room: &Room) {
        for v in [&mut self.start, &mut self.cursor] {
            provide(v, room.bricks);
        }
        for v in [&mut self.nearest, &mut self.farthest] {
            provide(v, room.entries + LANES);
        }
        provide(&mut self.entries, room.entries);
        provide(&mut self.strengths, room.varied);
        provide(&mut self.who, room.named);
        provide(&mut self.spans, room.spans);
    }

    /// Bytes in use, for the present layer.
    pub(crate) fn bytes(&self) -> usize {
        self.entries() * (size_of::<Entry>() + 8)
            + 4 * (self.strengths.len() + self.who.len() + self.start.len() + self.cursor.len())
            + self.spans.len() * size_of::<Span>()
    }
}

impl List<'_> {
    /// 1 − (d/R)² of particles `first..first + 16` at the points of the brick's box nearest to them and farthest from them,
    /// with a margin for rounding; 0 beyond the last particle.
    #[inline(always)]
    pub(crate) fn extremes<S: Simd>(&self, s: S, first: usize) -> [S::F; 2] {
        let valid = self.valid(first);
        [
            s.select(valid, s.load(&self.nearest[first..]), s.splat(0.0)),
            s.select(valid, s.load(&self.farthest[first..]), s.splat(0.0)),
        ]
    }

    /// Their strengths; 0 beyond the last.
    #[inline(always)]
    pub(crate) fn factors<S: Simd>(&self, s: S, first: usize) -> S::F {
        s.select(self.valid(first), s.load(&self.spare_strengths[first..]), s.splat(0.0))
    }

    #[inline(always)]
    fn valid(&self, first: usize) -> u16 {
        ((1u32 << (self.entries.len() - first).min(LANES)) - 1) as u16
    }

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

/// Where a particle is from a node, in cells: from whole cells and a fraction of one, apart.
#[inline(always)]
fn position(p: &Placed, from: [i32; 3]) -> [f32; 3] {
    [0, 1, 2].map(|a| (p.node[a] - from[a]) as f32 + p.offset[a])
}

/// Distance along an axis from a brick's nodes.
#[inline(always)]
fn outside(at: f32) -> f32 {
    (-at).max(at - LAST).max(0.0)
}

/// Squares of the least and the largest distance along an axis from a brick's nodes.
#[inline(always)]
fn squares(at: f32) -> [f32; 2] {
    let (near, far) = (outside(at), at.max(LAST - at));
    [near * near, far * far]
}

#[cfg(test)]
mod tests;
