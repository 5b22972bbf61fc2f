//! The bricks of one lattice that were asked for, and what was found in them.
//!
//! ```text
//! directory   octet coordinates ──► octet
//! known       octet ──► which of its 64 eighths have values
//! filled      octet ──► which of its 8 bricks have one that has
//! inside      octet ──► which of its other eighths are taken to be inside
//! slots       octet ──► where its bricks' signs are, and what tells where their values are
//! sets        slot ──► the nodes above each threshold, one bit each
//! places      slot ──► where in values the brick's begin: 8 for each of its known eighths
//! ```
//!
//! [`eighths`] are filled in rounds: [`Store::want`] collects, [`Store::fill`] fills what was collected, in parallel, whole bricks
//! of most fields. Which are wanted when has no influence on any value. In a brick's set the nodes of eighths that were not
//! filled have the sign that they are taken to have.

use std::cell::RefCell;

use rayon::prelude::*;

use super::values::{self, Chunk, Place, Values};
use crate::{
    fill::{
        Scratch,
        any::AnyField,
        eighths::{self, Eight, Known},
        prove::ProveOctet,
        simd::{FillOctet, Filled, Sampling},
    },
    lattice::Coord,
    lookup::{
        cells::Cells,
        directory::{Cursor, Directory},
    },
    math::{bits::ones, memory::filled, simd::Unit},
    progress::Control,
};

/// Index of no octet.
const NONE: u32 = u32::MAX;

/// What every fill needs.
#[derive(Clone, Copy)]
pub(crate) struct Source<'a> {
    pub(crate) unit: Unit,
    pub(crate) field: &'a dyn AnyField,
    pub(crate) cells: &'a Cells,
    pub(crate) columns: &'a [&'a [f32]],
    pub(crate) control: &'a Control<'a>,
}

/// One octet of a [`Store`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Octet {
    pub(crate) at: Coord,
    /// Its index in the store.
    pub(crate) index: u32,
    /// Bricks that have a slot.
    pub(crate) filled: u8,
    /// Eighths that were filled.
    pub(crate) known: u64,
    /// Eighths waiting for the next round.
    wanted: u64,
    /// Of the eighths that were not filled, those that are inside throughout.
    pub(crate) inside: u64,
    slots: [u32; 8],
}

/// Bricks of one lattice, with the nodes above each of `SETS` thresholds. Reusable: [`clear`](Self::clear) keeps the memory.
#[derive(Default)]
pub(crate) struct Store<const SETS: usize> {
    pub(crate) octets: Vec<Octet>,
    directory: Directory,
    /// For [`want`](Self::want): requests come in runs of near ones.
    cursor: Cursor,
    sets: Vec<[u64; SETS]>,
    places: Vec<Place>,
    values: Values,
    /// Eighths that were filled.
    known: usize,
    /// Whether whole bricks are filled, for those who need all values, and for fields that fill nothing less.
    pub(crate) whole: bool,
    queue: Vec<u32>,
    /// What each group of the queue got.
    fresh: Vec<Fresh<SETS>>,
}

/// What to fill with, and what to keep.
#[derive(Clone, Copy)]
pub(crate) struct Round<'a, const SETS: usize> {
    /// Distance of neighbouring nodes in support units.
    pub(crate) step: f64,
    pub(crate) thresholds: &'a [f32; SETS],
    pub(crate) sampling: Option<Sampling>,
    pub(crate) proves: bool,
    pub(crate) keep_values: bool,
}

/// Octets that one task fills.
const GROUP: usize = 8;
/// Groups a thread that are filled before it is noted what they got.
const GROUPS: usize = 128;

/// What a group of octets got in one round.
#[derive(Default)]
struct Fresh<const SETS: usize> {
    octets: Vec<Filled>,
    /// For each brick with an eighth that was filled.
    bricks: Vec<FreshBrick<SETS>>,
}

/// What a brick got.
#[derive(Clone, Copy)]
struct FreshBrick<const SETS: usize> {
    sets: [u64; SETS],
    place: Place,
}

/// What a task works with; kept between octets and frames.
pub(super) struct AtWork {
    pub(super) scratch: Scratch,
    values: [Eight; 64],
}

