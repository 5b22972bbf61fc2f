//! Clusters: crossings that share one vertex, the crossed edges of a node that lie nearer to it than to their other end.
//!
//! ```text
//! claims      for each brick and kind of edge: cells whose crossing belongs to the first end's cluster, or to the second's
//! nodes       for each brick and site: nodes that have a cluster, and so a vertex
//! positions   of these vertices, by site and cell
//! ```
//!
//! A crossing that nobody claims keeps a vertex of its own.
//!
//! Source: vertex clustering is that of Treece, Prager, Gee, Regularised marching tetrahedra, 1999; see [`super::regular`].

use super::{
    count::{NONE, above},
    source::Source,
};

/// What the edges and nodes of a brick are claimed by.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Claims<const SITES: usize, const EDGES: usize> {
    /// For each end of each kind of edge: cells whose crossing belongs to that end.
    pub(super) ends: [[u64; EDGES]; 2],
    /// Nodes with a cluster.
    pub(super) nodes: [u64; SITES],
    /// Where the positions of these begin.
    pub(super) first: usize,
}

/// The clusters of a surface; none for plain tetrahedra.
#[derive(Debug, Default)]
pub(crate) struct Clusters<const SITES: usize, const EDGES: usize> {
    /// For each brick which of `claims` are its own, or [`NONE`]. Empty when there are none.
    pub(super) slots: Vec<u32>,
    pub(super) claims: Vec<Claims<SITES, EDGES>>,
    /// In units of cells.
    pub(super) positions: Vec<[f64; 3]>,
}

impl<const SITES: usize, const EDGES: usize> Clusters<SITES, EDGES> {
    /// Those of a brick.
    #[inline(always)]
    pub(crate) fn of(&self, brick: usize) -> Option<&Claims<SITES, EDGES>> {
        let &slot = self.slots.get(brick)?;
        (slot != NONE).then(|| &self.claims[slot as usize])
    }

    /// Those of a brick and the bricks above it; `None` where there are none.
    pub(crate) fn above(&self, source: &dyn Source, brick: usize) -> Option<[Option<&Claims<SITES, EDGES>>; 8]> {
        if self.slots.is_empty() {
            return None;
        }
        let mut all = [None; 8];
        for (c, to) in all.iter_mut().enumerate() {
            *to = above(source, brick, c).and_then(|other| self.of(other));
        }
        all.iter().any(Option::is_some).then_some(all)
    }

    /// Positions of the clusters of a brick, by site and cell.
    pub(crate) fn positions(&self, brick: usize) -> &[[f64; 3]] {
        self.of(brick).map_or(&[], |claims| {
            let count = claims.nodes.iter().map(|set| set.count_ones() as usize).sum::<usize>();
            &self.positions[claims.first..claims.first + count]
        })
    }
}

impl<const SITES: usize, const EDGES: usize> Claims<SITES, EDGES> {
    /// Which end of a cell's edge, 0 or 1, its crossing belongs to, if to any.
    #[inline(always)]
    pub(crate) fn end(&self, kind: usize, cell: usize) -> Option<usize> {
        match (self.ends[0][kind] >> cell & 1, self.ends[1][kind] >> cell & 1) {
            (1, _) => Some(0),
            (_, 1) => Some(1),
            _ => None,
        }
    }
}
