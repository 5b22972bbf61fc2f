//! Several sets of particles made one: the parts of a step that programs write in a file each.

use super::{AttributeValues, ParticleAttribute, Particles, PositionData};

/// Particles of all parts, one part after the other, with the attributes that every part has by the same name and
/// number of components. Precision is that of the part that has most.
pub(super) fn join(parts: Vec<Particles>) -> Particles {
    let mut parts = parts.into_iter();
    let Some(mut joined) = parts.next() else {
        return Particles { positions: PositionData::F32(Vec::new()), attributes: Vec::new() };
    };
    for part in parts {
        // A part without particles may come without attributes; it takes none from the others.
        if part.positions.is_empty() {
            continue;
        }
        if joined.positions.is_empty() {
            joined = part;
            continue;
        }
        let Particles { positions, mut attributes } = part;
        joined.positions = join_positions(joined.positions, positions);
        let mut kept = Vec::new();
        for ParticleAttribute { name, components, values } in joined.attributes {
            let other = attributes.iter().position(|a| a.name == name && a.components == components);
            if let Some(other) = other {
                let values = join_values(values, attributes.swap_remove(other).values);
                kept.push(ParticleAttribute { name, components, values });
            }
        }
        joined.attributes = kept;
    }
    joined
}

fn join_positions(first: PositionData, second: PositionData) -> PositionData {
    let widen = |positions: Vec<[f32; 3]>| positions.into_iter().map(|p| p.map(f64::from)).collect::<Vec<_>>();
    let second_len = second.len();
    let mut joined = match (first, &second) {
        (PositionData::F32(first), PositionData::F64(_)) => PositionData::F64(widen(first)),
        (first, _) => first,
    };
    joined.reserve(second_len);
    match (&mut joined, second) {
        (PositionData::F32(out), PositionData::F32(more)) => out.extend(more),
        (PositionData::F64(out), PositionData::F64(more)) => out.extend(more),
        (PositionData::F64(out), PositionData::F32(more)) => out.extend(widen(more)),
        // Widened above.
        (PositionData::F32(_), PositionData::F64(_)) => {}
    }
    joined
}

fn join_values(first: AttributeValues, second: AttributeValues) -> AttributeValues {
    use AttributeValues::{F32, F64, I32, I64};
    let mut joined = match (first, &second) {
        (first @ F32(_), F32(_)) | (first @ I32(_), I32(_)) => first,
        (first @ (I32(_) | I64(_)), I32(_) | I64(_)) => I64(integers(first)),
        (first, _) => F64(doubles(first)),
    };
    joined.reserve(second.len());
    match (&mut joined, second) {
        (F32(out), F32(more)) => out.extend(more),
        (I32(out), I32(more)) => out.extend(more),
        (I64(out), more) => out.extend(integers(more)),
        (F64(out), more) => out.extend(doubles(more)),
        // The first was widened above to hold the second.
        (F32(_) | I32(_), _) => {}
    }
    joined
}

/// Values that are integers already.
fn integers(values: AttributeValues) -> Vec<i64> {
    match values {
        AttributeValues::I64(values) => values,
        AttributeValues::I32(values) => values.into_iter().map(i64::from).collect(),
        AttributeValues::F32(values) => values.into_iter().map(|v| v as i64).collect(),
        AttributeValues::F64(values) => values.into_iter().map(|v| v as i64).collect(),
    }
}

fn doubles(values: AttributeValues) -> Vec<f64> {
    match values {
        AttributeValues::F64(values) => values,
        AttributeValues::F32(values) => values.into_iter().map(f64::from).collect(),
        AttributeValues::I32(values) => values.into_iter().map(f64::from).collect(),
        AttributeValues::I64(values) => values.into_iter().map(|v| v as f64).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(positions: PositionData, attributes: &[(&str, AttributeValues)]) -> Particles {
        let attribute = |(name, values): &(&str, AttributeValues)| ParticleAttribute {
            name: (*name).into(),
            components: 1,
            values: values.clone(),
        };
        Particles { positions, attributes: attributes.iter().map(attribute).collect() }
    }

    #[test]
    fn parts_are_joined_in_order_with_what_all_of_them_have() {
        let single = PositionData::F32(vec![[1.0, 2.0, 3.0]]);
        let double = PositionData::F64(vec![[4.0, 5.0, 6.0]]);
        let first =
            part(single.clone(), &[("id", AttributeValues::I32(vec![7])), ("own", AttributeValues::F32(vec![1.0]))]);
        let second =
            part(double, &[("mass", AttributeValues::F32(vec![0.5])), ("id", AttributeValues::I64(vec![1 << 40]))]);
        let none = part(PositionData::F64(Vec::new()), &[]);
        let joined = join(vec![none.clone(), first.clone(), none, second]);
        assert_eq!(joined.positions, PositionData::F64(vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]));
        assert_eq!(joined.attributes.len(), 1);
        assert_eq!(joined.attributes[0].values, AttributeValues::I64(vec![7, 1 << 40]));
        assert_eq!(join(vec![first.clone(), first]).positions, PositionData::F32(vec![[1.0, 2.0, 3.0]; 2]));
        assert!(join(Vec::new()).positions.is_empty());
    }
}
