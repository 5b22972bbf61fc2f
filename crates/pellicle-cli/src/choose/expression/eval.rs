//! The bound tree at work: over blocks of particles, so that walking the tree costs next to nothing.
//!
//! Each node of the tree fills a buffer of up to [`BLOCK`] values; buffers are kept for the next block. A condition whose
//! left side has settled a whole block leaves its right side alone.

use std::cmp::Ordering;

use rayon::prelude::*;

use super::bind::{Bound, Column, Number, Real, Test, Values, Whole};
use super::parser::{Arithmetic, Relation};

/// Values at a time: a handful of buffers stay in the first level cache.
const BLOCK: usize = 1024;

/// Buffers that are not in use.
#[derive(Default)]
struct Scratch {
    reals: Vec<Vec<f64>>,
    wholes: Vec<Vec<i64>>,
    tests: Vec<Vec<bool>>,
}

/// The particles of a block, and what to compute in.
struct Run<'s> {
    first: usize,
    len: usize,
    scratch: &'s mut Scratch,
}

impl Bound<'_> {
    /// Clears the marks of the particles that do not satisfy the expression; other marks stay. There is a mark for each
    /// particle. Runs in the current rayon pool.
    pub fn narrow(&self, keep: &mut [bool]) {
        debug_assert_eq!(keep.len(), self.len);
        keep.par_chunks_mut(BLOCK).enumerate().with_min_len(16).for_each_init(
            Scratch::default,
            |scratch, (block, keep)| {
                let mut run = Run { first: block * BLOCK, len: keep.len(), scratch };
                let tests = run.test(&self.root);
                for (keep, test) in keep.iter_mut().zip(&tests) {
                    *keep &= *test;
                }
                run.scratch.tests.push(tests);
            },
        );
    }
}

