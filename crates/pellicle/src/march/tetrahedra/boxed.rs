//! A box of samples as a source: bricks in rows, rows in planes, planes in the box.
//!
//! Lattice cell (i, j, k) begins at node (i, j, k) of the box; bricks begin at −1, so that what closes a surface at the
//! border, or stands beyond an open one, has its place. Beyond the border of a *closed* box nodes are absent. An *open* box
//! ends there; only where the split has middles, that of a cell just beyond the border is drawn into the face on the
//! border, so that the tetrahedra across it fill the box exactly.
//!
//! Source: this project.

use super::source::{ABSENT, Presence, Source};
use crate::lattice::Coord;

/// Samples at the nodes of a box.
pub(crate) trait Cubic: Sync {
    /// Nodes along each axis, at least 2.
    fn nodes(&self) -> [usize; 3];

    /// Whether surfaces end open at the border.
    fn is_open(&self) -> bool;

    /// Values of consecutive nodes along the first axis, relative to the isovalue; never NaN, [`ABSENT`] where absent. All
    /// are in the box.
    fn row(&self, from: [usize; 3], to: &mut [f64]);

    /// Whether values can be had anywhere in the box, by [`at`](Self::at). Else the middle of a cell is worth the mean of its
    /// corners, as the trilinear interpolant has it.
    const ANYWHERE: bool = false;

    /// Values at places in the box, in units of cells.
    fn at(&self, _places: &[[f64; 3]], to: &mut [f64]) {
        to.fill(ABSENT);
    }

    /// See [`Source::place`].
    fn place(&self, at: [f64; 3]) -> [f64; 3];

    /// See [`Source::is_left_handed`].
    fn is_left_handed(&self) -> bool;
}

/// A box of samples, cut into bricks.
pub(crate) struct Boxed<S> {
    pub(crate) samples: S,
    nodes: [i32; 3],
    bricks: [usize; 3],
    is_open: bool,
}

/// Most nodes along an axis of a cube that [`Boxed::corners`] loads.
const MOST_SIDE: usize = 7;
/// Most nodes of a cube that is asked for.
const MOST_NODES: usize = 216;

impl<S: Cubic> Boxed<S> {
    pub(crate) fn new(samples: S) -> Self {
        let (nodes, is_open) = (samples.nodes(), samples.is_open());
        // From −1 to one beyond the last node.
        let bricks = nodes.map(|n| (n + 2).div_ceil(4));
        Self { samples, nodes: nodes.map(|n| n as i32), bricks, is_open }
    }

    /// Number of bricks, which may be more than can be counted in memory.
    pub(crate) fn brick_count(nodes: [usize; 3]) -> u128 {
        nodes.iter().map(|&n| (n as u128 + 2).div_ceil(4)).product()
    }

    /// Nodes along each axis.
    pub(crate) fn nodes(&self) -> [i32; 3] {
        self.nodes
    }

    /// Value of one node.
    pub(crate) fn value(&self, site: usize, cell: Coord) -> f64 {
        let mut to = [0.0];
        self.cube(site, cell, 1, &mut to);
        to[0]
    }

    /// Whether the cell is one of the box.
    pub(crate) fn is_cell(&self, cell: Coord) -> bool {
        (0..3).all(|a| (0..self.nodes[a] - 1).contains(&cell[a]))
    }

    fn cube(&self, site: usize, low: Coord, side: usize, to: &mut [f64]) {
        if S::ANYWHERE {
            self.anywhere(site, low, side, to);
        } else if site == 0 {
            self.corners(low, side, false, to);
        } else {
            self.middles(low, side, to);
        }
    }

    /// Values of corners; beyond the box absent, or those of the border when `clamp` is set.
    fn corners(&self, low: Coord, side: usize, clamp: bool, to: &mut [f64]) {
        for (row, to) in to.chunks_exact_mut(side).enumerate() {
            let mut at = [low[0], low[1] + (row % side) as i32, low[2] + (row / side) as i32];
            if clamp {
                at = [at[0], at[1].clamp(0, self.nodes[1] - 1), at[2].clamp(0, self.nodes[2] - 1)];
            }
            let is_row = (1..3).all(|a| (0..self.nodes[a]).contains(&at[a]));
            let first = (-at[0]).clamp(0, side as i32) as usize;
            let end = (self.nodes[0] - at[0]).clamp(first as i32, side as i32) as usize;
            if !is_row || first >= end {
                to.fill(ABSENT);
                continue;
            }
            self.samples.row([(at[0] + first as i32) as usize, at[1] as usize, at[2] as usize], &mut to[first..end]);
            let (below, above) = if clamp { (to[first], to[end - 1]) } else { (ABSENT, ABSENT) };
            to[..first].fill(below);
            to[end..].fill(above);
        }
    }