thread_local! {
    pub(super) static AT_WORK: RefCell<AtWork> =
        RefCell::new(AtWork { scratch: Scratch::default(), values: [[0.0; 8]; 64] });
}

impl<const SETS: usize> Store<SETS> {
    /// Forgets all bricks.
    pub(crate) fn clear(&mut self) {
        self.octets.clear();
        self.directory.clear();
        self.cursor = Cursor::default();
        self.queue.clear();
        self.sets.clear();
        self.places.clear();
        self.values.clear();
        self.known = 0;
    }

    /// Number of bricks with something filled.
    pub(crate) fn len(&self) -> usize {
        self.sets.len()
    }

    /// The octet at these coordinates.
    #[inline]
    pub(crate) fn find(&self, cursor: &mut Cursor, octet: Coord) -> Option<&Octet> {
        self.directory.get(cursor, octet).map(|i| &self.octets[i as usize])
    }

    /// The `set`-th set of a brick's nodes, if it is filled.
    #[inline(always)]
    pub(crate) fn set(&self, octet: &Octet, brick: usize, set: usize) -> Option<u64> {
        (octet.filled >> brick & 1 != 0).then(|| self.sets[octet.slots[brick] as usize][set])
    }

    /// Values of a filled brick, if they were kept.
    #[inline(always)]
    pub(crate) fn values(&self, octet: &Octet, brick: usize) -> Known<'_> {
        let eighths = eighths::of_brick(octet.known, brick);
        let place = self.places[octet.slots[brick] as usize];
        Known { eighths, values: self.values.get(place, eighths.count_ones() as usize) }
    }

    /// Asks for eighths of an octet; those already filled stay. `inside` tells, for an octet not seen before, which of
    /// its eighths are inside as long as they are not filled. Returns the octet's index.
    pub(crate) fn want(&mut self, at: Coord, eighths: u64, inside: impl FnOnce(Coord) -> u64) -> usize {
        let id = self.directory.entry(&mut self.cursor, at);
        if *id == NONE {
            let index = self.octets.len() as u32;
            *id = index;
            self.octets.push(Octet { at, index, filled: 0, known: 0, wanted: 0, inside: inside(at), slots: [NONE; 8] });
        }
        let id = *id;
        let octet = &mut self.octets[id as usize];
        let new = eighths & !octet.known;
        if octet.wanted == 0 && new != 0 {
            self.queue.push(id);
        }
        octet.wanted |= new;
        id as usize
    }

    /// Gives every wanted brick its place, and nothing in it.
    #[cfg(test)]
    pub(crate) fn fill_nothing(&mut self) {
        for id in std::mem::take(&mut self.queue) {
            let bricks = eighths::bricks_with(self.octets[id as usize].wanted);
            let mut fresh = ones(bricks.into()).map(|_| FreshBrick { sets: [0; SETS], place: Place::default() });
            self.take(id, Filled { eighths: eighths::of_bricks(bricks), outside: 0 }, &mut fresh, false);
        }
    }

    /// Bytes held by so many bricks in so many octets, values left out: octet, directory, crossings, order, signs.
    pub(crate) fn bytes(octets: usize, bricks: usize) -> u64 {
        400 * octets as u64 + 8 * bricks as u64
    }

    /// Number of octets, those without filled bricks included.
    pub(crate) fn octet_count(&self) -> usize {
        self.octets.len()
    }

    /// Bytes of the values of all eighths that are known, and wanted, if those are filled.
    pub(crate) fn value_bytes(&self) -> u64 {
        let eighths = (self.known + self.waiting_eighths()) * size_of::<Eight>();
        (eighths + (self.len() + self.waiting_bricks()) * size_of::<Place>()) as u64
    }

    fn waiting_eighths(&self) -> usize {
        self.queue.iter().map(|&id| self.filled_for(self.octets[id as usize].wanted)).sum()
    }

    /// How many eighths are filled where these of an octet are wanted.
    fn filled_for(&self, wanted: u64) -> usize {
        let eighths = if self.whole { eighths::of_bricks(eighths::bricks_with(wanted)) } else { wanted };
        eighths.count_ones() as usize
    }

    /// Gives the values' memory back.
    pub(crate) fn drop_values(&mut self) {
        self.values = Values::default();
    }

    /// Whether bricks wait for the next round.
    pub(crate) fn waiting(&self) -> bool {
        !self.queue.is_empty()
    }

    /// Bricks that wait for the next round.
    pub(crate) fn waiting_bricks(&self) -> usize {
        let bricks = |&id: &u32| eighths::bricks_with(self.octets[id as usize].wanted).count_ones() as usize;
        self.queue.iter().map(bricks).sum()
    }

    /// Forgets those wanted eighths that are proven to be outside, by a field that proves.
    pub(crate) fn drop_proven(&mut self, source: &Source<'_>, step: f64) {
        let octets = &self.octets;
        let prove = |&id: &u32| {
            if source.control.check().is_err() {
                return 0;
            }
            let octet = &octets[id as usize];
            AT_WORK.with_borrow_mut(|AtWork { scratch, .. }| {
                let (cells, columns) = (source.cells, source.columns);
                let of = ProveOctet { cells, columns, step, octet: octet.at, eighths: octet.wanted, scratch };
                source.field.prove(source.unit, of)
            })
        };
        let proven: Vec<u64> = self.queue.par_iter().map(prove).collect();
        let mut proven = proven.into_iter();
        self.queue.retain(|&id| {
            let octet = &mut self.octets[id as usize];
            let is_outside = proven.next().unwrap_or(0);
            octet.wanted &= !is_outside;
            octet.inside &= !is_outside;
            octet.wanted != 0
        });
    }

    /// Fills all wanted eighths, but with `proves` those that are proven to be outside, by a field that proves, and tells the
    /// octets that have new ones, each with those. For every threshold a set of the nodes above is kept; values only when `keep_values`.
    pub(crate) fn fill(&mut self, source: &Source<'_>, round: Round<'_, SETS>, done: &mut Vec<(u32, u64)>) {
        // Not every caller says so, and places for values depend on it.
        self.whole |= !source.field.fills_eighths(round.step);
        let adding = round.keep_values.then(|| self.values.begin(self.waiting_eighths(), !round.proves));
        if !round.proves {
            self.reserve(self.waiting_bricks(), round.keep_values);
        }
        let (queue, mut fresh) = (std::mem::take(&mut self.queue), std::mem::take(&mut self.fresh));
        done.clear();
        // So many at a time that what they got takes no more memory for a larger scene.
        for queue in queue.chunks(GROUP * GROUPS * rayon::current_num_threads()) {
            let groups = queue.len().div_ceil(GROUP);
            fresh.resize_with(groups.max(fresh.len()), Fresh::default);
            let tasks = queue.par_chunks(GROUP).zip(&mut fresh);
            tasks.for_each(|(queue, fresh)| self.fill_group(source, &round, queue, fresh, adding.as_ref()));
            self.reserve(fresh[..groups].iter().map(|fresh| fresh.bricks.len()).sum(), round.keep_values);
            for (queue, fresh) in queue.chunks(GROUP).zip(&fresh) {
                let mut bricks = fresh.bricks.iter().copied();
                for (&id, &filled) in queue.iter().zip(&fresh.octets) {
                    self.take(id, filled, &mut bricks, round.keep_values);
                    if filled.eighths != 0 {
                        done.push((id, filled.eighths));
                    }
                }
            }
        }
        if let Some(adding) = adding {
            self.values.end(adding);
        }
        (self.queue, self.fresh) = (queue, fresh);
        self.queue.clear();
    }

    /// Fills the octets of a group.
    fn fill_group(
        &self,
        source: &Source<'_>,
        round: &Round<'_, SETS>,
        queue: &[u32],
        fresh: &mut Fresh<SETS>,
        adding: Option<&values::Round>,
    ) {
        fresh.octets.clear();
        fresh.bricks.clear();
        // The eighths that its bricks may have then, those from before included.
        let most = |octet: &Octet| {
            let before = octet.known & eighths::of_bricks(eighths::bricks_with(octet.wanted));
            self.filled_for(octet.wanted | before)
        };
        let mut chunk = adding.map(|adding| adding.open(queue.iter().map(|&id| most(&self.octets[id as usize])).sum()));
        for &id in queue {
            if source.control.check().is_err() {
                fresh.octets.push(Filled::default());
                continue;
            }
            AT_WORK.with_borrow_mut(|AtWork { scratch, values }| {
                let octet = &self.octets[id as usize];
                let mut above = [[0; SETS]; 8];
                let filled = source.field.fill(
                    source.unit,
                    FillOctet {
                        cells: source.cells,
                        columns: source.columns,
                        step: round.step,
                        octet: octet.at,
                        eighths: octet.wanted,
                        whole: self.whole,
                        proves: round.proves,
                        scratch,
                        values,
                        thresholds: round.thresholds,
                        sampling: round.sampling,
                        above: above.as_flattened_mut(),
                    },
                );
                let mut values = &values[..];
                for brick in ones(eighths::bricks_with(filled.eighths).into()) {
                    let new = eighths::of_brick(filled.eighths, brick);
                    let (own, rest) = values.split_at(new.count_ones() as usize);
                    values = rest;
                    let place = chunk.as_mut().map(|chunk| self.place(octet, brick, new, own, chunk));
                    let sets = self.joined(octet, brick, filled, above[brick]);
                    fresh.bricks.push(FreshBrick { sets, place: place.unwrap_or_default() });
                }
                fresh.octets.push(filled);
            });
        }
        if let (Some(adding), Some(chunk)) = (adding, chunk) {
            adding.close(chunk);
        }
    }

    /// Adds the values of a brick: those of `new` eighths, and those that it had.
    fn place(&self, octet: &Octet, brick: usize, new: u8, values: &[Eight], chunk: &mut Chunk) -> Place {
        if octet.filled >> brick & 1 == 0 {
            return chunk.add(values);
        }
        let before = self.values(octet, brick);
        let (mut all, mut count) = ([[0.0; 8]; 8], 0);
        let (mut old, mut new_values) = (before.values.iter(), values.iter());
        for eighth in ones((before.eighths | new).into()) {
            let from = if new >> eighth & 1 != 0 { new_values.next() } else { old.next() };
            all[count] = *from.unwrap_or(&[0.0; 8]);
            count += 1;
        }
        chunk.add(&all[..count])
    }

    /// The sets of a brick of which some eighths are filled just now: the others keep theirs, or have the sign that is taken for granted.
    fn joined(&self, octet: &Octet, brick: usize, filled: Filled, above: [u64; SETS]) -> [u64; SETS] {
        let new = eighths::nodes(eighths::of_brick(filled.eighths, brick));
        let inside = eighths::of_brick(octet.inside & !filled.outside, brick);
        let before = match octet.slots[brick] {
            NONE => [eighths::nodes(inside); SETS],
            slot => self.sets[slot as usize],
        };
        std::array::from_fn(|k| before[k] & !new | above[k] & new)
    }

    /// Makes room for the slots of so many bricks.
    fn reserve(&mut self, bricks: usize, keep_values: bool) {
        reserve(&mut self.sets, bricks);
        if keep_values {
            reserve(&mut self.places, bricks);
        }
    }

    /// Notes what an octet got, and gives its bricks their slots.
    fn take(&mut self, id: u32, filled: Filled, fresh: &mut impl Iterator<Item = FreshBrick<SETS>>, keep_values: bool) {
        let octet = &mut self.octets[id as usize];
        octet.wanted = 0;
        octet.inside &= !filled.outside;
        octet.known |= filled.eighths;
        self.known += filled.eighths.count_ones() as usize;
        let bricks = eighths::bricks_with(filled.eighths);
        octet.filled |= bricks;
        for (brick, FreshBrick { sets, place }) in ones(bricks.into()).zip(fresh) {
            if octet.slots[brick] == NONE {
                octet.slots[brick] = self.sets.len() as u32;
                self.sets.push(sets);
                if keep_values {
                    self.places.push(place);
                }
            } else {
                let slot = octet.slots[brick] as usize;
                self.sets[slot] = sets;
                if keep_values {
                    self.places[slot] = place;
                }
            }
        }
    }
}

