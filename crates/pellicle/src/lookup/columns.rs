//! The particles that reach a node, found by its column: a two-dimensional insertion, a one-dimensional look-up.
//!
//! Every particle is entered in the lattice columns (x, y) that its reach crosses, the discs of a sphere seen from above.
//! A look-up at (x, y, z) then searches one list, along z only.
//!
//! ```text
//! start   column ──► range of entries            (one counting pass, no linked lists)
//! flat    1 − (dx² + dy²)/R²    what the column's distance leaves of u, always > 0
//! level   z of the particle's nearest node, in cells from the block's first node
//! above   z of the particle from that node, in cells
//! who     the particle, as the block numbers it                  (structure of arrays: 16 entries are one vector)
//! cursor  column ──► first entry that the last look-up's z could need
//! ```
//!
//! Within a column entries come in the canonical order of the particles: by nearest node along z, then by the caller's
//! index. A look-up computes u = flat − dz²/R² of 16 entries at a time and moves those with u > 0 together. So it is
//! exact: what it hands out is within reach, all of it, and in an order that does not depend on the block; nor do the
//! numbers, because distances are formed from whole cells and fractions of a cell apart. A node has the same value in
//! every block, to the last bit.
//!
//! Memory: 16 bytes an entry, πR² entries a particle (R in cells); 8 more where reaches or strengths differ.
//!
//! Source: Rosenberg & Birdwell, Real-time particle isosurface extraction, 2008, section 6. Arrays in place of linked
//! lists, and a comparison of u in place of two comparisons of integers, are this project's.

use crate::{
    lattice::{Coord, ceil_f32, floor_f32},
    math::simd::{LANES, Simd},
};

/// A particle on the lattice, lengths in cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Placed {
    /// The nearest node.
    pub(crate) node: Coord,
    /// Position from there, at most half a cell along each axis.
    pub(crate) offset: [f32; 3],
    /// Radius of influence.
    pub(crate) reach: f32,
    /// Factor of its contribution.
    pub(crate) strength: f32,
    /// Its index in the caller's order.
    pub(crate) index: u32,
}

impl Placed {
    /// Whether two are the same particle at the same place, bit for bit.
    pub(crate) fn same_bits(&self, other: &Self) -> bool {
        let bits = |p: &Self| (p.node, p.offset.map(f32::to_bits), p.reach.to_bits(), p.strength.to_bits(), p.index);
        bits(self) == bits(other)
    }
}

/// The nodes that a block asks about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Extent {
    pub(crate) first: Coord,
    /// Nodes along each axis; at most 64 along x and y.
    pub(crate) nodes: [usize; 3],
}

impl Extent {
    /// The nodes along one axis that `particle` may reach, as positions in the extent; the range may be empty.
    fn reached(&self, particle: &Placed, axis: usize) -> (i32, i32) {
        let centre = particle.node[axis] - self.first[axis];
        let low = centre + ceil_f32(particle.offset[axis] - particle.reach);
        let high = centre + floor_f32(particle.offset[axis] + particle.reach);
        (low.max(0), high.min(self.nodes[axis] as i32 - 1))
    }
}

/// What the columns at the border of the extent hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Border {
    /// All that reaches them.
    Open,
    /// Nothing, so that every surface is closed within the extent.
    Empty,
}

/// Particles by column. Reusable: [`build`](Self::build) keeps the memory.
#[derive(Default)]
pub(crate) struct Columns {
    extent: Option<Extent>,
    start: Vec<u32>,
    cursor: Vec<u32>,
    flat: Vec<f32>,
    level: Vec<f32>,
    above: Vec<f32>,
    who: Vec<f32>,
    /// 1/R² and strength, entry by entry, where they differ between particles; else empty.
    per_reach_sq: Vec<f32>,
    strength: Vec<f32>,
    /// The block's particles in canonical order.
    particles: Vec<Placed>,
    spans: Vec<Span>,
    bins: Vec<u32>,
    /// 1/R² where all reaches are the same.
    same_per_reach_sq: f32,
    /// Most cells between a node and the nearest node of a particle that reaches it.
    reach: i32,
    longest: usize,
}

/// How much room the largest block so far needed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Room {
    columns: usize,
    entries: usize,
    extra: usize,
    particles: usize,
    spans: usize,
    bins: usize,
    pub(crate) longest: usize,
}