    /// Evaluates all that is in the box at once.
    fn anywhere(&self, site: usize, low: Coord, side: usize, to: &mut [f64]) {
        let (mut places, mut indices, mut len) = ([[0.0; 3]; MOST_NODES], [0u16; MOST_NODES], 0);
        for n in 0..to.len() {
            let cell = [n % side, n / side % side, n / (side * side)];
            let cell: Coord = std::array::from_fn(|a| low[a] + cell[a] as i32);
            let exists = match (site, self.is_open) {
                (0, _) => (0..3).all(|a| (0..self.nodes[a]).contains(&cell[a])),
                (_, true) => self.middle_exists(cell),
                (_, false) => self.is_cell(cell),
            };
            if exists {
                (places[len], indices[len]) = (self.position(site, cell), n as u16);
                len += 1;
            }
        }
        let mut values = [0.0; MOST_NODES];
        self.samples.at(&places[..len], &mut values[..len]);
        to.fill(ABSENT);
        for (index, value) in indices.into_iter().zip(values).take(len) {
            to[usize::from(index)] = value;
        }
    }

    fn middles(&self, low: Coord, side: usize, to: &mut [f64]) {
        let mut corners = [0.0; MOST_SIDE * MOST_SIDE * MOST_SIDE];
        let wide = side + 1;
        let corners = &mut corners[..wide * wide * wide];
        self.corners(low, wide, self.is_open, corners);
        for (n, to) in to.iter_mut().enumerate() {
            let at = [n % side, n / side % side, n / (side * side)];
            let corner =
                |c: usize| corners[at[0] + (c & 1) + wide * (at[1] + (c >> 1 & 1) + wide * (at[2] + (c >> 2)))];
            // An absent corner makes the sum infinitely low, so the middle absent. In pairs, so that mirrored volumes sum alike.
            let sum: f64 =
                (corner(0) + corner(7)) + (corner(1) + corner(6)) + ((corner(2) + corner(5)) + (corner(3) + corner(4)));
            *to = sum * 0.125;
        }
    }

    /// Place of a cell's middle; of one beyond an open border, in the face on it.
    fn middle(&self, cell: Coord) -> [f64; 3] {
        std::array::from_fn(|a| {
            let at = f64::from(cell[a]) + 0.5;
            if self.is_open { at.clamp(0.0, f64::from(self.nodes[a] - 1)) } else { at }
        })
    }

    /// Whether a cell of an open box has a middle: it is in the box, or just beyond one face.
    fn middle_exists(&self, cell: Coord) -> bool {
        let beyond = (0..3).filter(|&a| !(0..self.nodes[a] - 1).contains(&cell[a])).count();
        beyond == 0 || (beyond == 1 && (0..3).all(|a| (-1..self.nodes[a]).contains(&cell[a])))
    }
}

impl<S: Cubic> Source for Boxed<S> {
    fn bricks(&self) -> usize {
        self.bricks.iter().product()
    }

    fn first(&self, brick: usize) -> Coord {
        let [x, y, _] = self.bricks;
        [brick % x, brick / x % y, brick / (x * y)].map(|b| 4 * b as i32 - 1)
    }

    fn neighbour(&self, brick: usize, d: [i32; 3]) -> Option<usize> {
        let [nx, ny, nz] = self.bricks;
        let at = [brick % nx, brick / nx % ny, brick / (nx * ny)];
        let [x, y, z]: [usize; 3] = std::array::from_fn(|a| at[a].wrapping_add_signed(d[a] as isize));
        (x < nx && y < ny && z < nz).then(|| x + nx * (y + ny * z))
    }

    fn values(&self, brick: usize, site: usize, low: i32, side: usize, to: &mut [f64]) {
        self.cube(site, self.first(brick).map(|c| c + low), side, to);
    }

    fn is_anywhere(&self) -> bool {
        S::ANYWHERE
    }

    fn values_at(&self, places: &[[f64; 3]], to: &mut [f64]) {
        self.samples.at(places, to);
    }

    fn presence(&self, brick: usize) -> Presence {
        let first = self.first(brick);
        // Away from the border of an open box, and everywhere in a closed one.
        if !self.is_open || (0..3).all(|a| first[a] >= 0 && first[a] + 4 < self.nodes[a]) {
            return Presence::ALL;
        }
        let set = |exists: &dyn Fn(Coord) -> bool| {
            (0..64).fold(0u64, |set, n| {
                let cell = [first[0] + (n & 3), first[1] + (n >> 2 & 3), first[2] + (n >> 4)];
                set | u64::from(exists(cell)) << n
            })
        };
        let corners = set(&|cell| (0..3).all(|a| (0..self.nodes[a]).contains(&cell[a])));
        Presence { sites: [corners, set(&|cell| self.middle_exists(cell))], interior: set(&|cell| self.is_cell(cell)) }
    }

    fn is_inner(&self, site: usize, cell: Coord) -> bool {
        // Beyond a closed border nodes are absent but where they belong.
        !self.is_open || (0..3).all(|a| (1..self.nodes[a] - 1 - site as i32).contains(&cell[a]))
    }

    fn position(&self, site: usize, cell: Coord) -> [f64; 3] {
        if site == 0 { cell.map(f64::from) } else { self.middle(cell) }
    }

    fn place(&self, at: [f64; 3]) -> [f64; 3] {
        self.samples.place(at)
    }

    fn is_left_handed(&self) -> bool {
        self.samples.is_left_handed()
    }
}
