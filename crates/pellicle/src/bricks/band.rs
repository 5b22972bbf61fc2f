//! The narrow band: which bricks are filled.
//!
//! Three steps; none changes a value, they only decide where to look.
//!
//! 1. **Sample** the field on a coarse lattice, whose nodes are every m-th node of the fine one, at most half a support
//!    radius apart. A coarse cell whose eight corners are all clearly inside, or all clearly outside, is *sure*
//!    ([`Bounds`](crate::field::Bounds)); a brick is wanted when it touches a coarse cell that is not sure.
//! 2. **Fill** what is wanted.
//! 3. **Close**: a brick without values stands for 64 equal signs. Where a node of a filled brick disagrees with a brick
//!    that it touches (through a face, an edge or a corner), that brick is wanted, too. Repeat until none is.
//!
//! After that no cell that touches an unfilled brick is crossed, so the surface of the filled bricks is closed. It is the
//! whole surface unless a piece of it lies within sure cells altogether. The bounds leave room for all that was seen;
//! equality with the full evaluation is tested on real frames and on cavities made to defeat it, not proven.
//!
//! Source: the narrow band is Akinci et al. 2012, section 4.1, with samples in place of surface particles; following the
//! surface from brick to brick is Wyvill, McPheeters, Wyvill 1986.

use rayon::prelude::*;

use super::store::{Octet, Source, Store};
use crate::{
    Error,
    field::Field,
    lattice::{BRICK, CHUNK, Coord, OCTET, cover, plus},
    lookup::cells::Cells,
    math::bits::{corner_sets, ones, side_mask},
};

/// Sets of a coarse brick: nodes that may be inside, that are, and that clearly are.
const COARSE_SETS: usize = 3;

/// Both lattices, and what is reused from frame to frame.
#[derive(Default)]
pub(crate) struct Band {
    coarse: Store<COARSE_SETS>,
    /// The fine bricks with the set of nodes that are inside.
    pub(crate) fine: Store<1>,
    done: Vec<(u32, u8)>,
    requests: Vec<Vec<(Coord, u8)>>,
}

/// Most octets that may be looked at, by the memory that they take.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Budget {
    pub(crate) bytes: u64,
}

impl Band {
    /// Finds and fills all bricks that matter. `step` is the node distance in support units; `full` asks for every
    /// brick that a particle reaches.
    pub(crate) fn find<F: Field>(
        &mut self,
        source: &Source<'_, F>,
        step: f64,
        full: bool,
        budget: Budget,
    ) -> Result<(), Error> {
        self.fine.clear();
        self.coarse.clear();
        let multiple = multiple(step);
        match source.field.bounds() {
            Some(bounds) if multiple > 1 && !full => {
                let coarse_step = step * f64::from(multiple);
                want_reached(&mut self.coarse, source.cells, coarse_step, budget)?;
                let thresholds = [bounds.outside_below, source.field.iso(), bounds.inside_above];
                self.coarse.fill(source, coarse_step, &thresholds, false, &mut self.done);
                source.control.check()?;
                self.want_unsure(multiple);
            }
            _ => want_reached(&mut self.fine, source.cells, step, budget)?,
        }
        while self.fine.waiting() {
            budget.check((self.fine.len() + self.fine.waiting_bricks()) as u64)?;
            self.fine.fill(source, step, &[source.field.iso()], true, &mut self.done);
            source.control.check()?;
            self.want_disagreeing(multiple);
        }
        Ok(())
    }

    /// Wants the fine bricks in coarse cells that are not sure.
    fn want_unsure(&mut self, multiple: i32) {
        let coarse = &self.coarse;
        let found = &mut self.requests;
        found.resize_with(coarse.octets.len().max(found.len()), Vec::new);
        coarse.octets.par_iter().zip(&mut *found).for_each(|(octet, found)| {
            found.clear();
            for_each_unsure(coarse, octet, |cell| push_bricks(found, cell, multiple));
        });
        let inside = |octet| inside_bricks(coarse, octet, multiple);
        for (at, bricks) in found[..coarse.octets.len()].iter().flatten() {
            self.fine.want(*at, *bricks, inside);
        }
    }

