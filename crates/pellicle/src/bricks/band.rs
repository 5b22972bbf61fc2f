//! The narrow band: which bricks are filled.
//!
//! Three steps; none changes a value, they only decide where to look.
//!
//! 1. **Sample** the field on a coarse lattice, whose nodes are every m-th node of the fine one, as far apart as the field
//!    allows. A coarse cell whose eight corners are all clearly inside, or all clearly outside, is *sure*
//!    ([`Bounds`](crate::field::Bounds)); a brick is wanted when it touches a coarse cell that is not sure. Of those some fields
//!    prove bricks to be outside from where the particles lie ([`fill::prove`](crate::fill::prove)), and of a cell that is not sure
//!    [`halves`] may be.
//! 2. **Fill** what is wanted.
//! 3. **Close** ([`close`](super::close)): an eighth of a brick without values stands for eight equal signs. Where a node of a filled
//!    one disagrees with another that it touches (through a face, an edge or a corner), that is wanted, too. Repeat until none is.
//!
//! After that no cell that touches an unfilled eighth is crossed, so the surface of the filled bricks is closed. It is the
//! whole surface unless a piece of it lies within sure cells altogether. The bounds leave room for all that was seen;
//! equality with the full evaluation is tested on real frames and on cavities made to defeat it, not proven.
//!
//! Source: the narrow band is Akinci et al. 2012, section 4.1, with samples in place of surface particles; following the
//! surface from brick to brick is Wyvill, McPheeters, Wyvill 1986.

use std::{f64::consts::PI, ops::RangeInclusive};

use rayon::prelude::*;

use super::{
    budget::Budget,
    close::find_disagreeing,
    halves::{self, SIDES, Sampler},
    marks::{Marks, Nodes},
    store::{Octet, Round, Source, Store},
};
use crate::{
    Error, Stage,
    fill::{eighths, simd::Sampling},
    lattice::{BRICK, CHUNK, Coord, OCTET, cover, plus},
    lookup::{cells::Cells, directory::Cursor, gather::REACH},
    math::bits::{corner_sets, node_bit, ones},
};

/// Sets of a coarse brick: nodes that may be inside, that are, and that clearly are.
const COARSE_SETS: usize = 3;

/// Both lattices, and what is reused from frame to frame.
#[derive(Default)]
pub(crate) struct Band {
    coarse: Store<COARSE_SETS>,
    /// The fine bricks with the set of nodes that are inside.
    pub(crate) fine: Store<1>,
    /// Whether the fine bricks' values were kept; otherwise who needs one computes it again.
    pub(crate) has_values: bool,
    /// What of the fine bricks may take part; all but with [`Look::Near`].
    pub(crate) marks: Marks,
    done: Vec<(u32, u64)>,
    /// For each group of octets, the eighths that they ask for.
    requests: Vec<Vec<(Coord, u64)>>,
    /// For each group, eighths in halves of coarse cells that are inside.
    inside: Vec<Vec<(Coord, u64)>>,
}

/// Where to look.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Look<'a> {
    /// Where the surface can be.
    Band,
    /// Every brick that a particle reaches.
    Everywhere,
    /// Within these boxes of nodes, and nowhere else: the surface may end there.
    Near(&'a [Nodes]),
}

/// The least that is filled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Grain {
    /// Eighths of bricks, of fields that can; other nodes of their bricks have a sign and no value.
    Eighths,
    /// Whole bricks.
    Bricks,
}

/// Octets that one task looks through.
const GROUP: usize = 32;

