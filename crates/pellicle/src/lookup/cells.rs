//! Particles sorted into cells of one support radius.
//!
//! ```text
//! chunks      sorted by Morton code; 4×4×4 cells each, x fastest
//! cell_start  chunk · 64 + cell ──► range of particles
//! x y z       offsets from the chunk's corner in support units      (structure of arrays, padded for loads)
//! order       index in the caller's order
//! ```
//!
//! The order of the particles (chunk, cell, caller's index) is canonical: it depends on the particles alone, not on the
//! number of threads. Only chunks that hold a particle exist, so that a stray particle costs nothing.
//!
//! Guarantees: every particle is finite and within the lattice, else an error names the first that is not. Memory:
//! 21 bytes a particle and about 300 a chunk.
//!
//! Source: the sorted cells are those of Ihmsen et al. 2011, A Parallel SPH Implementation on Multi-Core CPUs, as Akinci
//! et al. 2012, section 4.1, use them; two levels instead of one flat array keep them sparse.

use std::sync::atomic::{AtomicU32, Ordering};

use rayon::prelude::*;

use super::directory::{Cursor, Directory};
use crate::{
    Error, Positions,
    lattice::{CHUNK, Coord, Lattice, floor, morton},
    math::{
        ranges::{PerItem, for_each_part},
        simd::LANES,
    },
};

/// Cells of a chunk.
pub(crate) const CELLS: usize = (CHUNK * CHUNK * CHUNK) as usize;

/// Particles in canonical order. Reusable: [`build`](Self::build) keeps the memory.
#[derive(Default)]
pub(crate) struct Cells {
    pub(crate) chunks: Vec<Coord>,
    pub(crate) cell_start: Vec<u32>,
    pub(crate) x: Vec<f32>,
    pub(crate) y: Vec<f32>,
    pub(crate) z: Vec<f32>,
    /// Padded for loads like the axes.
    order: Vec<u32>,
    len: usize,
    directory: Directory,
    by_chunk: Vec<AtomicU32>,
    /// Each particle's cell in its chunk, in the caller's order.
    cell_of: Vec<u8>,
    chunk_start: Vec<u32>,
    blocks: Vec<Block>,
}

/// A run of the caller's particles, handled by one thread.
#[derive(Default)]
struct Block {
    directory: Directory,
    chunks: Vec<Coord>,
    /// First how many particles of the block each chunk gets, then the place of the next one.
    places: Vec<u32>,
    error: Option<Error>,
}

/// Index of a cell in its chunk.
#[inline(always)]
pub(crate) const fn cell_index(x: i32, y: i32, z: i32) -> usize {
    (x + CHUNK * y + CHUNK * CHUNK * z) as usize
}

impl Cells {
    /// Number of particles.
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// Each particle's index in the caller's order.
    pub(crate) fn order(&self) -> &[u32] {
        &self.order[..self.len]
    }

    /// Each particle's index in the caller's order, as the bits of an `f32`: a column like any other, to be moved but not
    /// computed with.
    pub(crate) fn order_bits(&self) -> &[f32] {
        bytemuck::cast_slice(&self.order)
    }

    /// Index of the chunk at these coordinates, if it holds particles.
    #[inline]
    pub(crate) fn chunk_at(&self, cursor: &mut Cursor, chunk: Coord) -> Option<usize> {
        self.directory.get(cursor, chunk).map(|i| i as usize)
    }

    /// Range of the particles in cells `first..=last` of a chunk, both in one row.
    #[inline(always)]
    pub(crate) fn run(&self, chunk: usize, first: usize, last: usize) -> std::ops::Range<usize> {
        self.cell_start[chunk * CELLS + first] as usize..self.cell_start[chunk * CELLS + last + 1] as usize
    }

    /// Range of all the particles of a chunk.
    pub(crate) fn chunk_range(&self, chunk: usize) -> std::ops::Range<usize> {
        self.run(chunk, 0, CELLS - 1)
    }

    /// Bytes that sorted particles take, chunks left out.
    pub(crate) const BYTES_PER_PARTICLE: u64 = 21;

    /// Sorts the particles.
    ///
    /// # Errors
    /// [`Error::NotFinite`], [`Error::OutsideLattice`] for the first such particle, [`Error::Count`] beyond `u32`.
    pub(crate) fn build(&mut self, positions: Positions<'_>, lattice: Lattice) -> Result<(), Error> {
        let n = positions.len();
        if n >= u32::MAX as usize {
            return Err(Error::Count { what: "particles", needed: n as u64, available: u64::from(u32::MAX - 1) });
        }
        // A block more than there are threads to share would only make more directories.
        let block = n.div_ceil(2 * rayon::current_num_threads()).max(1 << 12);
        self.find_chunks(positions, lattice, block)?;
        self.sort_chunks();
        self.place_by_chunk(block);
        self.place_by_cell(positions, lattice);
        Ok(())
    }

