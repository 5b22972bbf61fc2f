//! Datasets of a group as positions and attributes, whether a vector is one dataset or three.

use std::ops::Range;

use hdf5_reader::group::Group;

use super::store::{Numbers, Store};
use crate::error::Error;
use crate::formats::names;
use crate::particles::{AttributeValues, ParticleAttribute, Particles, PositionData, ReadOptions};
use crate::scalar::{Kind, Scalar, Target};

/// A vector or scalar per particle: one dataset, or one for each component.
pub(super) struct Channel {
    pub(super) name: String,
    pub(super) original: String,
    pub(super) parts: Vec<Numbers>,
    /// Row of the first particle.
    pub(super) first: u64,
}

impl Channel {
    pub(super) fn of(numbers: Numbers) -> Channel {
        let original = numbers.name.clone();
        Channel { name: names::canonical(&original, numbers.width), original, parts: vec![numbers], first: 0 }
    }

    fn components(&self) -> usize {
        self.parts.iter().map(|part| part.width).sum()
    }

    fn read<D: Target + Send>(&self, store: &Store, count: u64) -> Result<Vec<D>, Error> {
        let rows: Range<u64> = self.first..self.first.saturating_add(count);
        if let [single] = self.parts.as_slice() {
            return store.read(single, rows);
        }
        let components = self.components();
        let mut out: Vec<D> = Vec::new();
        for (at, part) in self.parts.iter().enumerate() {
            let values: Vec<D> = store.read(part, rows.clone())?;
            out.resize(values.len() * components, D::default());
            for (to, value) in out.iter_mut().skip(at).step_by(components).zip(values) {
                *to = value;
            }
        }
        Ok(out)
    }

    fn scalars(&self) -> impl Iterator<Item = Scalar> {
        self.parts.iter().map(|part| part.scalar)
    }
}

/// The datasets of a group that hold `count` rows or any, if `None`.
pub(super) fn of_group(store: &Store, group: &Group, count: Option<u64>) -> Result<Vec<Numbers>, Error> {
    let mut found = Vec::new();
    for name in store.names(group)?.1 {
        found.extend(store.numbers(group, &name)?.filter(|numbers| count.is_none_or(|count| numbers.rows == count)));
    }
    Ok(found)
}

/// Takes three datasets of single numbers out of `list`, if all are there.
pub(super) fn take_triple(list: &mut Vec<Numbers>, wanted: [&str; 3], name: &str) -> Option<Channel> {
    let find = |name: &str| list.iter().position(|numbers| numbers.name == name && numbers.width == 1);
    let places = [find(wanted[0])?, find(wanted[1])?, find(wanted[2])?];
    let parts: Vec<Numbers> = places.iter().map(|&at| list[at].clone()).collect();
    if parts.iter().any(|part| part.rows != parts[0].rows) {
        return None;
    }
    list.retain(|numbers| !wanted.contains(&numbers.name.as_str()));
    Some(Channel { name: name.into(), original: name.into(), parts, first: 0 })
}

/// Reads `count` particles.
pub(super) fn read(
    store: &Store,
    positions: &Channel,
    attributes: &[Channel],
    count: u64,
    options: &ReadOptions,
) -> Result<Particles, Error> {
    options.check(store.path(), attributes.iter().map(|a| (a.name.as_str(), a.original.as_str())))?;
    let positions = if positions.scalars().all(Scalar::fits_f32) {
        PositionData::F32(triples(positions.read(store, count)?))
    } else {
        PositionData::F64(triples(positions.read(store, count)?))
    };
    let mut read = Vec::new();
    for channel in attributes.iter().filter(|channel| options.wants(&channel.name, &channel.original)) {
        let values = match AttributeValues::of(channel.scalars(), 0) {
            AttributeValues::F32(_) => AttributeValues::F32(channel.read(store, count)?),
            AttributeValues::F64(_) => AttributeValues::F64(channel.read(store, count)?),
            AttributeValues::I32(_) => AttributeValues::I32(channel.read(store, count)?),
            AttributeValues::I64(_) => AttributeValues::I64(channel.read(store, count)?),
        };
        let (name, components) = (channel.name.clone(), channel.components());
        read.push(ParticleAttribute { name, components, values });
    }
    Ok(Particles { positions, attributes: read })
}

fn triples<T: bytemuck::Pod>(values: Vec<T>) -> Vec<[T; 3]> {
    // The channel has three components, so nothing is left over, and the memory is taken as it is.
    bytemuck::allocation::try_cast_vec(values).unwrap_or_else(|(_, values)| values.as_chunks().0.to_vec())
}

/// The kind of numbers that a dataset holds, for messages.
pub(super) fn describe(numbers: &Numbers) -> String {
    let kind = match numbers.scalar.kind() {
        Kind::F32 => "f32",
        Kind::F64 => "f64",
        Kind::I32 | Kind::I64 => "integers",
    };
    format!("{} ({} × {} {kind})", numbers.name, numbers.rows, numbers.width)
}