impl Band {
    /// Finds and fills all that matters. `step` is the node distance in support units; `sampler` has the field that is sampled
    /// on the coarse lattice.
    pub(crate) fn find(
        &mut self,
        source: &Source<'_>,
        sampler: &Source<'_>,
        step: f64,
        look: Look<'_>,
        grain: Grain,
        mut budget: Budget,
    ) -> Result<(), Error> {
        self.fine.clear();
        self.fine.whole = grain == Grain::Bricks || !source.field.fills_eighths(step);
        self.coarse.clear();
        self.marks.clear();
        let bounds = source.field.bounds();
        let multiple = multiple(step, bounds.map_or(0.5, |bounds| bounds.apart));
        source.control.begin(Stage::Active)?;
        match (look, bounds) {
            (Look::Near(boxes), _) => {
                self.marks.want(&mut self.fine, boxes, budget)?;
                budget.taken += Marks::BYTES_PER_OCTET * self.fine.octet_count() as u64;
            }
            (Look::Band, Some(bounds)) if multiple > 1 => {
                let coarse_step = step * f64::from(multiple);
                want_reached(&mut self.coarse, source.cells, coarse_step, budget)?;
                let thresholds = [bounds.outside_below, source.field.iso(), bounds.inside_above];
                // Within reach of a brick: its box widened by one support radius, with round edges and corners.
                let width = 3.0 * coarse_step;
                let reached = width.powi(3) + 6.0 * width.powi(2) + 3.0 * PI * width + 4.0 / 3.0 * PI;
                let crowd = (f64::from(bounds.crowd) * reached) as usize;
                let round = Round {
                    step: coarse_step,
                    thresholds: &thresholds,
                    sampling: Some(Sampling { crowd }),
                    proves: false,
                    keep_values: false,
                };
                self.coarse.fill(sampler, round, &mut self.done);
                source.control.check()?;
                budget.taken += Store::<COARSE_SETS>::bytes(self.coarse.octet_count(), self.coarse.len());
                let sampler = Sampler { source: sampler, step: coarse_step, inside_above: bounds.inside_above };
                // A half of a cell is whole eighths, and eighths are what is filled.
                let halves = multiple > 2 && grain == Grain::Eighths && source.field.fills_eighths(step);
                self.want_unsure(multiple, halves.then_some(sampler), budget)?;
            }
            _ => want_reached(&mut self.fine, source.cells, step, budget)?,
        }
        let mut proves = matches!(look, Look::Band) && source.field.proves();
        if proves && !budget.check(&self.fine).is_ok_and(|fits| fits) {
            // What is wanted would not fit: how much of that is filled must be known before.
            self.fine.drop_proven(source, step);
            source.control.check()?;
            proves = false;
        }
        source.control.begin(Stage::Fill)?;
        self.has_values = true;
        self.fill_waiting(source, step, multiple, proves, budget)
    }

    /// Fills bricks, given by their coordinates, beyond those found, and closes again.
    pub(crate) fn fill_more(
        &mut self,
        bricks: &[Coord],
        source: &Source<'_>,
        step: f64,
        mut budget: Budget,
    ) -> Result<(), Error> {
        let multiple = multiple(step, source.field.bounds().map_or(0.5, |bounds| bounds.apart));
        budget.taken += Store::<COARSE_SETS>::bytes(self.coarse.octet_count(), self.coarse.len());
        let (coarse, mut cursor) = (&self.coarse, Cursor::default());
        for &brick in bricks {
            let at = brick.map(|b| b >> 1);
            let own = eighths::of_bricks(brick_bit(brick));
            self.fine.want(at, own, |octet| inside_eighths(coarse, &mut cursor, octet, multiple));
        }
        self.fill_waiting(source, step, multiple, false, budget)
    }

    /// Fills what is wanted, at first with `proves` but for what is proven to be outside, and closes it, until nothing is wanted.
    fn fill_waiting(
        &mut self,
        source: &Source<'_>,
        step: f64,
        multiple: i32,
        mut proves: bool,
        budget: Budget,
    ) -> Result<(), Error> {
        let thresholds = [source.field.iso()];
        while self.fine.waiting() {
            self.has_values &= budget.check(&self.fine)?;
            if !self.has_values {
                self.fine.drop_values();
            }
            let round = Round { step, thresholds: &thresholds, sampling: None, proves, keep_values: self.has_values };
            self.fine.fill(source, round, &mut self.done);
            proves = false;
            source.control.check()?;
            // Where only what is marked takes part, nothing is followed beyond it.
            if self.marks.is_empty() {
                self.want_disagreeing(multiple);
            }
        }
        if !self.marks.is_empty() {
            self.marks.close(&self.fine);
        }
        Ok(())
    }