    /// Each block finds its chunks and counts their particles; `order` holds each particle's chunk, numbered in its block.
    fn find_chunks(&mut self, positions: Positions<'_>, lattice: Lattice, block: usize) -> Result<(), Error> {
        let n = positions.len();
        self.len = n;
        self.order.clear();
        self.order.resize(n + LANES, 0);
        self.blocks.resize_with(n.div_ceil(block), Block::default);
        let limit = lattice.limit();
        self.cell_of.resize(n.max(self.cell_of.len()), 0);
        let outputs = self.order[..n].par_chunks_mut(block).zip(self.cell_of.par_chunks_mut(block));
        self.blocks.par_iter_mut().zip(outputs).enumerate().for_each(|(b, (found, (chunk_of, cell_of)))| {
            found.clear();
            // Particles come in runs of near ones: the last chunk is the next one's most of the time.
            let (mut last, mut id, mut cursor) = ([i32::MIN; 3], 0, Cursor::default());
            for (i, (chunk_of, cell_of)) in chunk_of.iter_mut().zip(cell_of).enumerate() {
                let index = b * block + i;
                let u = lattice.to_support_units(positions.get(index));
                if !Lattice::fits(u, limit) {
                    found.error = lattice.check(index, positions.get(index)).err();
                    return;
                }
                let cell = u.map(floor);
                let chunk = cell.map(|c| c >> CHUNK.ilog2());
                let local = cell.map(|c| c & (CHUNK - 1));
                *cell_of = cell_index(local[0], local[1], local[2]) as u8;
                if chunk != last {
                    (last, id) = (chunk, found.id(&mut cursor, chunk));
                }
                found.places[id as usize] += 1;
                *chunk_of = id;
            }
        });
        self.blocks.iter_mut().find_map(|b| b.error.take()).map_or(Ok(()), Err)
    }

    /// Numbers the chunks in Morton order.
    fn sort_chunks(&mut self) {
        self.directory.clear();
        self.chunks.clear();
        let mut cursor = Cursor::default();
        for block in &self.blocks {
            for &chunk in &block.chunks {
                let id = self.directory.entry(&mut cursor, chunk);
                if *id == u32::MAX {
                    *id = 0;
                    self.chunks.push(chunk);
                }
            }
        }
        self.chunks.sort_by_cached_key(|&c| morton(c));
        for (i, &chunk) in self.chunks.iter().enumerate() {
            *self.directory.entry(&mut cursor, chunk) = i as u32;
        }
    }

    /// Scatters the particles' indices to their chunks, stably: block after block.
    fn place_by_chunk(&mut self, block: usize) {
        let n = self.len;
        self.cell_start.clear();
        self.cell_start.resize(self.chunks.len() * CELLS + 1, 0);
        let mut cursor = Cursor::default();
        let directory = &self.directory;
        let mut first_cell = |chunk: Coord| directory.get(&mut cursor, chunk).map_or(0, |i| i as usize * CELLS);
        // While the counts are summed, the first cell of each chunk holds the chunk's own count.
        for found in &self.blocks {
            for (&chunk, count) in found.chunks.iter().zip(&found.places) {
                self.cell_start[first_cell(chunk)] += count;
            }
        }
        let mut start = 0;
        for first in self.cell_start.iter_mut().step_by(CELLS) {
            start += std::mem::replace(first, start);
        }
        for found in &mut self.blocks {
            for (&chunk, place) in found.chunks.iter().zip(&mut found.places) {
                let next = &mut self.cell_start[first_cell(chunk)];
                *next += std::mem::replace(place, *next);
            }
        }
        // Each first cell now holds the end of its chunk, which is where the next one starts.
        for chunk in (1..=self.chunks.len()).rev() {
            self.cell_start[chunk * CELLS] = self.cell_start[(chunk - 1) * CELLS];
        }
        self.cell_start[0] = 0;

        self.by_chunk.resize_with(n.max(self.by_chunk.len()), AtomicU32::default);
        let by_chunk = &self.by_chunk;
        self.blocks.par_iter_mut().zip(self.order[..n].par_chunks(block)).enumerate().for_each(
            |(b, (found, chunk_of))| {
                for (i, &id) in chunk_of.iter().enumerate() {
                    let place = &mut found.places[id as usize];
                    // Places are disjoint; the atomic only says so to the compiler.
                    by_chunk[*place as usize].store((b * block + i) as u32, Ordering::Relaxed);
                    *place += 1;
                }
            },
        );
    }

