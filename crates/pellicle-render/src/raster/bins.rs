//! Which tile draws what: a list of ids for each tile.
//!
//! Primitives are binned in chunks, in parallel; a chunk sorts its own pairs of tile and id by counting, and a tile reads
//! the pieces of all chunks. What covers very many tiles is listed once for all: memory follows the number of primitives,
//! not the area that they cover.

use rayon::prelude::*;

use crate::raster::{Corner, SUBPIXELS, TILE};

/// The picture in tiles.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Grid {
    pub width: u32,
    pub height: u32,
    /// Least and largest place of a sample within its pixel, in 1/256 pixel.
    pub reach: [i32; 2],
}

/// A range of tiles, ends included.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Span {
    x: [u32; 2],
    y: [u32; 2],
}

/// More tiles than these and a primitive goes on the list for all.
const MANY: u32 = 16;

impl Grid {
    pub fn tiles_across(&self) -> u32 {
        self.width.div_ceil(TILE)
    }

    pub fn tiles(&self) -> u32 {
        self.tiles_across() * self.height.div_ceil(TILE)
    }

    /// First and last pixel along one axis that can have a sample between two places in 1/256 pixel.
    #[inline(always)]
    pub fn pixels(&self, least: i32, most: i32, size: u32) -> Option<[u32; 2]> {
        let first = (least - self.reach[1] + SUBPIXELS - 1).div_euclid(SUBPIXELS).max(0);
        let last = (most - self.reach[0]).div_euclid(SUBPIXELS).min(size as i32 - 1);
        (first <= last).then_some([first as u32, last as u32])
    }

    /// The tiles that a triangle may cover; nothing when it cannot hold a sample.
    #[inline(always)]
    pub fn span_of(&self, flat: [Corner; 3]) -> Option<Span> {
        let [a, b, c] = flat;
        let x = self.pixels(a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x), self.width)?;
        let y = self.pixels(a.y.min(b.y).min(c.y), a.y.max(b.y).max(c.y), self.height)?;
        Some(Span { x: x.map(|p| p / TILE), y: y.map(|p| p / TILE) })
    }

    /// The tiles of a rectangle in pixels: left, top, right, bottom.
    pub fn span_of_rectangle(&self, [left, top, right, bottom]: [f64; 4]) -> Option<Span> {
        let (width, height) = (f64::from(self.width), f64::from(self.height));
        // A pixel more than needed is no harm. False also for NaN.
        if !(left <= width && right >= 0.0 && top <= height && bottom >= 0.0) {
            return None;
        }
        let tile = |x: f64, size: f64| x.clamp(0.0, size - 1.0) as u32 / TILE;
        Some(Span { x: [tile(left, width), tile(right, width)], y: [tile(top, height), tile(bottom, height)] })
    }
}

/// The lists of one chunk.
struct Chunk {
    /// `ids[starts[t] .. starts[t + 1]]` are for tile t.
    starts: Vec<u32>,
    ids: Vec<u32>,
    /// For all tiles.
    large: Vec<u32>,
}

/// All lists.
pub(crate) struct Bins {
    chunks: Vec<Chunk>,
}

/// A chunk under construction.
pub(crate) struct Binner {
    across: u32,
    pairs: Vec<[u32; 2]>,
    large: Vec<u32>,
}

impl Binner {
    #[inline(always)]
    pub fn add(&mut self, id: u32, span: Span) {
        let Span { x, y } = span;
        if (x[1] - x[0] + 1) * (y[1] - y[0] + 1) > MANY {
            // Pieces of one triangle come one after the other.
            if self.large.last() != Some(&id) {
                self.large.push(id);
            }
            return;
        }
        for ty in y[0]..=y[1] {
            for tx in x[0]..=x[1] {
                self.pairs.push([ty * self.across + tx, id]);
            }
        }
    }

    fn finish(self, tiles: u32) -> Chunk {
        let mut starts = vec![0u32; tiles as usize + 1];
        for [tile, _] in &self.pairs {
            starts[*tile as usize + 1] += 1;
        }
        for tile in 1..starts.len() {
            starts[tile] += starts[tile - 1];
        }
        let mut next = starts.clone();
        let mut ids = vec![0u32; self.pairs.len()];
        for [tile, id] in self.pairs {
            let at = &mut next[tile as usize];
            ids[*at as usize] = id;
            *at += 1;
        }
        Chunk { starts, ids, large: self.large }
    }
}

impl Bins {
    pub const fn new() -> Self {
        Self { chunks: Vec::new() }
    }

    /// Bins `count` primitives; `bin` adds a range of them.
    pub fn extend(&mut self, grid: &Grid, count: usize, bin: impl Fn(std::ops::Range<usize>, &mut Binner) + Sync) {
        // The tiles' starts of all chunks together stay small beside the primitives.
        let size = (16 * 1024).max(count / 256);
        let chunks = (0..count.div_ceil(size)).into_par_iter().map(|chunk| {
            let range = chunk * size..((chunk + 1) * size).min(count);
            let pairs = Vec::with_capacity(range.len());
            let mut binner = Binner { across: grid.tiles_across(), pairs, large: Vec::new() };
            bin(range, &mut binner);
            binner.finish(grid.tiles())
        });
        self.chunks.par_extend(chunks);
    }

    /// The ids for one tile. One that is in pieces may come several times.
    pub fn of_tile(&self, tile: u32) -> impl Iterator<Item = u32> + '_ {
        let tile = tile as usize;
        self.chunks.iter().flat_map(move |chunk| {
            let own = &chunk.ids[chunk.starts[tile] as usize..chunk.starts[tile + 1] as usize];
            own.iter().chain(&chunk.large).copied()
        })
    }
}