    /// Wants the fine eighths in coarse cells that are not sure, but for [`halves`] that are inside.
    fn want_unsure(&mut self, multiple: i32, sampler: Option<Sampler<'_>>, budget: Budget) -> Result<(), Error> {
        let coarse = &self.coarse;
        let (found, inside) = (&mut self.requests, &mut self.inside);
        // A coarse cell holds many bricks when the lattice is fine, so they are counted before they are listed.
        let per_cell = (i64::from(multiple) / i64::from(BRICK)).max(1).pow(3) as u64;
        let cells: u64 = coarse.octets.par_iter().map(|octet| count_unsure(coarse, octet)).sum();
        budget.fits((cells.saturating_mul(per_cell) / 8).saturating_mul(Store::<1>::bytes(1, 8)))?;
        let groups = coarse.octets.len().div_ceil(GROUP);
        found.resize_with(groups.max(found.len()), Vec::new);
        inside.resize_with(groups.max(inside.len()), Vec::new);
        coarse.octets.par_chunks(GROUP).zip(&mut *found).zip(&mut *inside).for_each(|((octets, found), inside)| {
            found.clear();
            inside.clear();
            for octet in octets {
                for_each_unsure(coarse, octet, |brick, unsure, clear| {
                    let halves =
                        sampler.map_or([0; SIDES], |sampler| halves::find(&sampler, octet.at, brick, unsure, clear));
                    // In Z-order: then those of an octet lie side by side.
                    for cell in eighths::OF.into_iter().flat_map(|eighth| ones(unsure & eighth)) {
                        let sides = halves.map(|cells| cells >> cell & 1 != 0);
                        let node = [cell & 3, cell >> 2 & 3, cell >> 4];
                        let at = std::array::from_fn(|a| {
                            octet.at[a] * OCTET + BRICK * (brick >> a & 1) as i32 + node[a] as i32
                        });
                        push_eighths([found, inside], at, multiple, sides);
                    }
                });
            }
        });
        let mut cursor = Cursor::default();
        let mut taken = |octet| inside_eighths(coarse, &mut cursor, octet, multiple);
        for (at, eighths) in found[..groups].iter().flatten() {
            self.fine.want(*at, *eighths, &mut taken);
        }
        for (at, eighths) in inside[..groups].iter().flatten() {
            let octet = self.fine.want(*at, 0, &mut taken);
            self.fine.octets[octet].inside |= eighths;
        }
        Ok(())
    }

    /// Wants the eighths that disagree with one just filled.
    fn want_disagreeing(&mut self, multiple: i32) {
        let (coarse, fine) = (&self.coarse, &self.fine);
        let found = &mut self.requests;
        let groups = self.done.len().div_ceil(GROUP);
        found.resize_with(groups.max(found.len()), Vec::new);
        self.done.par_chunks(GROUP).zip(&mut *found).for_each(|(done, found)| {
            found.clear();
            let mut cursor = Cursor::default();
            for &(id, fresh) in done {
                let inside = |octet| inside_eighths(coarse, &mut cursor, octet, multiple);
                find_disagreeing(fine, &fine.octets[id as usize], fresh, inside, found);
            }
        });
        let mut cursor = Cursor::default();
        for &(at, eighths) in found[..groups].iter().flatten() {
            self.fine.want(at, eighths, |octet| inside_eighths(coarse, &mut cursor, octet, multiple));
        }
    }
}

/// How many fine steps make a coarse one: the largest power of two that stays within `apart`, in support units.
fn multiple(step: f64, apart: f64) -> i32 {
    // A little slack, so that a quotient meant to be a whole number is not lost to rounding.
    let most = (apart / step * (1.0 + 1e-9)).clamp(1.0, f64::from(1 << 20));
    1 << most.log2().floor() as i32
}

/// Wants every brick with a node or cell that some particle's support reaches.
fn want_reached<const SETS: usize>(
    store: &mut Store<SETS>,
    cells: &Cells,
    step: f64,
    budget: Budget,
) -> Result<(), Error> {
    let bytes = |bricks: u64| (bricks / 8).saturating_mul(Store::<SETS>::bytes(1, 8));
    for chunk in 0..cells.chunks.len() {
        let range = reached_bricks(cells, chunk, step);
        // Refused before it is allocated: what the chunk adds is not known before, but not more than all of it.
        let held = Store::<SETS>::bytes(store.octet_count(), 0);
        if budget.fits(held.saturating_add(bytes(count_bricks(&range)))).is_err() {
            // Enough for all chunks, what they share counted more than once.
            let all = (0..cells.chunks.len()).map(|c| count_bricks(&reached_bricks(cells, c, step)));
            budget.fits(bytes(all.fold(0, u64::saturating_add)).max(held.saturating_add(1)))?;
        }
        for z in range[2].clone() {
            for y in range[1].clone() {
                for x in range[0].clone() {
                    let brick = [x, y, z];
                    store.want(brick.map(|b| b >> 1), eighths::of_bricks(brick_bit(brick)), |_| 0);
                }
            }
        }
    }
    Ok(())
}

