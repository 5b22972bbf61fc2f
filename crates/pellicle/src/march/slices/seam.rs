//! Vertices that blocks share: who owns an edge that lies in a face of its block.
//!
//! Up to four blocks share such an edge. The one that comes first in the order of blocks owns it: it makes the vertex and
//! notes its number under the edge's key; the others refer to that block and key. Whoever comes later finds the number by
//! a search in the owner's sorted notes. All blocks agree on the owner, because all know the same order; values of nodes
//! are the same in all of them, to the last bit, so the edge is crossed for all or for none.
//!
//! Source: this project.

use crate::bricks::blocks::NOBODY;

/// A block among its neighbours.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Seam {
    /// Places in the order of the 27 blocks around, x fastest.
    pub(crate) around: [u32; 27],
    /// First node of the block within the extent, the same along each axis.
    pub(crate) margin: usize,
    /// Cells of the block along each axis.
    pub(crate) cells: [usize; 3],
}

/// Whose an edge is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Owner {
    /// This block's alone.
    Mine,
    /// Shared, and this block's: to be noted under the key.
    Shared(u32),
    /// Of another block, under the key.
    Other(Reference),
}

/// A vertex of another block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Reference {
    /// Which of the 27 blocks around.
    pub(crate) block: u8,
    pub(crate) key: u32,
}

impl Seam {
    /// Whose the edge along `axis` from `node` (a position in the extent) is.
    #[inline(always)]
    pub(crate) fn owner(&self, axis: usize, node: [usize; 3]) -> Owner {
        let side: [i32; 3] = std::array::from_fn(|a| {
            if a == axis {
                0
            } else {
                i32::from(node[a] == self.margin + self.cells[a]) - i32::from(node[a] == self.margin)
            }
        });
        if side == [0; 3] { Owner::Mine } else { self.first(axis, node, side) }
    }

    fn first(&self, axis: usize, node: [usize; 3], side: [i32; 3]) -> Owner {
        const OWN: usize = 13;
        let mut best = (self.around[OWN], OWN, [0; 3]);
        for choice in 1..8 {
            let to: [i32; 3] = std::array::from_fn(|a| if choice >> a & 1 == 1 { side[a] } else { 0 });
            let block = (OWN as i32 + to[0] + 3 * to[1] + 9 * to[2]) as usize;
            let rank = self.around[block];
            if rank != NOBODY && rank < best.0 {
                best = (rank, block, to);
            }
        }
        let (_, block, to) = best;
        let local: [u32; 3] =
            std::array::from_fn(|a| (node[a] as i32 - self.margin as i32 - to[a] * self.cells[a] as i32) as u32);
        let key = local[0] | local[1] << 7 | local[2] << 14 | (axis as u32) << 21;
        if block == OWN { Owner::Shared(key) } else { Owner::Other(Reference { block: block as u8, key }) }
    }
}
