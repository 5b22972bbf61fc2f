//! Halves of coarse cells that are inside: what the [band](super::band) need not fill of a cell that is not sure.
//!
//! Where the four corners on one side of a coarse cell are clearly inside, the half on that side is, too, if the middles of the four
//! edges that lead away from there are: a box whose eight corners are clear, as a sure cell's, and no two of them farther apart.
//!
//! Source: this project.

use super::store::{AT_WORK, AtWork, Source};
use crate::{
    fill::{above::Points, brick_origin, eighths},
    lattice::Coord,
    math::bits::ones,
};

/// The sides of a cell: below and above along each axis.
pub(super) const SIDES: usize = 6;

/// The corners on a side.
fn corners(side: usize) -> impl Iterator<Item = usize> {
    (0..8).filter(move |c| c >> (side / 2) & 1 == side % 2)
}

/// A lattice of samples, and what one must be above to be clearly inside.
#[derive(Clone, Copy)]
pub(super) struct Sampler<'a> {
    pub(super) source: &'a Source<'a>,
    pub(super) step: f64,
    pub(super) inside_above: f32,
}

/// For each side those of the cells `unsure` of a coarse brick whose half there is inside. `clear` has, for each corner, the cells where
/// that one is clearly inside.
pub(super) fn find(sampler: &Sampler<'_>, octet: Coord, brick: usize, unsure: u64, clear: &[u64; 8]) -> [u64; SIDES] {
    let mut sides: [u64; SIDES] = std::array::from_fn(|side| corners(side).fold(unsure, |cells, c| cells & clear[c]));
    if sides == [0; SIDES] {
        return sides;
    }
    // The middles of edges by axis and lower node, of which there are five along an axis, and where each is in the list.
    const NONE: u16 = u16::MAX;
    let mut place = [[NONE; 125]; 3];
    let mut points = Vec::new();
    let edges = |side: usize, cell: usize| {
        let at = [cell & 3, cell >> 2 & 3, cell >> 4];
        // From the corners below.
        corners(side & !1).map(move |c| [0, 1, 2].map(|a| at[a] + (c >> a & 1)))
    };
    let index = |node: [usize; 3]| node[0] + 5 * node[1] + 25 * node[2];
    let first = brick_origin(brick);
    // In Z-order: then those of a group lie close together.
    for cell in eighths::OF.into_iter().flat_map(ones) {
        for side in 0..SIDES {
            if sides[side] >> cell & 1 == 0 {
                continue;
            }
            for node in edges(side, cell) {
                let place = &mut place[side / 2][index(node)];
                if *place == NONE {
                    *place = points.len() as u16;
                    points.push([0, 1, 2].map(|a| 2 * (first[a] + node[a] as i32) + i32::from(a == side / 2)));
                }
            }
        }
    }
    let mut above = [0; 5];
    AT_WORK.with_borrow_mut(|AtWork { scratch, .. }| {
        let Source { unit, field, cells, columns, .. } = *sampler.source;
        let Sampler { step, inside_above: threshold, .. } = *sampler;
        field.above(
            unit,
            Points { cells, columns, step, octet, brick, points: &points, threshold, scratch, above: &mut above },
        );
    });
    for (side, cells) in sides.iter_mut().enumerate() {
        for cell in ones(*cells) {
            let is_clear = |node| {
                let place = place[side / 2][index(node)];
                above[usize::from(place / 64)] >> (place % 64) & 1 != 0
            };
            if !edges(side, cell).all(is_clear) {
                *cells &= !(1 << cell);
            }
        }
    }
    sides
}
