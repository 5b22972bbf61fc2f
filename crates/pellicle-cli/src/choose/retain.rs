//! Leaving particles out, in place: what all choosers come down to.

use pellicle_io::{AttributeValues, Particles, PositionData};

/// Keeps the particles whose mark is set, in their order; positions and attributes alike. Works in place; where most go,
/// their memory is given back. There is a mark for each particle.
pub fn retain(particles: &mut Particles, keep: &[bool]) {
    if keep.iter().all(|&k| k) {
        return;
    }
    match &mut particles.positions {
        PositionData::F32(positions) => compact(positions, keep, 1),
        PositionData::F64(positions) => compact(positions, keep, 1),
    }
    for attribute in &mut particles.attributes {
        match &mut attribute.values {
            AttributeValues::F32(values) => compact(values, keep, attribute.components),
            AttributeValues::F64(values) => compact(values, keep, attribute.components),
            AttributeValues::I32(values) => compact(values, keep, attribute.components),
            AttributeValues::I64(values) => compact(values, keep, attribute.components),
        }
    }
}

/// The opposite of [`retain`]'s result, as a copy: the particles whose mark is set.
pub fn copy(particles: &Particles, take: &[bool]) -> Particles {
    let positions = match &particles.positions {
        PositionData::F32(positions) => PositionData::F32(gather(positions, take, 1)),
        PositionData::F64(positions) => PositionData::F64(gather(positions, take, 1)),
    };
    let attributes = particles.attributes.iter().map(|attribute| pellicle_io::ParticleAttribute {
        name: attribute.name.clone(),
        components: attribute.components,
        values: match &attribute.values {
            AttributeValues::F32(values) => AttributeValues::F32(gather(values, take, attribute.components)),
            AttributeValues::F64(values) => AttributeValues::F64(gather(values, take, attribute.components)),
            AttributeValues::I32(values) => AttributeValues::I32(gather(values, take, attribute.components)),
            AttributeValues::I64(values) => AttributeValues::I64(gather(values, take, attribute.components)),
        },
    });
    Particles { positions, attributes: attributes.collect() }
}

fn gather<T: Copy>(values: &[T], take: &[bool], each: usize) -> Vec<T> {
    let rows = values.chunks_exact(each.max(1)).zip(take).filter(|(_, take)| **take);
    rows.flat_map(|(row, _)| row).copied().collect()
}

/// Runs of fewer values are moved one by one: a call for each takes longer.
const SHORT: usize = 32;

/// Moves runs of kept rows to the front.
fn compact<T: Copy>(values: &mut Vec<T>, keep: &[bool], each: usize) {
    let mut kept = 0;
    let mut row = 0;
    for run in keep.chunk_by(|a, b| a == b) {
        if run[0] {
            // Cut short where there are fewer values than marks.
            let (start, end) = (row * each, ((row + run.len()) * each).min(values.len()));
            if start < end {
                if end - start < SHORT {
                    (start..end).zip(kept..).for_each(|(from, to)| values[to] = values[from]);
                } else {
                    values.copy_within(start..end, kept);
                }
                kept += end - start;
            }
        }
        row += run.len();
    }
    values.truncate(kept);
    if kept < values.capacity() / 2 {
        values.shrink_to_fit();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::choose::sample::sample;

    #[test]
    fn order_and_rows_survive() {
        let mut particles = sample(5);
        let keep = [true, false, true, true, false];
        let gone = copy(&particles, &keep.map(|k| !k));
        retain(&mut particles, &keep);
        assert_eq!(particles.positions, PositionData::F64(vec![[0.0; 3], [2.0; 3], [3.0; 3]]));
        assert_eq!(particles.attributes[0].values, AttributeValues::I32(vec![0, 2, 3]));
        let rows = AttributeValues::F32(vec![0., 1., 4., 5., 6., 7.]);
        assert_eq!((particles.attributes[1].name.as_str(), &particles.attributes[1].values), ("uv", &rows));
        assert_eq!(gone.positions, PositionData::F64(vec![[1.0; 3], [4.0; 3]]));
        assert_eq!(gone.attributes[1].values, AttributeValues::F32(vec![2., 3., 8., 9.]));
        let before = particles.clone();
        retain(&mut particles, &[true; 3]);
        assert_eq!(particles, before);
        retain(&mut particles, &[false; 3]);
        assert_eq!((particles.positions.len(), particles.attributes[1].values.len()), (0, 0));
    }

    #[test]
    fn runs_of_any_length_keep_their_values() {
        for run in [1, 2, 31, 32, 33, 500] {
            let mut values: Vec<usize> = (0..3000).collect();
            let keep: Vec<bool> = (0..1000).map(|i| i / run % 2 == 1).collect();
            compact(&mut values, &keep, 3);
            assert!(values.iter().copied().eq((0..3000).filter(|v| keep[v / 3])), "{run}");
        }
    }

    #[test]
    fn memory_of_the_many_that_go_is_given_back() {
        let mut values = vec![7u64; 100_000];
        let keep: Vec<bool> = (0..100_000).map(|i| i % 10 == 0).collect();
        compact(&mut values, &keep, 1);
        assert!(values.len() == 10_000 && values.capacity() < 20_000, "{}", values.capacity());
    }
}