    /// Wants the bricks that disagree with one just filled.
    fn want_disagreeing(&mut self, multiple: i32) {
        let (coarse, fine) = (&self.coarse, &self.fine);
        let inside = |octet| inside_bricks(coarse, octet, multiple);
        let found = &mut self.requests;
        found.resize_with(self.done.len().max(found.len()), Vec::new);
        self.done.par_iter().zip(&mut *found).for_each(|(&(id, bricks), found)| {
            found.clear();
            find_disagreeing(fine, &fine.octets[id as usize], bricks, inside, found);
        });
        for i in 0..self.done.len() {
            for &(at, bricks) in &self.requests[i] {
                self.fine.want(at, bricks, inside);
            }
        }
    }
}

impl Budget {
    /// Bytes that a filled brick takes until the mesh is written: values, signs, crossings, bases, share of its octet.
    const BRICK: u64 = 256 + 8 + 24 + 16 + 24;

    fn check(self, bricks: u64) -> Result<(), Error> {
        let needed = bricks.saturating_mul(Self::BRICK);
        if needed <= self.bytes {
            Ok(())
        } else {
            Err(Error::Memory { what: "the lattice near the surface", needed, available: self.bytes })
        }
    }
}

/// How many fine steps make a coarse one: the largest power of two that stays within half a support radius.
fn multiple(step: f64) -> i32 {
    // A little slack, so that a quotient meant to be a whole number is not lost to rounding.
    let most = (0.5 / step * (1.0 + 1e-9)).clamp(1.0, f64::from(1 << 20));
    1 << most.log2().floor() as i32
}

/// Wants every brick with a node or cell that some particle's support reaches.
fn want_reached<const SETS: usize>(
    store: &mut Store<SETS>,
    cells: &Cells,
    step: f64,
    budget: Budget,
) -> Result<(), Error> {
    let width = step * f64::from(BRICK);
    let mut bricks = 0u64;
    for chunk in 0..cells.chunks.len() {
        let run = cells.chunk_range(chunk);
        let range: [_; 3] = std::array::from_fn(|a| {
            let axis = &[&cells.x, &cells.y, &cells.z][a][run.clone()];
            let low = axis.iter().copied().fold(f32::INFINITY, f32::min);
            let high = axis.iter().copied().fold(f32::NEG_INFINITY, f32::max);
            let corner = f64::from(cells.chunks[chunk][a] * CHUNK);
            cover(corner + f64::from(low) - 1.000_02, corner + f64::from(high) + 1.000_02, width)
        });
        // Counted with what chunks share, hence up to a few times too many; refused long before it is allocated.
        bricks += range.iter().map(|r| (i64::from(*r.end()) - i64::from(*r.start()) + 1) as u64).product::<u64>();
        budget.check(bricks / 8)?;
        for z in range[2].clone() {
            for y in range[1].clone() {
                for x in range[0].clone() {
                    let brick = [x, y, z];
                    store.want(brick.map(|b| b >> 1), brick_bit(brick), |_| 0);
                }
            }
        }
    }
    Ok(())
}

/// A brick's bit within its octet.
fn brick_bit(brick: Coord) -> u8 {
    1 << ((brick[0] & 1) | (brick[1] & 1) << 1 | (brick[2] & 1) << 2)
}

/// The octet that holds brick `brick + d` of octet `at`, and its index there.
#[inline(always)]
pub(crate) fn neighbour(at: Coord, brick: usize, d: Coord) -> (Coord, usize) {
    let moved: Coord = std::array::from_fn(|a| (brick >> a & 1) as i32 + d[a]);
    (plus(at, moved.map(|v| v >> 1)), moved.iter().enumerate().map(|(a, v)| ((v & 1) as usize) << a).sum())
}

/// Calls `work` with the coordinates of each coarse cell of an octet that is not sure.
fn for_each_unsure(coarse: &Store<COARSE_SETS>, octet: &Octet, mut work: impl FnMut(Coord)) {
    for brick in ones(octet.filled.into()) {
        let (mut maybe, mut surely) = ([0; 8], [0; 8]);
        for c in 0..8 {
            let d = std::array::from_fn(|a| (c >> a & 1) as i32);
            let (at, index) = neighbour(octet.at, brick, d);
            let owner = if at == octet.at { Some(octet) } else { coarse.find(at) };
            if let Some(owner) = owner {
                // A brick that nothing reaches is outside: its sets stay empty.
                maybe[c] = coarse.set(owner, index, 0).unwrap_or(0);
                surely[c] = coarse.set(owner, index, 2).unwrap_or(0);
            }
        }
        let any_maybe = corner_sets(&maybe).into_iter().fold(0, |a, b| a | b);
        let all_surely = corner_sets(&surely).into_iter().fold(u64::MAX, |a, b| a & b);
        for cell in ones(any_maybe & !all_surely) {
            let node = [cell & 3, cell >> 2 & 3, cell >> 4];
            work(std::array::from_fn(|a| octet.at[a] * OCTET + BRICK * (brick >> a & 1) as i32 + node[a] as i32));
        }
    }
}

