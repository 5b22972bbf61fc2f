//! Marching cubes on blocks with a cell size each, without cracks where the sizes change.
//!
//! ```text
//! blocks   listed, with balanced levels, and what lies around each    bricks::levels, around
//! sample   every node of a block, its high border included ──► signs  Source, rows
//! number   owned crossed edges, a base for each row                   rows
//! count    triangles of cells and transition cells                    cells
//! sum      where each block's vertices and triangles go
//! emit     into slices of the caller's                                vertices, cells or (for a viewer) order
//! ```
//!
//! Between a coarse block and a finer one lies a layer of *transition cells*, one on each face of a coarse cell: their fine
//! side is the faces of the fine cells, their coarse side that of the coarse cell, their sides those of the next transition
//! cell, around the edges and corners of blocks, too. Cells of all kinds draw the same segments on the faces that they
//! share ([`super::tables`]), so the surface is a closed 2-manifold whatever the signs and however the levels lie. A vertex
//! is a crossed edge and gets its number by counting.
//!
//! A node must have one value, whichever block asks for it: that is the source's duty. Nodes that touch an absent block
//! are outside; a field that is not is cut off there, and closed.
//!
//! Transition cells have no room of their own: the coarse nodes on the border move a quarter of a coarse cell away from the
//! finer blocks (`around`), and vertices on their edges move along, but only along the surface: the part of the move along
//! the normal is left out, so that no vertex leaves the surface to first order.
//!
//! Source: Lengyel, Transition cells for dynamic multiresolution marching cubes, 2010, with tables, edges and corners of
//! this project's.

pub(crate) mod around;
mod cells;
mod columned;
mod order;
pub(crate) mod rows;
mod surface;
mod vertices;

#[cfg(test)]
mod tests;

use crate::lattice::Coord;

pub(crate) use columned::{Columned, Scratch};
pub(crate) use surface::{Pool, Surface, fit_pool};
pub(crate) use vertices::{Place, Vertices};

/// The nodes of one block: `n` + 1 along each axis, the first at `first`, `stride` apart, on the finest lattice.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grid {
    pub(crate) first: Coord,
    pub(crate) stride: i32,
    pub(crate) n: usize,
}

impl Grid {
    /// Number of nodes.
    pub(crate) fn len(&self) -> usize {
        (self.n + 1).pow(3)
    }

    /// Place of a node among all, x fastest.
    #[inline(always)]
    pub(crate) fn place(&self, [i, j, k]: [usize; 3]) -> usize {
        i + (self.n + 1) * (j + (self.n + 1) * k)
    }

    /// A node of the block on the finest lattice.
    #[inline(always)]
    pub(crate) fn node(&self, at: [usize; 3]) -> Coord {
        std::array::from_fn(|a| self.first[a] + self.stride * at[a] as i32)
    }
}

/// What is known of one block's nodes, placed by [`Grid::place`].
pub(crate) struct Samples<C> {
    pub(crate) values: Vec<f32>,
    /// Against the gradient, of any length.
    pub(crate) outward: Vec<[f32; 3]>,
    /// The user's data.
    pub(crate) corners: Vec<C>,
}

impl<C> Default for Samples<C> {
    fn default() -> Self {
        Self { values: Vec::new(), outward: Vec::new(), corners: Vec::new() }
    }
}

/// Nodes of a block: bit i of word j + (n + 1)·k is node (i, j, k).
pub(crate) type NodeSet = Vec<u64>;

/// A field, sampled block by block. A node's value depends on the node alone, not on the block that asks.
pub(crate) trait Source: Sync {
    /// What one thread needs.
    type Scratch: Default + Send;
    /// The user's data of a node.
    type Corner: Copy + Default + Send;
    /// The user's data of a vertex.
    type Vertex: Copy + Default + Send;

    /// Writes the values of all nodes of listed block `block`. Where a cell's corners all lie on one side of the isovalue,
    /// any values on that side will do.
    fn values(&self, scratch: &mut Self::Scratch, block: usize, grid: Grid, to: &mut [f32]);

    /// Writes values, outward vectors and the user's data of the nodes in `nodes`.
    fn shade(
        &self,
        scratch: &mut Self::Scratch,
        block: usize,
        grid: Grid,
        nodes: &NodeSet,
        to: &mut Samples<Self::Corner>,
    );

    /// Data of the vertex at `t` (0..=1) of the way between two nodes.
    fn mix(&self, ends: [Self::Corner; 2], t: f32) -> Self::Vertex;
}