impl Room {
    /// Room for both.
    pub(crate) fn join(&self, other: &Self) -> Self {
        Self {
            columns: self.columns.max(other.columns),
            entries: self.entries.max(other.entries),
            extra: self.extra.max(other.extra),
            particles: self.particles.max(other.particles),
            spans: self.spans.max(other.spans),
            bins: self.bins.max(other.bins),
            longest: self.longest.max(other.longest),
        }
    }
}

/// Sees to it that a vector can hold so many values without allocating.
pub(crate) fn provide<T>(v: &mut Vec<T>, len: usize) {
    v.reserve(len.saturating_sub(v.len()));
}

/// The columns of one row that one particle reaches.
#[derive(Debug, Clone, Copy)]
struct Span {
    particle: u32,
    row: u16,
    first: u16,
    last: u16,
}

/// What a look-up is to find besides u. Known when compiled, so that nothing is decided at run time.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Want {
    /// Reaches or strengths differ: find strengths.
    pub(crate) varied: bool,
    /// Find out who the particles are.
    pub(crate) who: bool,
}

/// What a look-up found: u = 1 − (d/R)² of every particle within reach of a node, in canonical order.
#[derive(Default)]
pub(crate) struct Near {
    u: Vec<f32>,
    strength: Vec<f32>,
    who: Vec<f32>,
    len: usize,
    /// Entries that were looked at, kept or not.
    pub(crate) seen: u64,
    /// Entries that were kept.
    pub(crate) kept: u64,
}

impl Near {
    /// Makes room for so many entries of a column.
    pub(crate) fn provide(&mut self, longest: usize) {
        for v in [&mut self.u, &mut self.strength, &mut self.who] {
            v.resize(v.len().max(longest), 0.0);
        }
    }

    /// Starts anew, to be filled by [`push`](Self::push).
    pub(crate) fn clear(&mut self) {
        self.len = 0;
    }

    /// Adds a particle. There must be [room](Self::provide) for it, and for 16 more.
    pub(crate) fn push(&mut self, u: f32, strength: f32, who: u32) {
        (self.u[self.len], self.strength[self.len], self.who[self.len]) = (u, strength, f32::from_bits(who));
        self.len += 1;
    }

    /// Number of particles.
    #[inline(always)]
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// u of particles `first..first + 16`, 0 beyond the last.
    #[inline(always)]
    pub(crate) fn group<S: Simd>(&self, s: S, first: usize) -> S::F {
        let valid = ((1u32 << (self.len - first).min(LANES)) - 1) as u16;
        s.select(valid, s.load(&self.u[first..]), s.splat(0.0))
    }

    /// Strengths of particles `first..first + 16`; anything beyond the last.
    #[inline(always)]
    pub(crate) fn strengths<S: Simd>(&self, s: S, first: usize) -> S::F {
        s.load(&self.strength[first..])
    }

    /// u of each particle.
    #[inline(always)]
    pub(crate) fn rests(&self) -> &[f32] {
        &self.u[..self.len]
    }

    /// The particles, as the block numbers them.
    #[inline(always)]
    pub(crate) fn who(&self) -> impl Iterator<Item = usize> + '_ {
        self.who[..self.len].iter().map(|w| w.to_bits() as usize)
    }
}

impl Columns {
    /// Enters the particles into the columns of `extent`. `varied` says whether reaches or strengths differ.
    pub(crate) fn build(&mut self, extent: Extent, border: Border, particles: &[Placed], of: &[u32], varied: bool) {
        self.extent = Some(extent);
        self.sort(extent, particles, of);
        self.find_spans(extent, border);
        self.enter(extent, varied);
    }

    /// The block's particles, in canonical order.
    #[inline(always)]
    pub(crate) fn particles(&self) -> &[Placed] {
        &self.particles
    }

    /// Number of entries.
    pub(crate) fn entries(&self) -> usize {
        self.start.last().map_or(0, |&end| end as usize)
    }

