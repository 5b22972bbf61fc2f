//! Sides of nodes, and from them, brick by brick, which edges are crossed.
//!
//! A brick's 64 nodes are one `u64`, so its crossed edges along an axis are the exclusive-or of the word and the same word
//! one node further. Nodes of a brick that the block does not have, beyond its far faces, repeat the side of those that it
//! has: no edge out there is crossed.
//!
//! Source: this project, as in [`cubes`](crate::march::cubes).

use super::{RING, Work, bricks::Bricks, bricks_of};
use crate::{
    bricks::lists::SIDE,
    lookup::columns::Extent,
    march::slices::{Blend, March, Skin, WIDEST},
    math::{
        bits::{ones, shift_x, shift_y, side_mask},
        simd::Simd,
    },
};

/// Most rows of bricks of a layer.
pub(super) const MOST_ROWS: usize = WIDEST / SIDE;
/// Bricks of a layer, one bit each, row by row.
pub(super) type Wanted = [u16; MOST_ROWS];

/// The last nodes along each axis.
const LAST: [u64; 3] = [side_mask([1, 0, 0]), side_mask([0, 1, 0]), side_mask([0, 0, 1])];
/// The first nodes along each axis.
const FIRST: [u64; 3] = [side_mask([-1, 0, 0]), side_mask([0, -1, 0]), side_mask([0, 0, -1])];
/// Nodes of a brick's lowest plane.
pub(super) const LOWEST: u64 = FIRST[2];

impl<B: Blend, K: Skin> March<'_, B, K, Work<K::Corner>> {
    /// Finds the side of every node of a layer.
    #[inline(always)]
    pub(super) fn find_sides<S: Simd>(&mut self, s: S, extent: Extent, layer: usize) {
        let [width, rows] = bricks_of(extent);
        let is_last = [0, 1, 2].map(|a| (extent.nodes[a] - 1) / SIDE);
        for row in 0..rows {
            let lists = &self.work.layers[layer % 2].lists;
            for column in ones(lists.reached[row].into()) {
                let brick = row * width + column;
                let mut inside = self.fill(s, extent, layer, brick);
                for (a, at) in [column, row, layer].into_iter().enumerate() {
                    if at == is_last[a] {
                        inside = repeat(extent, a, inside);
                    }
                }
                if inside == 0 {
                    continue;
                }
                let work = &mut *self.work;
                work.layers[layer % 2].inside[brick] = inside;
                work.layers[layer % 2].solid[row] |= 1 << column;
                work.layers[layer % 2].rows |= 1 << row;
                for plane in 0..SIDE {
                    let slice = &mut work.inside[(SIDE * layer + plane) % RING][SIDE * row..SIDE * row + SIDE];
                    let bits = inside >> (SIDE * SIDE * plane);
                    for (line, to) in slice.iter_mut().enumerate() {
                        *to |= (bits >> (SIDE * line) & 0b1111) << (SIDE * column);
                    }
                }
            }
        }
    }

    /// Notes the nodes at the ends of crossed edges of a layer, those up to the layer above and those of its lowest plane
    /// included. Gives the bricks of both layers that have any.
    pub(super) fn find_needed(&mut self, extent: Extent, layer: usize) -> [Wanted; 2] {
        let [width, rows] = bricks_of(extent);
        let [even, odd] = &mut self.work.layers;
        let (here, above) = if layer.is_multiple_of(2) { (even, odd) } else { (odd, even) };
        let all = (1u32 << rows) - 1;
        mark_planes(here, width, all, u64::MAX);
        mark_planes(above, width, all, LOWEST);
        let mut wanted = [[0; MOST_ROWS]; 2];
        let has_above = SIDE * (layer + 1) < extent.nodes[2];
        let lowest = if has_above { LOWEST } else { 0 };
        let filled = u32::from(here.rows | above.rows);
        for row in ones(u64::from((filled | filled << 1 | filled >> 1) & all)) {
            let beside = |at: usize| here.solid.get(at).map_or(0, |bricks| bricks | above.solid[at]);
            let own = u64::from(beside(row));
            let near = own | own << 1 | own >> 1 | u64::from(beside(row.wrapping_sub(1)) | beside(row + 1));
            for column in ones(near & ((1 << width) - 1)) {
                let brick = row * width + column;
                let (inside, beyond) = (here.inside[brick], above.inside[brick]);
                let along = (inside ^ inside >> 16) & !LAST[2];
                let between = (inside >> 48 ^ beyond) & lowest;
                here.needed[brick] |= along | along << 16 | between << 48;
                above.needed[brick] |= between;
                wanted[0][row] |= u16::from(here.needed[brick] != 0) << column;
                wanted[1][row] |= u16::from(above.needed[brick] != 0) << column;
            }
        }
        wanted
    }
}

/// The sides of a brick whose last nodes along an axis the block does not have.
fn repeat(extent: Extent, axis: usize, inside: u64) -> u64 {
    let (step, has) = (1 << (2 * axis), (extent.nodes[axis] - 1) % SIDE + 1);
    let last = inside >> (step * (has - 1)) & FIRST[axis];
    let had = inside & (0..has).fold(0, |nodes, at| nodes | FIRST[axis] << (step * at));
    (has..SIDE).fold(had, |nodes, at| nodes | last << (step * at))
}

/// Notes the nodes at the ends of crossed edges along x and y of one layer's bricks, of those in `of` of each. `all` has a
/// bit for each row of bricks.
#[inline(always)]
fn mark_planes<C>(layer: &mut Bricks<C>, width: usize, all: u32, of: u64) {
    let (inside, needed, filled) = (&layer.inside[..], &mut layer.needed[..], u32::from(layer.rows));
    for row in ones(u64::from((filled | filled >> 1) & all)) {
        let own = u64::from(layer.solid[row]);
        let near = own | own >> 1 | u64::from(layer.solid.get(row + 1).copied().unwrap_or(0));
        for column in ones(near & ((1 << width) - 1)) {
            let brick = row * width + column;
            let own = inside[brick];
            let (has_right, has_up) = (column + 1 < width, all >> (row + 1) != 0);
            let right = if has_right { inside[brick + 1] } else { own };
            let up = if has_up { inside[brick + width] } else { own };
            let along_x = (own ^ shift_x(own, right)) & of;
            let along_y = (own ^ shift_y(own, up)) & of;
            needed[brick] |= along_x | (along_x & !LAST[0]) << 1 | along_y | (along_y & !LAST[1]) << 4;
            if has_right {
                needed[brick + 1] |= (along_x & LAST[0]) >> 3;
            }
            if has_up {
                needed[brick + width] |= (along_y & LAST[1]) >> 12;
            }
        }
    }
}