/// Makes room for `more`; where there was some, an eighth of it to spare.
fn reserve<T>(v: &mut Vec<T>, more: usize) {
    if v.capacity() - v.len() < more {
        v.reserve_exact(more + v.len() / 8);
    }
}

/// Makes `v` at least `len` long, with an eighth to spare for what comes. A new allocation comes zeroed from the
/// system, untouched until it is used.
pub(crate) fn grow<T: Clone>(v: &mut Vec<T>, len: usize, zero: T) {
    let room = len + len / 8;
    if v.is_empty() {
        *v = filled(zero, room);
    } else if v.len() < len {
        v.reserve_exact(room - v.len());
        v.resize(room, zero);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{field::solenthaler::Solenthaler, lattice::Lattice};

    /// In whatever pieces a brick is filled, its values and signs are those of the whole.
    #[test]
    fn eighths_filled_in_several_rounds_are_those_filled_at_once() {
        let jitter = |i: i32| f64::from(i.wrapping_mul(1_103_515_245).wrapping_add(12_345) >> 8 & 0xffff) / 65536.0;
        let positions: Vec<[f64; 3]> = (0..216)
            .map(|i| [i % 6, i / 6 % 6, i / 36].map(|v| 0.25 * f64::from(v) + 0.1 * jitter(3 * i + v) - 0.6))
            .collect();
        let mut cells = Cells::default();
        cells.build((&positions).into(), Lattice { spacing: 0.125, support: 1.0 }).unwrap();
        let unit = Unit::new(crate::Lanes::Auto).expect("every machine has one");
        let field =
            Solenthaler::<false> { iso: 0.0, radius: 0.25, t_low: 0.4, t_high: 3.5, particles_per_support: 4.0 };
        let source = Source { unit, field: &field, cells: &cells, columns: &[], control: &Control::default() };
        let round =
            |proves, keep_values| Round { step: 0.125, thresholds: &[0.0], sampling: None, proves, keep_values };
        let octets = (0..64).map(|i| [i % 4 - 2, i / 4 % 4 - 2, i / 16 - 2]);
        let [mut whole, mut pieces, mut proven, mut dropped] = std::array::from_fn(|_| Store::<1>::default());
        let mut done = Vec::new();
        for at in octets.clone() {
            whole.want(at, u64::MAX, |_| 0);
            proven.want(at, u64::MAX, |_| u64::MAX);
            dropped.want(at, u64::MAX, |_| u64::MAX);
        }
        whole.fill(&source, round(false, true), &mut done);
        proven.fill(&source, round(true, false), &mut done);
        // As where memory is short.
        dropped.drop_proven(&source, 0.125);
        dropped.fill(&source, round(false, false), &mut done);
        for part in [0x8421_1248_1842_2481, 0x0f0f_0000_0f0f_ff00, u64::MAX] {
            for at in octets.clone() {
                pieces.want(at, part, |_| 0xf0f0_f0f0_f0f0_f0f0);
            }
            pieces.fill(&source, round(false, true), &mut done);
        }
        assert_eq!(pieces.value_bytes(), whole.value_bytes());
        let (mut cursor, mut inside, mut left_out) = (Cursor::default(), 0, 0);
        for octet in &whole.octets {
            let other = pieces.find(&mut cursor, octet.at).unwrap();
            let one = proven.find(&mut cursor, octet.at).unwrap();
            assert_eq!((octet.known, other.known), (u64::MAX, u64::MAX));
            let same = dropped.find(&mut cursor, octet.at).unwrap();
            assert_eq!((one.known, one.inside & !one.known), (same.known, same.inside & !same.known));
            // What was not filled is outside, whatever it was taken for.
            assert_eq!(one.inside & !one.known, 0);
            left_out += one.known.count_zeros();
            for brick in 0..8 {
                assert_eq!(whole.set(octet, brick, 0), pieces.set(other, brick, 0));
                assert_eq!(whole.values(octet, brick).all(), pieces.values(other, brick).all());
                assert_eq!(proven.set(one, brick, 0), dropped.set(same, brick, 0));
                assert_eq!(whole.set(octet, brick, 0), Some(proven.set(one, brick, 0).unwrap_or(0)));
                inside += whole.set(octet, brick, 0).unwrap().count_ones();
            }
        }
        assert!(inside > 500 && left_out > 1000, "{inside} {left_out}");
    }
}