    /// Writes every span's entries, each at its column's cursor.
    fn write_entries<const VARIED: bool>(&mut self, extent: Extent, len: usize) {
        let width = extent.nodes[0];
        // Slices of one length: one check serves all.
        let (flat, level) = (&mut self.flat[..len], &mut self.level[..len]);
        let (above, who) = (&mut self.above[..len], &mut self.who[..len]);
        let (reaches, strength) = (&mut self.per_reach_sq[..], &mut self.strength[..]);
        let cursors = &mut self.cursor[..];
        for span in &self.spans {
            let p = &self.particles[span.particle as usize];
            let per_reach_sq = 1.0 / (p.reach * p.reach);
            let dy = (i32::from(span.row) + extent.first[1] - p.node[1]) as f32 - p.offset[1];
            let dy_sq = dy * dy;
            let (z, rest) = ((p.node[2] - extent.first[2]) as f32, p.offset[2]);
            let particle = f32::from_bits(span.particle);
            let row = usize::from(span.row) * width;
            let columns = row + usize::from(span.first)..=row + usize::from(span.last);
            let cell = i32::from(span.first) + extent.first[0] - p.node[0];
            for (cell, cursor) in (cell..).zip(&mut cursors[columns]) {
                let dx = cell as f32 - p.offset[0];
                let at = *cursor as usize;
                *cursor += 1;
                flat[at] = 1.0 - (dx * dx + dy_sq) * per_reach_sq;
                level[at] = z;
                above[at] = rest;
                who[at] = particle;
                if VARIED {
                    reaches[at] = per_reach_sq;
                    strength[at] = p.strength;
                }
            }
        }
    }

    /// The room that the present block needs.
    pub(crate) fn room(&self) -> Room {
        Room {
            columns: self.start.len() + 1,
            entries: self.entries() + LANES,
            extra: if self.strength.is_empty() { 0 } else { self.entries() + LANES },
            particles: self.particles.len(),
            spans: self.spans.len(),
            bins: self.bins.len(),
            longest: self.longest + 2 * LANES,
        }
    }

    /// Makes room, so that blocks as large need no allocation.
    pub(crate) fn provide(&mut self, room: &Room) {
        for v in [&mut self.start, &mut self.cursor] {
            provide(v, room.columns);
        }
        for v in [&mut self.flat, &mut self.level, &mut self.above, &mut self.who] {
            provide(v, room.entries);
        }
        for v in [&mut self.per_reach_sq, &mut self.strength] {
            provide(v, room.extra);
        }
        provide(&mut self.particles, room.particles);
        provide(&mut self.spans, room.spans);
        provide(&mut self.bins, room.bins);
    }

    /// Bytes in use, for the present block.
    pub(crate) fn bytes(&self) -> usize {
        let entry = 16 + if self.strength.is_empty() { 0 } else { 8 };
        self.entries() * entry
            + 8 * self.cursor.len()
            + self.particles.len() * size_of::<Placed>()
            + self.spans.len() * size_of::<Span>()
    }

    /// Counting sort by nearest node along z; stable, and `of` comes by the caller's index.
    fn sort(&mut self, extent: Extent, particles: &[Placed], of: &[u32]) {
        let reach = of.iter().fold(0.0f32, |most, &i| most.max(particles[i as usize].reach));
        self.same_per_reach_sq = 1.0 / (reach * reach);
        self.reach = (reach + 0.5).ceil() as i32;
        let bins = extent.nodes[2] + 2 * self.reach as usize;
        let bin = |p: &Placed| ((p.node[2] - extent.first[2] + self.reach).max(0) as usize).min(bins - 1);
        self.bins.clear();
        self.bins.resize(bins + 1, 0);
        for &i in of {
            self.bins[bin(&particles[i as usize]) + 1] += 1;
        }
        for b in 1..=bins {
            self.bins[b] += self.bins[b - 1];
        }
        self.particles.clear();
        if let Some(&first) = of.first() {
            self.particles.resize(of.len(), particles[first as usize]);
        }
        for &i in of {
            let particle = particles[i as usize];
            let at = &mut self.bins[bin(&particle)];
            self.particles[*at as usize] = particle;
            *at += 1;
        }
    }

