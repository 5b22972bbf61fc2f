//! Where tetrahedra get their samples from: bricks of 4×4×4 cells, wherever they come from.
//!
//! Values are relative to the isovalue and `f64`: a node is inside when its value is greater than 0. A node may be *absent*:
//! it is outside and infinitely low, and the surface ends in the last node that is present.
//!
//! Source: this project.

use crate::lattice::Coord;

/// Value of an absent node.
pub(crate) const ABSENT: f64 = f64::NEG_INFINITY;

/// Which nodes of a brick take part. Where a lattice is open, nothing is made of the others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Presence {
    /// Nodes that exist, by site.
    pub(crate) sites: [u64; 2],
    /// Nodes of site 1 that are not on the border of an open lattice.
    pub(crate) interior: u64,
}

impl Presence {
    /// All nodes take part.
    pub(crate) const ALL: Self = Self { sites: [u64::MAX; 2], interior: u64::MAX };
}

/// Samples of a lattice.
pub(crate) trait Source: Sync {
    /// Number of bricks.
    fn bricks(&self) -> usize;

    /// First cell of a brick.
    fn first(&self, brick: usize) -> Coord;

    /// The brick that lies `d` bricks further, if there is one. Where there is none, all is of the sign that the nodes have
    /// that touch it.
    fn neighbour(&self, brick: usize, d: [i32; 3]) -> Option<usize>;

    /// Values of the nodes of one site in a cube of `side` cells along each axis, x fastest, whose lowest cell is the
    /// brick's first moved by `low` along each axis.
    fn values(&self, brick: usize, site: usize, low: i32, side: usize, to: &mut [f64]);

    /// Whether there are values between nodes, too.
    fn is_anywhere(&self) -> bool {
        false
    }

    /// Values at places in units of cells, within the lattice, where [`is_anywhere`](Self::is_anywhere) says so.
    fn values_at(&self, _places: &[[f64; 3]], to: &mut [f64]) {
        to.fill(ABSENT);
    }

    /// Signs of the nodes of one site.
    fn signs(&self, brick: usize, site: usize) -> u64 {
        let mut values = [0.0; 64];
        self.values(brick, site, 0, 4, &mut values);
        values.iter().enumerate().fold(0, |set, (n, &v)| set | u64::from(v > 0.0) << n)
    }

    /// Which nodes of a brick take part.
    fn presence(&self, brick: usize) -> Presence;

    /// Whether a node and its neighbours in the body-centred lattice all take part and lie where they belong.
    fn is_inner(&self, _site: usize, _cell: Coord) -> bool {
        true
    }

    /// Place of a node in units of cells.
    fn position(&self, site: usize, cell: Coord) -> [f64; 3] {
        cell.map(|c| f64::from(c) + 0.5 * site as f64)
    }

    /// Where on the edge from an inside node to an absent one, both by site and place, the surface crosses it: 0 at the
    /// inside node. From middle to middle it is in the face between.
    fn end(&self, from: (usize, [f64; 3]), to: (usize, [f64; 3])) -> f64 {
        if from.0 == 1 && to.0 == 1 { 0.5 } else { 0.0 }
    }

    /// A place in units of cells as an offset from the mesh's origin, in world units.
    fn place(&self, at: [f64; 3]) -> [f64; 3];

    /// Whether [`place`](Self::place) turns right hands into left ones.
    fn is_left_handed(&self) -> bool;
}
