//! The bricks of one lattice that were asked for, and what was found in them.
//!
//! ```text
//! directory   octet coordinates ──► octet
//! known       octet ──► which of its 64 eighths have values
//! filled      octet ──► which of its 8 bricks have one that has
//! inside      octet ──► which of its other eighths are taken to be inside
//! slots       octet ──► where its bricks' signs and values are
//! sets        slot ──► the nodes above each threshold, one bit each
//! values      slot ──► 64 values
//! ```
//!
//! [`eighths`] are filled in rounds: [`Store::want`] collects, [`Store::fill`] fills what was collected, in parallel, whole bricks
//! of most fields. Which are wanted when has no influence on any value. In a brick's set the nodes of eighths that were not
//! filled have the sign that they are taken to have; their values mean nothing.

use std::cell::RefCell;

use rayon::prelude::*;

use super::rounds::Rounds;
use crate::{
    fill::{
        Scratch, Values,
        any::AnyField,
        eighths,
        prove::ProveOctet,
        simd::{FillOctet, Sampling},
    },
    lattice::Coord,
    lookup::{
        cells::Cells,
        directory::{Cursor, Directory},
    },
    math::{bits::ones, memory::filled, ranges::for_each_part, simd::Unit},
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
    values: Rounds,
    slots: usize,
    /// Whether whole bricks are filled, whatever the field: for those who need all values.
    pub(crate) whole: bool,
    queue: Vec<u32>,
    /// First slot of each octet of the queue, and the end.
    queue_slots: Vec<u32>,
    /// Bricks of the round that had a slot before: that one, and the new one.
    moved: Vec<[u32; 2]>,
}

thread_local! {
    /// Candidates of the octet at work; kept between octets and frames.
    pub(super) static SCRATCH: RefCell<(Scratch, [Values; 8])> = RefCell::new((Scratch::default(), [[0.0; 64]; 8]));
}

impl<const SETS: usize> Store<SETS> {
    /// Forgets all bricks.
    pub(crate) fn clear(&mut self) {
        self.octets.clear();
        self.directory.clear();
        self.cursor = Cursor::default();
        self.queue.clear();
        self.values.clear();
        self.slots = 0;
    }

    /// Number of bricks with something filled.
    pub(crate) fn filled_bricks(&self) -> usize {
        self.octets.iter().map(|octet| octet.filled.count_ones() as usize).sum()
    }

    /// Number of slots: filled bricks, those that were filled piece by piece counted again for each.
    pub(crate) fn len(&self) -> usize {
        self.slots
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

    /// Values of a filled brick.
    #[inline(always)]
    pub(crate) fn values(&self, octet: &Octet, brick: usize) -> &Values {
        self.values.get(octet.slots[brick] as usize)
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
        self.assign_slots(true, &mut Vec::new());
    }

    /// Bytes held by so many bricks in so many octets, values left out: octet, directory, crossings, order, signs.
    pub(crate) fn bytes(octets: usize, bricks: usize) -> u64 {
        400 * octets as u64 + 8 * bricks as u64
    }

    /// Number of octets, those without filled bricks included.
    pub(crate) fn octet_count(&self) -> usize {
        self.octets.len()
    }

    /// Gives the values' memory back.
    pub(crate) fn drop_values(&mut self) {
        self.values = Rounds::default();
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
            SCRATCH.with_borrow_mut(|(scratch, _)| {
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

    /// Fills all wanted eighths and returns the octets that have new ones, each with those. For every threshold a set of
    /// the nodes above is kept; values only when `keep_values`.
    pub(crate) fn fill(
        &mut self,
        source: &Source<'_>,
        step: f64,
        thresholds: &[f32; SETS],
        sampling: Option<Sampling>,
        keep_values: bool,
        done: &mut Vec<(u32, u64)>,
    ) {
        let first = self.slots;
        self.assign_slots(self.whole || !source.field.fills_eighths(), done);
        grow(&mut self.sets, self.slots, [0; SETS]);
        if keep_values {
            self.values.add(self.slots - first);
        }
        self.begin_partial(done, keep_values);
        let (octets, done, starts) = (&self.octets, &done[..], &self.queue_slots);
        let sets = &mut self.sets[first..self.slots];
        let values = keep_values.then(|| self.values.last());
        let start = |i: usize| starts[i] as usize;
        for_each_part(0..done.len(), (sets, values), &start, &|i,
                                                               (above, values): (
            &mut [[u64; SETS]],
            Option<&mut [_]>,
        )| {
            if source.control.check().is_err() {
                return;
            }
            SCRATCH.with_borrow_mut(|(scratch, spare)| {
                let octet = FillOctet {
                    cells: source.cells,
                    columns: source.columns,
                    step,
                    octet: octets[done[i].0 as usize].at,
                    eighths: done[i].1,
                    scratch,
                    values: values.unwrap_or(spare),
                    thresholds,
                    sampling,
                    above: above.as_flattened_mut(),
                };
                source.field.fill(source.unit, octet);
            });
        });
    }

    /// Moves the queue to `done`, with a slot for every brick that has a wanted eighth; a brick that has one already gets
    /// another. `whole` bricks are wanted where an eighth of them is.
    fn assign_slots(&mut self, whole: bool, done: &mut Vec<(u32, u64)>) {
        done.clear();
        self.queue_slots.clear();
        self.moved.clear();
        for &id in &self.queue {
            self.queue_slots.push(self.slots as u32);
            let octet = &mut self.octets[id as usize];
            let bricks = eighths::bricks_with(octet.wanted);
            if whole {
                octet.wanted = eighths::of_bricks(bricks);
            }
            done.push((id, octet.wanted));
            for (brick, slot) in octet.slots.iter_mut().enumerate() {
                if bricks >> brick & 1 != 0 {
                    if *slot != NONE {
                        self.moved.push([*slot, self.slots as u32]);
                    }
                    *slot = self.slots as u32;
                    self.slots += 1;
                }
            }
            octet.filled |= bricks;
            octet.known |= octet.wanted;
            octet.wanted = 0;
        }
        self.queue_slots.push(self.slots as u32);
        self.queue.clear();
    }

    /// Writes what is known, or taken for granted, of bricks whose eighths are not all filled in this round.
    fn begin_partial(&mut self, done: &[(u32, u64)], keep_values: bool) {
        for &(id, fresh) in done {
            let octet = &self.octets[id as usize];
            for brick in ones(eighths::bricks_with(fresh).into()) {
                if eighths::of_brick(fresh, brick) != u8::MAX {
                    let inside = eighths::of_brick(octet.inside, brick);
                    self.sets[octet.slots[brick] as usize] = [eighths::nodes(inside); SETS];
                }
            }
        }
        for &[from, to] in &self.moved {
            self.sets[to as usize] = self.sets[from as usize];
            if keep_values {
                self.values.copy(from as usize, to as usize);
            }
        }
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
