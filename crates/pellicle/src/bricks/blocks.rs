//! The world cut into blocks, each with the particles that reach it.
//!
//! Block b holds the cells b·n .. (b + 1)·n along each axis, n its size, counted from the world's origin; its nodes are
//! b·n ..= (b + 1)·n, so that neighbours share the nodes of a face. Only blocks with a node within reach of a particle
//! exist, so that the world has no bounds. Each keeps the numbers of those particles, in the caller's order.
//!
//! Blocks come in the order that the caller asks for, by a key; equal keys by place. The order does not depend on threads.
//!
//! Source: Rosenberg & Birdwell, Real-time particle isosurface extraction, 2008, section 3.

use crate::{
    lattice::{Coord, Divisor, ceil_f32, floor_f32, plus},
    lookup::{
        columns::Placed,
        directory::{Cursor, Directory},
    },
};

/// Blocks and their particles. Reusable.
#[derive(Default)]
pub(crate) struct Blocks {
    directory: Directory,
    found: Vec<Coord>,
    /// Blocks in order.
    pub(crate) blocks: Vec<Block>,
    /// For each block as found, how many particles, then where they begin.
    starts: Vec<u32>,
    members: Vec<u32>,
    /// Which blocks each particle reaches, particle after particle, and how many those are.
    reached: Vec<u32>,
    reached_by: Vec<u16>,
    /// For each block as found, its place in the order.
    rank: Vec<u32>,
}

/// One block.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Block {
    pub(crate) at: Coord,
    key: u64,
    found: u32,
}

/// No block.
pub(crate) const NOBODY: u32 = u32::MAX;

impl Blocks {
    /// Cuts the world into blocks of `size` cells along each axis. `order` gives each block its key, or `None` to leave it
    /// out.
    pub(crate) fn cut(&mut self, size: Coord, particles: &[Placed], mut order: impl FnMut(Coord) -> Option<u64>) {
        self.find(size, particles);
        let mut total = 0;
        for start in &mut self.starts {
            total += std::mem::replace(start, total);
        }
        self.starts.push(total);
        self.members.resize(total as usize, 0);
        let mut reached = self.reached.iter();
        for (i, &count) in self.reached_by.iter().enumerate() {
            for &block in reached.by_ref().take(count.into()) {
                let start = &mut self.starts[block as usize];
                self.members[*start as usize] = i as u32;
                *start += 1;
            }
        }
        // Every start has moved to where the next began.
        self.starts.rotate_right(1);
        if let Some(first) = self.starts.first_mut() {
            *first = 0;
        }
        self.put_in_order(&mut order);
    }

    /// Finds the blocks, and counts the particles of each.
    fn find(&mut self, size: Coord, particles: &[Placed]) {
        self.directory.clear();
        self.found.clear();
        self.starts.clear();
        self.reached.clear();
        self.reached_by.clear();
        let (mut cursor, size) = (Cursor::default(), size.map(Divisor::new));
        for particle in particles {
            let before = self.reached.len();
            for_each_reached(particle, &size, |at| {
                let place = self.directory.entry(&mut cursor, at);
                if *place == u32::MAX {
                    *place = self.found.len() as u32;
                    self.found.push(at);
                    self.starts.push(0);
                }
                self.starts[*place as usize] += 1;
                self.reached.push(*place);
            });
            self.reached_by.push((self.reached.len() - before) as u16);
        }
    }

    fn put_in_order(&mut self, order: &mut impl FnMut(Coord) -> Option<u64>) {
        self.blocks.clear();
        for (found, &at) in self.found.iter().enumerate() {
            if let Some(key) = order(at) {
                self.blocks.push(Block { at, key, found: found as u32 });
            }
        }
        self.blocks.sort_unstable_by_key(|block| (block.key, block.at[2], block.at[1], block.at[0]));
        self.rank.clear();
        self.rank.resize(self.found.len(), NOBODY);
        for (rank, block) in self.blocks.iter().enumerate() {
            self.rank[block.found as usize] = rank as u32;
        }
    }

    /// The particles that reach a block.
    pub(crate) fn members(&self, block: &Block) -> &[u32] {
        let at = block.found as usize;
        &self.members[self.starts[at] as usize..self.starts[at + 1] as usize]
    }

    /// Places in the order of the 27 blocks around a block, itself in the middle, x fastest; [`NOBODY`] where there is none
    /// or it is left out.
    pub(crate) fn around(&self, block: &Block) -> [u32; 27] {
        let mut cursor = Cursor::default();
        std::array::from_fn(|i| {
            let by = [i % 3, i / 3 % 3, i / 9].map(|v| v as i32 - 1);
            self.directory.get(&mut cursor, plus(block.at, by)).map_or(NOBODY, |found| self.rank[found as usize])
        })
    }

    /// Bytes in use.
    pub(crate) fn bytes(&self) -> usize {
        self.members.len() * 8 + self.reached_by.len() * 2 + self.found.len() * (12 + 8 + size_of::<Block>())
    }
}

/// Calls `work` with every block of which the particle may reach a node, those of a shared face included.
#[inline(always)]
fn for_each_reached(particle: &Placed, size: &[Divisor; 3], mut work: impl FnMut(Coord)) {
    let (mut first, mut end) = ([0; 3], [0; 3]);
    for a in 0..3 {
        let low = particle.node[a] + ceil_f32(particle.offset[a] - particle.reach);
        let high = particle.node[a] + floor_f32(particle.offset[a] + particle.reach);
        (first[a], end[a]) = (size[a].floor(low - 1), size[a].floor(high) + 1);
    }
    for z in first[2]..end[2] {
        for y in first[1]..end[1] {
            for x in first[0]..end[0] {
                work([x, y, z]);
            }
        }
    }
}