    /// Sorts each chunk's particles by cell and writes their offsets.
    fn place_by_cell(&mut self, positions: Positions<'_>, lattice: Lattice) {
        let n = self.len;
        for axis in [&mut self.x, &mut self.y, &mut self.z] {
            axis.resize(n + LANES, 0.0);
        }
        self.chunk_start.clear();
        self.chunk_start.extend(self.cell_start.iter().step_by(CELLS));
        let (chunks, starts, by_chunk, cell_of) = (&self.chunks, &self.chunk_start, &self.by_chunk, &self.cell_of);
        let data = (
            (&mut self.x[..n], &mut self.y[..n], &mut self.z[..n]),
            &mut self.order[..n],
            PerItem(&mut self.cell_start[..chunks.len() * CELLS], CELLS),
        );
        for_each_part(0..chunks.len(), data, &|c| starts[c] as usize, &|c, ((x, y, z), order, cell_start)| {
            let base = starts[c];
            let members = &by_chunk[base as usize..base as usize + order.len()];
            let corner = chunks[c].map(|v| f64::from(v * CHUNK));
            let mut next = [0u32; CELLS];
            for member in members {
                next[usize::from(cell_of[member.load(Ordering::Relaxed) as usize]) % CELLS] += 1;
            }
            let mut start = 0;
            for (count, to) in next.iter_mut().zip(cell_start.0) {
                *to = base + start;
                start += std::mem::replace(count, start);
            }
            for member in members {
                let index = member.load(Ordering::Relaxed);
                let next = &mut next[usize::from(cell_of[index as usize]) % CELLS];
                let at = *next as usize;
                *next += 1;
                let u = lattice.to_support_units(positions.get(index as usize));
                (x[at], y[at], z[at]) =
                    ((u[0] - corner[0]) as f32, (u[1] - corner[1]) as f32, (u[2] - corner[2]) as f32);
                order[at] = index;
            }
        });
    }
}

impl Block {
    fn clear(&mut self) {
        self.directory.clear();
        self.chunks.clear();
        self.places.clear();
        self.error = None;
    }

    /// Number of a chunk in this block, given at its first appearance.
    fn id(&mut self, cursor: &mut Cursor, chunk: Coord) -> u32 {
        let id = self.directory.entry(cursor, chunk);
        if *id == u32::MAX {
            *id = self.chunks.len() as u32;
            self.chunks.push(chunk);
            self.places.push(0);
        }
        *id
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scattered(n: usize) -> Vec<[f32; 3]> {
        (0..n)
            .map(|i| [(i * 37 % 101) as f32 * 0.21, (i * 53 % 97) as f32 * 0.17 - 5.0, (i * i % 89) as f32 * -0.13])
            .collect()
    }

    #[test]
    fn every_particle_lies_in_its_cell_in_callers_order() {
        let positions = scattered(5000);
        let lattice = Lattice { spacing: 0.1, support: 0.8 };
        let mut cells = Cells::default();
        // Twice: the second run must not see the first.
        for n in [5000, 3000] {
            cells.build((&positions[..n]).into(), lattice).unwrap();
            let mut seen = vec![false; n];
            for (c, chunk) in cells.chunks.iter().enumerate() {
                assert_eq!(cells.chunk_at(&mut Cursor::default(), *chunk), Some(c));
                for cell in 0..CELLS {
                    let run = cells.run(c, cell, cell);
                    assert!(cells.order[run.clone()].is_sorted());
                    for i in run {
                        let index = cells.order[i] as usize;
                        seen[index] = true;
                        let u = lattice.to_support_units(positions[index].map(f64::from));
                        for a in 0..3 {
                            let local = (cell >> (2 * a) & 3) as i32;
                            assert_eq!(u[a].floor() as i32, chunk[a] * CHUNK + local);
                            let offset = [cells.x[i], cells.y[i], cells.z[i]][a];
                            assert!((f64::from(offset) + f64::from(chunk[a] * CHUNK) - u[a]).abs() < 1e-6);
                        }
                    }
                }
            }
            assert!(seen.iter().all(|&s| s));
        }
    }

    #[test]
    fn the_first_invalid_particle_is_named() {
        let mut positions = scattered(20_000);
        positions[17_000][1] = f32::NAN;
        positions[19_000][0] = f32::INFINITY;
        let error = Cells::default().build((&positions).into(), Lattice { spacing: 0.1, support: 0.8 }).unwrap_err();
        assert!(matches!(error, Error::NotFinite { index: 17_000, .. }), "{error}");
    }
}