/// Adds the fine bricks that a coarse cell touches.
fn push_bricks(found: &mut Vec<(Coord, u8)>, cell: Coord, multiple: i32) {
    let range = cell.map(|c| (c * multiple).div_euclid(BRICK)..=((c + 1) * multiple - 1).div_euclid(BRICK));
    for z in range[2].clone() {
        for y in range[1].clone() {
            for x in range[0].clone() {
                let brick = [x, y, z];
                let at = brick.map(|b| b >> 1);
                match found.last_mut() {
                    Some((last, bricks)) if *last == at => *bricks |= brick_bit(brick),
                    _ => found.push((at, brick_bit(brick))),
                }
            }
        }
    }
}

/// Which bricks of a fine octet are inside, by one coarse sample each.
fn inside_bricks(coarse: &Store<COARSE_SETS>, octet: Coord, multiple: i32) -> u8 {
    let mut inside = 0;
    let mut last: Option<(Coord, Option<&Octet>)> = None;
    for brick in 0..8 {
        let node: Coord =
            std::array::from_fn(|a| (BRICK * (2 * octet[a] + (brick >> a & 1) as i32)).div_euclid(multiple));
        let at = node.map(|n| n.div_euclid(OCTET));
        let owner = match last {
            Some((known, owner)) if known == at => owner,
            _ => coarse.find(at),
        };
        last = Some((at, owner));
        let local = node.map(|n| n.rem_euclid(OCTET) as usize);
        let index = (local[0] >> 2) | (local[1] >> 2) << 1 | (local[2] >> 2) << 2;
        let bit = (local[0] & 3) | (local[1] & 3) << 2 | (local[2] & 3) << 4;
        let set = owner.and_then(|o| coarse.set(o, index, 1)).unwrap_or(0);
        inside |= ((set >> bit & 1) as u8) << brick;
    }
    inside
}

/// The 26 directions to bricks that touch one, each with the nodes that touch.
const TOUCHING: [(Coord, u64); 26] = {
    let mut table = [([0; 3], 0); 26];
    let (mut i, mut n) = (0, 0);
    while i < 27 {
        let d = [i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1];
        if i != 13 {
            table[n] = (d, side_mask(d));
            n += 1;
        }
        i += 1;
    }
    table
};

/// Adds the bricks without values that disagree with a node of one of `bricks`.
fn find_disagreeing(
    fine: &Store<1>,
    octet: &Octet,
    bricks: u8,
    inside: impl Fn(Coord) -> u8,
    found: &mut Vec<(Coord, u8)>,
) {
    let mut around: [Option<(u8, u8)>; 27] = [None; 27];
    for brick in ones(bricks.into()) {
        let Some(set) = fine.set(octet, brick, 0) else { continue };
        for (d, touching) in TOUCHING {
            let (at, index) = neighbour(octet.at, brick, d);
            let offset: Coord = std::array::from_fn(|a| at[a] - octet.at[a] + 1);
            let known = &mut around[(offset[0] + 3 * offset[1] + 9 * offset[2]) as usize];
            let (filled, inside) = *known.get_or_insert_with(|| match fine.find(at) {
                Some(other) => (other.filled, other.inside),
                None => (0, inside(at)),
            });
            let expected = if inside >> index & 1 != 0 { touching } else { 0 };
            if filled >> index & 1 == 0 && set & touching != expected {
                found.push((at, 1 << index));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coarse_steps_are_powers_of_two_within_half_a_support_radius() {
        assert_eq!(multiple(0.125), 4);
        assert_eq!(multiple(0.25), 2);
        assert_eq!(multiple(0.5), 1);
        assert_eq!(multiple(3.0), 1);
        assert_eq!(multiple(0.5 / 7.9), 4);
        assert_eq!(multiple(0.1 * 0.625), 8);
    }

    #[test]
    fn neighbours_of_bricks_lie_in_the_right_octet() {
        assert_eq!(neighbour([5, 5, 5], 0, [-1, 0, 1]), ([4, 5, 5], 0b101));
        assert_eq!(neighbour([5, 5, 5], 7, [1, 1, 1]), ([6, 6, 6], 0));
        assert_eq!(neighbour([5, 5, 5], 1, [-1, 0, 0]), ([5, 5, 5], 0));
    }
}
