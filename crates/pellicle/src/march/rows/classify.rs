//! Samples to signs: the one pass over all samples.
//!
//! Source: this project.

use std::ops::Range;

use super::{Grid, Row, Shape};
use crate::{
    field::volume::{Cut, Scalar},
    math::{
        memory::filled,
        simd::{Kernel, LANES, Simd, Unit},
    },
};

/// Signs of all rows of a lattice, for one isovalue or several.
///
/// `[row][isovalue][word]`: a row's samples are compared with all isovalues while they are at hand.
pub(crate) struct Signs {
    words: usize,
    isos: usize,
    bits: Vec<u64>,
}

impl Signs {
    /// All outside.
    pub(crate) fn new(shape: &Shape, isos: usize) -> Self {
        let words = shape.words();
        Self { words, isos, bits: filled(0, shape.rows() * words * isos) }
    }

    /// Those of `words` words a row for one isovalue.
    pub(super) fn of_bits(words: usize, bits: Vec<u64>) -> Self {
        Self { words, isos: 1, bits }
    }

    /// Words of one row for all isovalues together.
    pub(crate) fn words_per_row(&self) -> usize {
        self.words * self.isos
    }

    pub(crate) fn bits_mut(&mut self) -> &mut [u64] {
        &mut self.bits
    }

    /// Signs of one row for isovalue number `iso`.
    #[inline(always)]
    pub(crate) fn row(&self, row: usize, iso: usize) -> &[u64] {
        let start = (row * self.isos + iso) * self.words;
        &self.bits[start..start + self.words]
    }
}

/// Finds the signs of some rows.
pub(crate) struct Classify<'a> {
    pub(crate) unit: Unit,
    pub(crate) isos: &'a [f64],
    pub(crate) rows: Range<usize>,
    /// The words of those rows.
    pub(crate) to: &'a mut [u64],
}

/// The same for a type of samples.
pub(super) struct Typed<'g, 'a, 't, T> {
    pub(super) grid: &'g Grid<'a, T>,
    pub(super) cuts: &'t [Cut<T>],
    pub(super) task: Classify<'t>,
}

impl<T: Scalar> Kernel for Typed<'_, '_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let shape = &self.grid.shape;
        let mut to = self.task.to.chunks_exact_mut(shape.words());
        for row in self.task.rows {
            let row = self.grid.row(row % shape.nodes[1], row / shape.nodes[1], 0.0);
            for (cut, to) in self.cuts.iter().zip(&mut to) {
                match *cut {
                    _ if row.len == 0 => to.fill(0),
                    Cut::All => fill(&row, to, |_, n| if n == 64 { u64::MAX } else { (1 << n) - 1 }),
                    Cut::Above(above) if row.stride == 1 => {
                        let samples = &row.samples[row.first..row.first + row.len];
                        fill(&row, to, |from, _| packed(s, samples, from, above));
                    }
                    Cut::Above(above) => fill(&row, to, |from, n| strided(s, &row, from, n, above)),
                }
            }
        }
    }
}

/// Writes the words of a row from the signs of its samples: `signs(from, n)` has those of samples `from..from + n` in its
/// low bits, and zeros above.
#[inline(always)]
fn fill<T: Scalar>(row: &Row<'_, T>, to: &mut [u64], signs: impl Fn(usize, usize) -> u64) {
    let mut carry = 0;
    for (w, to) in to.iter_mut().enumerate() {
        let from = 64 * w;
        let mut word = 0;
        if from < row.len {
            word = signs(from, 64.min(row.len - from));
            if let Some(present) = row.mask {
                for bit in 0..64.min(row.len - from) {
                    word &= !(u64::from(!present[row.element(from + bit)]) << bit);
                }
            }
        }
        // Sample x is node x + pad.
        *to = word << row.pad | carry;
        carry = if row.pad == 0 { 0 } else { word >> 63 };
    }
}

/// Signs of the samples of a row from one on, 64 at most.
#[inline(always)]
fn packed<S: Simd, T: Scalar>(s: S, row: &[T], from: usize, above: T) -> u64 {
    if let Some(samples) = row[from..].first_chunk() {
        return whole(s, samples, above);
    }
    if let Some(samples) = row.last_chunk() {
        // The last 64, without those that came before.
        return whole(s, samples, above) >> (from + 64 - row.len());
    }
    let mut word = 0;
    for (x, sample) in row.iter().enumerate() {
        word |= u64::from(*sample > above) << x;
    }
    word
}

/// Signs of 64 samples.
#[inline(always)]
fn whole<S: Simd, T: Scalar>(s: S, samples: &[T; 64], above: T) -> u64 {
    let mut word = 0;
    for (group, sixteen) in samples.as_chunks::<LANES>().0.iter().enumerate() {
        word |= u64::from(T::greater(s, sixteen, above)) << (LANES * group);
    }
    word
}

/// Signs of `n` samples from sample `from` on, wherever they lie.
#[inline(always)]
fn strided<S: Simd, T: Scalar>(s: S, row: &Row<'_, T>, from: usize, n: usize, above: T) -> u64 {
    let mut samples = [T::ZERO; 64];
    for (x, sample) in (from..from + n).zip(&mut samples) {
        *sample = row.samples[row.element(x)];
    }
    whole(s, &samples, above) & (u64::MAX >> (64 - n))
}