    /// Finds which columns each particle reaches, and counts them; afterwards `start` holds where each column's entries
    /// begin.
    fn find_spans(&mut self, extent: Extent, border: Border) {
        let width = extent.nodes[0];
        let inset = i32::from(border == Border::Empty);
        let edge: [i32; 2] = std::array::from_fn(|a| extent.nodes[a] as i32 - 1 - inset);
        self.start.clear();
        self.start.resize(width * extent.nodes[1] + 2, 0);
        self.spans.clear();
        let starts = &mut self.start[..];
        for (i, particle) in self.particles.iter().enumerate() {
            let (low, high) = extent.reached(particle, 1);
            let reach_sq = particle.reach * particle.reach;
            for row in low.max(inset)..=high.min(edge[1]) {
                let dy = (row + extent.first[1] - particle.node[1]) as f32 - particle.offset[1];
                let half = (reach_sq - dy * dy).max(0.0).sqrt();
                let centre = particle.node[0] - extent.first[0];
                let first = (centre + ceil_f32(particle.offset[0] - half)).max(inset);
                let last = (centre + floor_f32(particle.offset[0] + half)).min(edge[0]);
                if first > last {
                    continue;
                }
                let [row, first, last] = [row, first, last].map(|v| v as u16);
                self.spans.push(Span { particle: i as u32, row, first, last });
                // One more from `first` on, one less behind `last`: summed along the row below.
                let at = usize::from(row) * width;
                let begin = &mut starts[at + usize::from(first)];
                *begin = begin.wrapping_add(1);
                let behind = &mut starts[at + usize::from(last) + 1];
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

    /// Writes the entries; afterwards `cursor` is where each column's begin.
    fn enter(&mut self, extent: Extent, varied: bool) {
        let width = extent.nodes[0];
        self.cursor.clone_from(&self.start);
        let len = self.entries() + LANES;
        for v in [&mut self.flat, &mut self.level, &mut self.above, &mut self.who] {
            v.resize(v.len().max(len), 0.0);
        }
        let extra = if varied { len } else { 0 };
        self.per_reach_sq.resize(extra, 0.0);
        self.strength.resize(extra, 0.0);
        if varied {
            self.write_entries::<true>(extent, len)
        } else {
            self.write_entries::<false>(extent, len)
        }
        let columns = width * extent.nodes[1];
        self.cursor.truncate(columns);
        self.cursor.copy_from_slice(&self.start[..columns]);
        self.longest = self.start.windows(2).map(|w| (w[1] - w[0]) as usize).max().unwrap_or(0);
    }

    /// Prepares `near` for look-ups in these columns, so that a look-up itself never allocates.
    pub(crate) fn prepare(&self, near: &mut Near) {
        near.provide(self.longest + 2 * LANES);
    }

    /// Finds the particles that reach node `z` of `column`.
    #[inline(always)]
    pub(crate) fn find<S: Simd>(&mut self, s: S, column: usize, z: i32, want: Want, near: &mut Near) {
        let [first, end] = [self.start[column], self.start[column + 1]].map(|v| v as usize);
        let (lowest, highest) = ((z - self.reach) as f32, (z + self.reach) as f32);
        let mut at = (self.cursor[column] as usize).clamp(first, end);
        while at > first && self.level[at - 1] >= lowest {
            at -= 1;
        }
        while at < end && self.level[at] < lowest {
            at += 1;
        }
        self.cursor[column] = at as u32;
        let here = s.splat(z as f32);
        // In locals, so that nothing is written back between vectors.
        let (levels, above, flat) = (&self.level[..], &self.above[..], &self.flat[..]);
        let (to_u, to_strength, to_who) = (&mut near.u[..], &mut near.strength[..], &mut near.who[..]);
        let (mut len, first_seen) = (0, at);
        while at < end && levels[at] <= highest {
            let dz = s.sub(s.sub(here, s.load(&levels[at..])), s.load(&above[at..]));
            let per_reach_sq =
                if want.varied { s.load(&self.per_reach_sq[at..]) } else { s.splat(self.same_per_reach_sq) };
            let u = s.sub(s.load(&flat[at..]), s.mul(s.mul(dz, dz), per_reach_sq));
            let valid = ((1u32 << (end - at).min(LANES)) - 1) as u16;
            let within = s.gt(u, s.splat(0.0)) & valid;
            s.compress(u, within, &mut to_u[len..]);
            if want.varied {
                s.compress(s.load(&self.strength[at..]), within, &mut to_strength[len..]);
            }
            if want.who {
                s.compress(s.load(&self.who[at..]), within, &mut to_who[len..]);
            }
            len += within.count_ones() as usize;
            at += LANES;
        }
        near.len = len;
        near.seen += (at.min(end) - first_seen) as u64;
        near.kept += near.len as u64;
    }
}

#[cfg(test)]
mod tests;
