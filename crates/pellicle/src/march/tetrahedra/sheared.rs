//! The simplex lattice: the six-split on axes sheared so that its tetrahedra are all alike and nearly regular.
//!
//! Node (i, j, k) lies at ½ (−i + j + k, i − j + k, i + j − k), in units of cells. Its axes are three half body diagonals of
//! a cube, and the split's body diagonal is the fourth; so the nodes are the body-centred lattice, and the
//! tetrahedra, all congruent, are those of [`super::splits::BCC`]. What differs is how they are numbered: one site and seven
//! kinds of edges in place of two and fourteen, simple to generate, but a box of cells is a slanted body in it, of which four
//! times as many cells have to be looked at.
//!
//! In an open box there is nothing beyond the nodes, so surfaces end up to half a cell before the border.
//!
//! Source: the simplex grid of Uralsky 2006; the shear is that of Perlin, Noise hardware, 2001 (simplex noise).

use super::{
    boxed::{Boxed, Cubic},
    source::{Presence, Source},
};
use crate::lattice::Coord;

/// A box of samples on the simplex lattice.
pub(crate) struct Sheared<S> {
    boxed: Boxed<S>,
    is_open: bool,
    bricks: [usize; 3],
}

/// The first node, so that what closes a box has its place.
const FIRST: i32 = -4;

impl<S: Cubic> Sheared<S> {
    pub(crate) fn new(samples: S) -> Self {
        let is_open = samples.is_open();
        let boxed = Boxed::new(samples);
        let bricks = Self::bricks_along(boxed.nodes().map(|n| n as usize));
        Self { boxed, is_open, bricks }
    }

    /// i = y + z, j = x + z, k = x + y: from −2 to the sum of two sides and 1, for cells that begin one earlier.
    fn bricks_along([x, y, z]: [usize; 3]) -> [usize; 3] {
        [y + z, x + z, x + y].map(|n| (n + 2 + FIRST.unsigned_abs() as usize).div_ceil(4))
    }

    /// Number of bricks, which may be more than can be counted in memory.
    pub(crate) fn brick_count(nodes: [usize; 3]) -> u128 {
        Self::bricks_along(nodes).iter().map(|&n| n as u128).product()
    }

    /// Site and cell, in the box, of a node.
    fn in_box([i, j, k]: Coord) -> (usize, Coord) {
        let doubled = [j + k - i, i + k - j, i + j - k];
        // All three are even or all are odd.
        ((doubled[0] & 1) as usize, doubled.map(|d| d >> 1))
    }
}

impl<S: Cubic> Source for Sheared<S> {
    fn bricks(&self) -> usize {
        self.bricks.iter().product()
    }

    fn first(&self, brick: usize) -> Coord {
        let [x, y, _] = self.bricks;
        [brick % x, brick / x % y, brick / (x * y)].map(|b| 4 * b as i32 + FIRST)
    }

    fn neighbour(&self, brick: usize, d: [i32; 3]) -> Option<usize> {
        let [nx, ny, nz] = self.bricks;
        let at = [brick % nx, brick / nx % ny, brick / (nx * ny)];
        let [x, y, z]: [usize; 3] = std::array::from_fn(|a| at[a].wrapping_add_signed(d[a] as isize));
        (x < nx && y < ny && z < nz).then(|| x + nx * (y + ny * z))
    }

    fn values(&self, brick: usize, _: usize, low: i32, side: usize, to: &mut [f64]) {
        let first = self.first(brick);
        for (n, to) in to.iter_mut().enumerate() {
            let at = [n % side, n / side % side, n / (side * side)];
            let (site, cell) = Self::in_box(std::array::from_fn(|a| first[a] + low + at[a] as i32));
            *to = self.boxed.value(site, cell);
        }
    }

    fn signs(&self, brick: usize, site: usize) -> u64 {
        // Most bricks miss the box: x, y, z are half of sums of i, j, k, from least to greatest.
        let [i, j, k] = self.first(brick);
        let misses = [j + k - i, i + k - j, i + j - k]
            .into_iter()
            .zip(self.boxed.nodes())
            .any(|(d, n)| d + 6 < 0 || d - 3 > 2 * n);
        if misses {
            return 0;
        }
        let mut values = [0.0; 64];
        self.values(brick, site, 0, 4, &mut values);
        values.iter().enumerate().fold(0, |set, (n, &v)| set | u64::from(v > 0.0) << n)
    }

    fn is_anywhere(&self) -> bool {
        self.boxed.is_anywhere()
    }

    fn values_at(&self, places: &[[f64; 3]], to: &mut [f64]) {
        self.boxed.values_at(places, to);
    }

    fn presence(&self, brick: usize) -> Presence {
        if !self.is_open {
            return Presence::ALL;
        }
        let first = self.first(brick);
        let exists = (0..64i32).fold(0u64, |set, n| {
            let (site, cell) = Self::in_box([first[0] + (n & 3), first[1] + (n >> 2 & 3), first[2] + (n >> 4)]);
            let is_there = if site == 1 {
                self.boxed.is_cell(cell)
            } else {
                (0..3).all(|a| (0..self.boxed.nodes()[a]).contains(&cell[a]))
            };
            set | u64::from(is_there) << n
        });
        Presence { sites: [exists; 2], interior: exists }
    }

    fn position(&self, _: usize, cell: Coord) -> [f64; 3] {
        let [i, j, k] = cell.map(f64::from);
        [0.5 * (j + k - i), 0.5 * (i + k - j), 0.5 * (i + j - k)]
    }

    fn end(&self, from: (usize, [f64; 3]), to: (usize, [f64; 3])) -> f64 {
        let is_middle = |at: [f64; 3]| at[0].fract() != 0.0;
        if is_middle(from.1) && is_middle(to.1) { 0.5 } else { 0.0 }
    }

    fn place(&self, at: [f64; 3]) -> [f64; 3] {
        self.boxed.place(at)
    }

    fn is_left_handed(&self) -> bool {
        self.boxed.is_left_handed()
    }
}
