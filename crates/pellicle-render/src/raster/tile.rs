//! One tile: for each sample the key and the id of what is nearest.

use crate::raster::ball::Ball;
use crate::raster::{Corner, Grid, SUBPIXELS, TILE};
use crate::view::View;

/// The id of what is not there.
pub(crate) const NOTHING: u32 = u32::MAX;

/// Where the N samples of a pixel are, in 1/256 pixel from its upper left corner. Every column and every row of an N × N
/// grid has one, so that borders along either axis get N steps; their mean is the pixel's middle.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pattern<const N: usize> {
    pub x: [i32; N],
    pub y: [i32; N],
}

impl<const N: usize> Pattern<N> {
    pub fn new() -> Self {
        let step = SUBPIXELS / N as i32;
        // Rows by a step that is coprime to N and spreads neighbours far apart; four have the classic rotated grid.
        let row = |i: usize| match N {
            4 => (2 * i + 1) % 5,
            8 => (3 * i + 1) % 8,
            16 => (5 * i + 2) % 16,
            _ => i,
        };
        let place = |i: usize| i as i32 * step + step / 2;
        Self { x: std::array::from_fn(place), y: std::array::from_fn(|i| place(row(i))) }
    }

    /// Least and largest place along either axis.
    pub fn reach(&self) -> [i32; 2] {
        let step = SUBPIXELS / N as i32;
        [step / 2, SUBPIXELS - step + step / 2]
    }
}

/// A tile under construction; reused from tile to tile.
pub(crate) struct Tile<const N: usize> {
    pattern: Pattern<N>,
    /// First pixel.
    pub x: u32,
    pub y: u32,
    /// Pixels that are within the picture.
    pub width: u32,
    pub height: u32,
    keys: Vec<[f32; N]>,
    ids: Vec<[u32; N]>,
}

impl<const N: usize> Tile<N> {
    pub fn new() -> Self {
        let pixels = (TILE * TILE) as usize;
        let (keys, ids) = (vec![[0.0; N]; pixels], vec![[NOTHING; N]; pixels]);
        Self { pattern: Pattern::new(), x: 0, y: 0, width: 0, height: 0, keys, ids }
    }

    /// Moves to a tile of the picture and empties it.
    pub fn start(&mut self, grid: &Grid, tile: u32) {
        (self.x, self.y) = (tile % grid.tiles_across() * TILE, tile / grid.tiles_across() * TILE);
        (self.width, self.height) = (TILE.min(grid.width - self.x), TILE.min(grid.height - self.y));
        self.keys.fill([f32::NEG_INFINITY; N]);
        self.ids.fill([NOTHING; N]);
    }

    /// The ids of one pixel's samples, counted from the tile's corner.
    pub fn samples(&self, x: u32, y: u32) -> &[u32; N] {
        &self.ids[(y * TILE + x) as usize]
    }

    /// Place of a sample in 1/256 pixel from its pixel's corner.
    pub fn pattern(&self) -> &Pattern<N> {
        &self.pattern
    }

    /// Pixels of the tile, first and last along each axis, that can have a sample within a box in 1/256 pixel.
    #[inline(always)]
    fn clip(&self, grid: &Grid, x: [i32; 2], y: [i32; 2]) -> Option<[[u32; 2]; 2]> {
        let across = grid.pixels(x[0], x[1], grid.width)?;
        let down = grid.pixels(y[0], y[1], grid.height)?;
        let within = |p: [u32; 2], first: u32, size: u32| {
            let (a, b) = (p[0].max(first), p[1].min(first + size - 1));
            (a <= b).then_some([a, b])
        };
        Some([within(across, self.x, self.width)?, within(down, self.y, self.height)?])
    }

    /// Draws what of a triangle is in the tile.
    ///
    /// For each edge, E(p) = (b − a) × (p − a), twice the area of a triangle; all three are positive inside. They are
    /// integers below 2^50, which `f64` holds exactly. Divided by the whole triangle's they are the weights of the corners.
    #[inline(always)]
    pub fn triangle(&mut self, grid: &Grid, id: u32, flat: [Corner; 3]) {
        let [a, mut b, mut c] = flat;
        let area = f64::from(b.x - a.x) * f64::from(c.y - a.y) - f64::from(b.y - a.y) * f64::from(c.x - a.x);
        if area == 0.0 {
            return;
        }
        if area < 0.0 {
            std::mem::swap(&mut b, &mut c);
        }
        let area = area.abs();
        let (x, y) = ([a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x)], [a.y.min(b.y).min(c.y), a.y.max(b.y).max(c.y)]);
        let Some([columns, rows]) = self.clip(grid, x, y) else { return };