/// The bricks that the particles of a chunk may reach, along each axis.
fn reached_bricks(cells: &Cells, chunk: usize, step: f64) -> [RangeInclusive<i32>; 3] {
    let run = cells.chunk_range(chunk);
    std::array::from_fn(|a| {
        let axis = &[&cells.x, &cells.y, &cells.z][a][run.clone()];
        let low = axis.iter().copied().fold(f32::INFINITY, f32::min);
        let high = axis.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let corner = f64::from(cells.chunks[chunk][a] * CHUNK);
        let width = step * f64::from(BRICK);
        cover(corner + f64::from(low) - REACH, corner + f64::from(high) + REACH, width)
    })
}

fn count_bricks(range: &[RangeInclusive<i32>; 3]) -> u64 {
    range.iter().map(|r| (i64::from(*r.end()) - i64::from(*r.start()) + 1) as u64).fold(1, u64::saturating_mul)
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

/// Calls `work` with each brick of a coarse octet that has cells which are not sure: its index, those cells, and for each corner the
/// cells where that one is clearly inside.
fn for_each_unsure(coarse: &Store<COARSE_SETS>, octet: &Octet, mut work: impl FnMut(usize, u64, &[u64; 8])) {
    let mut cursor = Cursor::default();
    for brick in ones(octet.filled.into()) {
        let (mut maybe, mut surely) = ([0; 8], [0; 8]);
        for c in 0..8 {
            let d = std::array::from_fn(|a| (c >> a & 1) as i32);
            let (at, index) = neighbour(octet.at, brick, d);
            let owner = if at == octet.at { Some(octet) } else { coarse.find(&mut cursor, at) };
            if let Some(owner) = owner {
                // A brick that nothing reaches is outside: its sets stay empty.
                maybe[c] = coarse.set(owner, index, 0).unwrap_or(0);
                surely[c] = coarse.set(owner, index, 2).unwrap_or(0);
            }
        }
        let any_maybe = corner_sets(&maybe).into_iter().fold(0, |a, b| a | b);
        let clear = corner_sets(&surely);
        let unsure = any_maybe & !clear.iter().fold(u64::MAX, |a, b| a & b);
        if unsure != 0 {
            work(brick, unsure, &clear);
        }
    }
}

/// Number of an octet's coarse cells that are not sure.
fn count_unsure(coarse: &Store<COARSE_SETS>, octet: &Octet) -> u64 {
    let mut count = 0;
    for_each_unsure(coarse, octet, |_, unsure, _| count += u64::from(unsure.count_ones()));
    count
}

/// Adds the fine eighths that make up a coarse cell to the first list, but for those in its halves on some sides, which go to the
/// second. Coarse steps are powers of two from 2 on.
fn push_eighths(lists: [&mut Vec<(Coord, u64)>; 2], cell: Coord, multiple: i32, sides: [bool; SIDES]) {
    let edge = multiple / 2;
    let first = cell.map(|c| c * edge);
    // Whole bricks: a cell of two eighths along an axis is one. Half of such a cell is four eighths.
    let piece = if edge == 1 || (edge == 2 && sides != [false; SIDES]) { 1 } else { 2 };
    for z in (0..edge).step_by(piece) {
        for y in (0..edge).step_by(piece) {
            for x in (0..edge).step_by(piece) {
                let at = [x, y, z];
                let is_inside = (0..3).any(|a| sides[2 * a + usize::from(2 * at[a] >= edge)]);
                let at = [0, 1, 2].map(|a| first[a] + at[a]);
                let eighths =
                    if piece == 1 { 1 << node_bit_of(at) } else { eighths::of_bricks(brick_bit(at.map(|e| e >> 1))) };
                ask(lists[usize::from(is_inside)], at.map(|e| e >> 2), eighths);
            }
        }
    }
}

/// Adds eighths of an octet.
pub(super) fn ask(found: &mut Vec<(Coord, u64)>, at: Coord, eighths: u64) {
    match found.last_mut() {
        Some((last, asked)) if *last == at => *asked |= eighths,
        _ => found.push((at, eighths)),
    }
}

/// Place of an eighth, or of a node, among the 64 of its octet, or brick.
#[inline(always)]
fn node_bit_of(at: Coord) -> usize {
    node_bit(at[0] as usize & 3, at[1] as usize & 3, at[2] as usize & 3)
}

/// Which eighths of a fine octet are inside, by the coarse sample at or below each one's first node.
///
/// Coarse steps are powers of two from 2 on, so that those samples lie in one coarse brick.
fn inside_eighths(coarse: &Store<COARSE_SETS>, cursor: &mut Cursor, octet: Coord, multiple: i32) -> u64 {
    let first = octet.map(|o| (o * OCTET).div_euclid(multiple));
    let brick = octant(first.map(|n| n >> 2));
    let set = coarse.find(cursor, first.map(|n| n >> 3)).and_then(|o| coarse.set(o, brick, 1));
    set.map_or(0, |set| with_samples(set, first, multiple))
}

/// The eighths of an octet whose samples are in the set of a coarse brick, of which `first` is the octet's first.
#[inline(always)]
fn with_samples(set: u64, first: Coord, multiple: i32) -> u64 {
    match multiple {
        // Each eighth has a sample of its own.
        2 => set,
        // Each brick has.
        4 => eighths::of_bricks(eighths::of_brick(set, octant(first.map(|n| n >> 1)))),
        _ => (set >> node_bit_of(first) & 1).wrapping_neg(),
    }
}

/// The number of the octant that the lowest bits tell, x first.
#[inline(always)]
fn octant(at: Coord) -> usize {
    (at[0] & 1 | (at[1] & 1) << 1 | (at[2] & 1) << 2) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coarse_steps_are_powers_of_two_within_the_bound() {
        assert_eq!(multiple(0.125, 0.5), 4);
        assert_eq!(multiple(0.25, 0.5), 2);
        assert_eq!(multiple(0.5, 0.5), 1);
        assert_eq!(multiple(3.0, 0.5), 1);
        assert_eq!(multiple(0.5 / 7.9, 0.5), 4);
        assert_eq!(multiple(0.1 * 0.625, 0.5), 8);
        assert_eq!(multiple(0.0625, 0.25), 4);
    }

    #[test]
    fn each_eighth_is_inside_where_the_sample_below_its_first_node_is() {
        let set = 0x9b1d_37e4_5a0f_c682;
        for multiple in [2, 4, 8, 16, 64] {
            for octet in [[0, 0, 0], [1, -1, 2], [-3, 6, -8], [5, 2, 7]] {
                let sample = |eighth: usize| {
                    let e = [eighth & 3, eighth >> 2 & 3, eighth >> 4];
                    let node = [0, 1, 2].map(|a| (octet[a] * OCTET + 2 * e[a] as i32).div_euclid(multiple));
                    (set >> node_bit_of(node) & 1) << eighth
                };
                let want = (0..64).map(sample).sum::<u64>();
                assert_eq!(with_samples(set, octet.map(|o| (o * OCTET).div_euclid(multiple)), multiple), want);
            }
        }
    }

    /// Closing would fill most of what were taken for inside on the wrong side: meshes do not tell.
    #[test]
    fn the_half_of_a_coarse_cell_that_is_inside_lies_on_its_side_and_the_other_is_asked_for() {
        let cell = [1, -2, 3];
        for (multiple, side) in [4, 8, 16].into_iter().flat_map(|m| (0..SIDES).map(move |side| (m, side))) {
            let (mut asked, mut inside) = (Vec::new(), Vec::new());
            push_eighths([&mut asked, &mut inside], cell, multiple, std::array::from_fn(|s| s == side));
            let edge = multiple / 2;
            for (list, is_above) in [(inside, side % 2 == 1), (asked, side % 2 == 0)] {
                let along = |(octet, set): &(Coord, u64)| {
                    let (first, axis) = (4 * octet[side / 2], side / 2);
                    ones(*set).map(|e| first + (e as i32 >> (2 * axis) & 3)).collect::<Vec<_>>()
                };
                let along: Vec<i32> = list.iter().flat_map(along).collect();
                assert_eq!(along.len() as i32, edge * edge * edge / 2);
                assert!(
                    along.iter().all(|e| (2 * (e - cell[side / 2] * edge) >= edge) == is_above),
                    "{multiple} {side}"
                );
            }
        }
    }

    #[test]
    fn neighbours_of_bricks_lie_in_the_right_octet() {
        assert_eq!(neighbour([5, 5, 5], 0, [-1, 0, 1]), ([4, 5, 5], 0b101));
        assert_eq!(neighbour([5, 5, 5], 7, [1, 1, 1]), ([6, 6, 6], 0));
        assert_eq!(neighbour([5, 5, 5], 1, [-1, 0, 0]), ([5, 5, 5], 0));
    }
}