impl Run<'_> {
    fn tests(&mut self) -> Vec<bool> {
        sized(self.scratch.tests.pop(), self.len)
    }

    fn test(&mut self, test: &Test<'_>) -> Vec<bool> {
        match test {
            Test::Compare(relation, left, right) => {
                let mut to = self.tests();
                self.compare(*relation, left, right, &mut to);
                to
            }
            Test::In { value, wholes, others, is_negated } => self.membership(value, wholes, others, *is_negated),
            Test::Not(inner) => {
                let mut to = self.test(inner);
                to.iter_mut().for_each(|t| *t = !*t);
                to
            }
            Test::And(pair) => self.join(pair, true, |a, b| a & b),
            Test::Or(pair) => self.join(pair, false, |a, b| a | b),
        }
    }

    fn join(&mut self, pair: &[Test<'_>; 2], open: bool, join: impl Fn(bool, bool) -> bool) -> Vec<bool> {
        let mut left = self.test(&pair[0]);
        if left.contains(&open) {
            let right = self.test(&pair[1]);
            left.iter_mut().zip(&right).for_each(|(l, r)| *l = join(*l, *r));
            self.scratch.tests.push(right);
        }
        left
    }

    fn compare(&mut self, relation: Relation, left: &Number<'_>, right: &Number<'_>, to: &mut [bool]) {
        match (left, right) {
            (Number::Whole(left), Number::Whole(right)) => {
                let (a, b) = (self.whole(left), self.whole(right));
                relate(relation, &a, &b, to);
                self.scratch.wholes.extend([a, b]);
            }
            (Number::Whole(left), Number::Real(right)) => {
                let (a, b) = (self.whole(left), self.real(right));
                mixed(relation, &a, &b, to);
                self.scratch.wholes.push(a);
                self.scratch.reals.push(b);
            }
            (Number::Real(left), Number::Whole(right)) => {
                let (a, b) = (self.real(left), self.whole(right));
                mixed(mirrored(relation), &b, &a, to);
                self.scratch.reals.push(a);
                self.scratch.wholes.push(b);
            }
            (Number::Real(left), Number::Real(right)) => {
                let (a, b) = (self.real(left), self.real(right));
                relate(relation, &a, &b, to);
                self.scratch.reals.extend([a, b]);
            }
        }
    }

    fn membership(&mut self, value: &Number<'_>, wholes: &[i64], others: &[Number<'_>], is_negated: bool) -> Vec<bool> {
        let mut to = self.tests();
        match value {
            Number::Whole(value) => {
                let values = self.whole(value);
                for (to, value) in to.iter_mut().zip(&values) {
                    *to = wholes.binary_search(value).is_ok() != is_negated;
                }
                self.scratch.wholes.push(values);
            }
            Number::Real(_) => to.fill(is_negated),
        }
        let relation = if is_negated { Relation::Unequal } else { Relation::Equal };
        let mut one = self.tests();
        for other in others {
            self.compare(relation, value, other, &mut one);
            for (to, one) in to.iter_mut().zip(&one) {
                *to = if is_negated { *to & *one } else { *to | *one };
            }
        }
        self.scratch.tests.push(one);
        to
    }

    fn whole(&mut self, whole: &Whole<'_>) -> Vec<i64> {
        let mut to = sized(self.scratch.wholes.pop(), self.len);
        match whole {
            Whole::Constant(value) => to.fill(*value),
            // An index fits, as each particle takes at least 12 bytes.
            Whole::Index => (self.first as i64..).zip(&mut to).for_each(|(index, to)| *to = index),
            Whole::Column(column) => match column.values {
                Values::I32(values) => copy(values, column, self.first, &mut to, i64::from),
                Values::I64(values) => copy(values, column, self.first, &mut to, |v| v),
                // Other columns are real numbers, whatever they hold.
                Values::F32(_) | Values::F64(_) => to.fill(0),
            },
        }
        to
    }

    fn real(&mut self, real: &Real<'_>) -> Vec<f64> {
        match real {
            Real::Constant(value) => {
                let mut to = self.reals();
                to.fill(*value);
                to
            }
            Real::Column(column) => {
                let mut to = self.reals();
                fill(column, self.first, &mut to);
                to
            }
            Real::OfWhole(whole) => {
                let (from, mut to) = (self.whole(whole), self.reals());
                // Rounded beyond 2⁵³, as everything that is computed with.
                from.iter().zip(&mut to).for_each(|(from, to)| *to = *from as f64);
                self.scratch.wholes.push(from);
                to
            }
            Real::Negate(inner) => self.map(inner, |v| -v),
            Real::Abs(inner) => self.map(inner, f64::abs),
            Real::Arithmetic(operation, pair) => match operation {
                Arithmetic::Add => self.combine(pair, |a, b| a + b),
                Arithmetic::Subtract => self.combine(pair, |a, b| a - b),
                Arithmetic::Multiply => self.combine(pair, |a, b| a * b),
                Arithmetic::Divide => self.combine(pair, |a, b| a / b),
                Arithmetic::Remainder => self.combine(pair, |a, b| a % b),
            },
            // NaN stays NaN, other than in `f64::min`.
            Real::Least(values) => self.reduce(values, |a, b| if a < b || a.is_nan() { a } else { b }),
            Real::Most(values) => self.reduce(values, |a, b| if a > b || a.is_nan() { a } else { b }),
            Real::Length(columns) => self.length(columns),
        }
    }

    fn reals(&mut self) -> Vec<f64> {
        sized(self.scratch.reals.pop(), self.len)
    }

    fn map(&mut self, inner: &Real<'_>, f: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut values = self.real(inner);
        values.iter_mut().for_each(|v| *v = f(*v));
        values
    }

    fn combine(&mut self, pair: &[Real<'_>; 2], f: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        let (mut left, right) = (self.real(&pair[0]), self.real(&pair[1]));
        left.iter_mut().zip(&right).for_each(|(l, r)| *l = f(*l, *r));
        self.scratch.reals.push(right);
        left
    }

    fn reduce(&mut self, values: &[Real<'_>], f: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        let Some((first, rest)) = values.split_first() else { return self.reals() };
        let mut to = self.real(first);
        for value in rest {
            let right = self.real(value);
            to.iter_mut().zip(&right).for_each(|(l, r)| *l = f(*l, *r));
            self.scratch.reals.push(right);
        }
        to
    }

    fn length(&mut self, columns: &[Column<'_>]) -> Vec<f64> {
        let (mut sum, mut one) = (self.reals(), self.reals());
        sum.fill(0.0);
        for column in columns {
            fill(column, self.first, &mut one);
            sum.iter_mut().zip(&one).for_each(|(sum, v)| *sum += v * v);
        }
        sum.iter_mut().for_each(|v| *v = v.sqrt());
        self.scratch.reals.push(one);
        sum
    }
}

fn sized<T: Copy + Default>(buffer: Option<Vec<T>>, len: usize) -> Vec<T> {
    let mut buffer = buffer.unwrap_or_else(|| Vec::with_capacity(BLOCK));
    buffer.resize(len, T::default());
    buffer
}

fn fill(column: &Column<'_>, first: usize, to: &mut [f64]) {
    match column.values {
        Values::F32(values) => copy(values, column, first, to, f64::from),
        Values::F64(values) => copy(values, column, first, to, |v| v),
        Values::I32(values) => copy(values, column, first, to, f64::from),
        Values::I64(values) => copy(values, column, first, to, |v| v as f64),
    }
}

/// Copies a column's values from particle `first` on. Binding has seen to it that there is a value for each.
fn copy<T: Copy, U>(values: &[T], column: &Column<'_>, first: usize, to: &mut [U], convert: impl Fn(T) -> U) {
    let values = &values[first * column.stride..(first + to.len()) * column.stride];
    if column.stride == 1 {
        values.iter().zip(to).for_each(|(from, to)| *to = convert(*from));
    } else {
        values.chunks_exact(column.stride).zip(to).for_each(|(from, to)| *to = convert(from[column.component]));
    }
}

/// Compares pair by pair. One loop a relation, without branches.
fn relate<T: Copy + PartialOrd>(relation: Relation, a: &[T], b: &[T], to: &mut [bool]) {
    match relation {
        Relation::Equal => zip(a, b, to, |a, b| a == b),
        // Not `!=`, which NaN satisfies.
        Relation::Unequal => zip(a, b, to, |a, b| (a < b) | (a > b)),
        Relation::Less => zip(a, b, to, |a, b| a < b),
        Relation::LessOrEqual => zip(a, b, to, |a, b| a <= b),
        Relation::Greater => zip(a, b, to, |a, b| a > b),
        Relation::GreaterOrEqual => zip(a, b, to, |a, b| a >= b),
    }
}

/// As [`relate`], for whole and real numbers, exactly.
fn mixed(relation: Relation, a: &[i64], b: &[f64], to: &mut [bool]) {
    match relation {
        Relation::Equal => zip(a, b, to, |a, b| order(a, b) == Some(Ordering::Equal)),
        Relation::Unequal => zip(a, b, to, |a, b| order(a, b).is_some_and(Ordering::is_ne)),
        Relation::Less => zip(a, b, to, |a, b| order(a, b).is_some_and(Ordering::is_lt)),
        Relation::LessOrEqual => zip(a, b, to, |a, b| order(a, b).is_some_and(Ordering::is_le)),
        Relation::Greater => zip(a, b, to, |a, b| order(a, b).is_some_and(Ordering::is_gt)),
        Relation::GreaterOrEqual => zip(a, b, to, |a, b| order(a, b).is_some_and(Ordering::is_ge)),
    }
}

fn zip<A: Copy, B: Copy>(a: &[A], b: &[B], to: &mut [bool], test: impl Fn(A, B) -> bool) {
    a.iter().zip(b).zip(to).for_each(|((a, b), to)| *to = test(*a, *b));
}

/// Which is larger, of all 64 bits; `None` beside NaN.
fn order(whole: i64, real: f64) -> Option<Ordering> {
    // Rounding never passes a representable number, so only where they come out equal the lost bits decide. Then the
    // real number is whole, and at most 2⁶³.
    match (whole as f64).partial_cmp(&real) {
        Some(Ordering::Equal) => Some(i128::from(whole).cmp(&(real as i128))),
        unequal_or_nan => unequal_or_nan,
    }
}

/// The relation that `b R a` is where `a R b`.
fn mirrored(relation: Relation) -> Relation {
    match relation {
        Relation::Equal | Relation::Unequal => relation,
        Relation::Less => Relation::Greater,
        Relation::LessOrEqual => Relation::GreaterOrEqual,
        Relation::Greater => Relation::Less,
        Relation::GreaterOrEqual => Relation::LessOrEqual,
    }
}
