//! Work on disjoint ranges of slices in parallel, where the ranges have unequal lengths.

use std::ops::Range;

/// Slices, or tuples of slices, that can be cut in two: before element `at`, which begins item `item`.
pub(crate) trait Split: Sized + Send {
    fn split(self, item: usize, at: usize) -> (Self, Self);
}

impl<T: Send> Split for &mut [T] {
    fn split(self, _: usize, at: usize) -> (Self, Self) {
        self.split_at_mut(at)
    }
}

impl<D: Split> Split for Option<D> {
    fn split(self, item: usize, at: usize) -> (Self, Self) {
        self.map(|data| data.split(item, at)).unzip()
    }
}

/// A slice with the same number of elements (the second field) for each item.
pub(crate) struct PerItem<'a, T>(pub(crate) &'a mut [T], pub(crate) usize);

impl<T: Send> Split for PerItem<'_, T> {
    fn split(self, item: usize, _: usize) -> (Self, Self) {
        let (left, right) = self.0.split_at_mut(item * self.1);
        (Self(left, self.1), Self(right, self.1))
    }
}

macro_rules! split_tuple {
    ($($name:ident $at:tt),*) => {
        impl<$($name: Split),*> Split for ($($name,)*) {
            fn split(self, item: usize, at: usize) -> (Self, Self) {
                let parts = ($(self.$at.split(item, at),)*);
                (($(parts.$at.0,)*), ($(parts.$at.1,)*))
            }
        }
    };
}
split_tuple!(A 0, B 1);
split_tuple!(A 0, B 1, C 2);
split_tuple!(A 0, B 1, C 2, D 3);

/// Calls `work(item, part)` for every item of `items`, with the part of `data` that belongs to it: from `start(item)` to
/// `start(item + 1)`, where `start` never falls and `start(items.start)` is where `data` begins. Halves the items until
/// one is left, so that nothing is allocated.
pub(crate) fn for_each_part<D: Split>(
    items: Range<usize>,
    data: D,
    start: &(impl Fn(usize) -> usize + Sync),
    work: &(impl Fn(usize, D) + Sync),
) {
    match items.len() {
        0 => {}
        1 => work(items.start, data),
        n => {
            let mid = items.start + n / 2;
            let (left, right) = data.split(mid - items.start, start(mid) - start(items.start));
            rayon::join(
                || for_each_part(items.start..mid, left, start, work),
                || for_each_part(mid..items.end, right, start, work),
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_item_gets_its_own_part() {
        let starts = [0usize, 3, 3, 7, 12];
        let mut data = vec![0usize; 12];
        for_each_part(0..4, &mut data[..], &|i| starts[i], &|i, part: &mut [usize]| {
            assert_eq!(part.len(), starts[i + 1] - starts[i]);
            part.fill(i + 1);
        });
        assert_eq!(data, [1, 1, 1, 3, 3, 3, 3, 4, 4, 4, 4, 4]);
    }
}
