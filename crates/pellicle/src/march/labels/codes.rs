//! Samples to codes: labels as small whole numbers, row by row.
//!
//! Code 0 is outside: beyond a closed border, a node that is absent, or a label that was not asked for. Code n stands for the
//! nth label in ascending order, so that codes compare as labels do.
//!
//! Source: this project.

use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHashSet};

use crate::{
    Control, Error,
    field::volume::Scalar,
    march::rows::{Grid, Rows, Shape},
};

/// Rows of codes, whatever the type of the samples.
pub(crate) trait Codes: Sync {
    fn shape(&self) -> &Shape;

    /// Codes of row (j, k) of the lattice.
    fn row(&self, j: usize, k: usize, to: &mut [u32]);
}

/// A volume's rows.
pub(crate) struct Coded<'a, T> {
    grid: Grid<'a, T>,
    codes: FxHashMap<i128, u32>,
}

/// Rows that one task reads.
const GROUP: usize = 32;

/// The labels of a volume that are wanted, ascending. What is held besides are wanted ones alone, once for each thread at work.
///
/// # Errors
/// [`Error::Parameter`] for a sample that is no whole number, [`Error::Cancelled`].
pub(crate) fn labels<T: Scalar>(
    grid: &Grid<'_, T>,
    is_wanted: &(dyn Fn(i128) -> bool + Sync),
    control: &Control<'_>,
) -> Result<Vec<i128>, Error> {
    let shape = *grid.shape();
    let of_group = |group: usize| {
        control.check()?;
        let mut found = FxHashSet::default();
        for row in group * GROUP..shape.rows().min((group + 1) * GROUP) {
            let row = grid.row(row % shape.nodes[1], row / shape.nodes[1], 0.0);
            let mut last = None;
            for i in 0..shape.nodes[0] {
                let Some(sample) = row.present(i) else { continue };
                if last != Some(sample) {
                    last = Some(sample);
                    if let Some(label) = whole(sample)?.filter(|label| is_wanted(*label)) {
                        found.insert(label);
                    }
                }
            }
        }
        Ok(found)
    };
    let unite = |a: FxHashSet<i128>, b: FxHashSet<i128>| {
        let (mut most, least) = if a.len() < b.len() { (b, a) } else { (a, b) };
        most.extend(least);
        Ok(most)
    };
    let groups = (0..shape.rows().div_ceil(GROUP)).into_par_iter();
    let found: FxHashSet<i128> = groups.map(of_group).try_reduce(FxHashSet::default, unite)?;
    let mut found = found.into_iter().collect::<Vec<_>>();
    found.sort_unstable();
    Ok(found)
}

/// The label of a sample; none of NaN.
fn whole<T: Scalar>(sample: T) -> Result<Option<i128>, Error> {
    sample.to_label().map_err(|value| Error::Parameter {
        name: "a sample",
        value,
        must: "a whole number: labels are whole, values of other kinds are contoured at an isovalue",
    })
}

impl<'a, T: Scalar> Coded<'a, T> {
    /// The rows of a volume whose labels, in ascending order, have the codes 1, 2, and so on.
    pub(crate) fn new(grid: Grid<'a, T>, labels: &[i128]) -> Self {
        Self { grid, codes: labels.iter().zip(1..).map(|(&label, code)| (label, code)).collect() }
    }
}

impl<T: Scalar> Codes for Coded<'_, T> {
    fn shape(&self) -> &Shape {
        self.grid.shape()
    }

    fn row(&self, j: usize, k: usize, to: &mut [u32]) {
        let row = self.grid.row(j, k, 0.0);
        let mut last = (None, 0);
        for (i, to) in to.iter_mut().enumerate() {
            let sample = row.present(i);
            if sample != last.0 {
                let label = sample.and_then(|sample| sample.to_label().ok().flatten());
                last = (sample, label.and_then(|label| self.codes.get(&label).copied()).unwrap_or(0));
            }
            *to = last.1;
        }
    }
}