        let (px, py) = (columns[0] as i32 * SUBPIXELS, rows[0] as i32 * SUBPIXELS);
        let edges = [Edge::new(b, c, px, py), Edge::new(c, a, px, py), Edge::new(a, b, px, py)];
        let offsets: [[f64; N]; 3] = std::array::from_fn(|k| {
            std::array::from_fn(|s| {
                edges[k].dx * f64::from(self.pattern.x[s]) + edges[k].dy * f64::from(self.pattern.y[s])
            })
        });
        // A pixel can be left at once where the best of its samples is outside of an edge.
        let least: [f64; 3] =
            std::array::from_fn(|k| edges[k].least - offsets[k].iter().fold(f64::NEG_INFINITY, |m, &o| m.max(o)));
        let share = 1.0 / area;
        let (key, to_b, to_c) = (a.key, b.key - a.key, c.key - a.key);

        let step = f64::from(SUBPIXELS);
        let mut start = edges.map(|e| e.value);
        for row in rows[0]..=rows[1] {
            let line = ((row - self.y) * TILE) as usize;
            let mut e = start;
            for column in columns[0]..=columns[1] {
                if e[0] >= least[0] && e[1] >= least[1] && e[2] >= least[2] {
                    let at = line + (column - self.x) as usize;
                    let (keys, ids) = (&mut self.keys[at], &mut self.ids[at]);
                    for s in 0..N {
                        let w = [e[0] + offsets[0][s], e[1] + offsets[1][s], e[2] + offsets[2][s]];
                        if w[0] >= edges[0].least && w[1] >= edges[1].least && w[2] >= edges[2].least {
                            let near = key + (w[1] * share) as f32 * to_b + (w[2] * share) as f32 * to_c;
                            keep(&mut keys[s], &mut ids[s], near, id);
                        }
                    }
                }
                for k in 0..3 {
                    e[k] += edges[k].dx * step;
                }
            }
            for k in 0..3 {
                start[k] += edges[k].dy * step;
            }
        }
    }

    /// Draws what of a sphere is in the tile: each sample's ray meets it at its own depth.
    pub fn ball(&mut self, view: &View, grid: &Grid, id: u32, ball: &Ball) {
        let Some(extent) = ball.extent(view) else { return };
        let fixed = |x: f64, outward: f64| (x.clamp(-20_000.0, 20_000.0) * f64::from(SUBPIXELS) + outward) as i32;
        let x = [fixed(extent[0], -2.0), fixed(extent[2], 2.0)];
        let y = [fixed(extent[1], -2.0), fixed(extent[3], 2.0)];
        let Some([columns, rows]) = self.clip(grid, x, y) else { return };
        for row in rows[0]..=rows[1] {
            for column in columns[0]..=columns[1] {
                let at = ((row - self.y) * TILE + column - self.x) as usize;
                for s in 0..N {
                    let place = |pixel: u32, sample: i32| f64::from(pixel) + f64::from(sample) / f64::from(SUBPIXELS);
                    let ray = view.ray(place(column, self.pattern.x[s]), place(row, self.pattern.y[s]));
                    if let Some(hit) = ball.meet(&ray, view.near) {
                        keep(&mut self.keys[at][s], &mut self.ids[at][s], view.key(hit.depth), id);
                    }
                }
            }
        }
    }
}

/// The nearer stays; of two at the same depth the lower id, whichever comes first.
#[inline(always)]
fn keep(key: &mut f32, id: &mut u32, new_key: f32, new_id: u32) {
    if new_key > *key || (new_key == *key && new_id < *id) {
        *key = new_key;
        *id = new_id;
    }
}

/// One edge's function over the picture.
#[derive(Debug, Clone, Copy)]
struct Edge {
    /// At the corner of the first pixel.
    value: f64,
    /// Its steps for 1/256 pixel to the right and down.
    dx: f64,
    dy: f64,
    /// From here on a sample is inside: 0 where the edge itself belongs to the triangle, else 1.
    least: f64,
}

impl Edge {
    /// From `a` to `b`, of a triangle whose area is positive with y down.
    #[inline(always)]
    fn new(a: Corner, b: Corner, px: i32, py: i32) -> Self {
        let (across, down) = (b.x - a.x, b.y - a.y);
        let (dx, dy) = (-f64::from(down), f64::from(across));
        let value = dx * f64::from(px - a.x) + dy * f64::from(py - a.y);
        // With y down and positive area the inside is to the right of the edge's direction: a left edge goes up, a top edge
        // goes right.
        let owns = down < 0 || (down == 0 && across > 0);
        Self { value, dx, dy, least: if owns { 0.0 } else { 1.0 } }
    }
}
