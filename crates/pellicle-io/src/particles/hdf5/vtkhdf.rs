//! VTKHDF: the points of a PolyData or UnstructuredGrid and their PointData, of one time step.
//!
//! All steps share the datasets; `Steps` tells where each begins. A step may be written in several parts, whose points
//! follow one another.

use hdf5_reader::group::Group;

use super::channels::{self, Channel};
use super::store::Store;
use crate::error::Error;
use crate::particles::{Particles, ReadOptions};

pub(super) fn read(store: &Store, options: &ReadOptions) -> Result<Particles, Error> {
    let group = store.group(store.root(), "VTKHDF")?;
    let kind = group.attribute("Type").and_then(|kind| kind.read_string()).map_err(|error| store.explain(error))?;
    if !matches!(kind.trim_end_matches('\0').trim(), "PolyData" | "UnstructuredGrid") {
        let what = format!("a VTKHDF file of type '{kind}': particles are read from PolyData and UnstructuredGrid");
        return Err(store.unsupported(what));
    }
    let Some(points) = store.numbers(&group, "Points")?.filter(|points| points.width == 3) else {
        return Err(store.fail("VTKHDF/Points does not have three columns of numbers"));
    };
    let (groups, _) = store.names(&group)?;
    let has = |name: &str| groups.iter().any(|group| group == name);
    let data = if has("PointData") { Some(store.group(&group, "PointData")?) } else { None };
    let step = if has("Steps") { Some(Step::of(store, &group, options.frame)?) } else { None };
    if step.is_none() && options.frame > 0 {
        return Err(store.fail(format!("there is no time step {}: the file holds one, 0", options.frame)));
    }
    let (first, count) = step.as_ref().map_or((0, points.rows), |step| (step.first, step.count));
    let mut attributes = Vec::new();
    if let Some(data) = &data {
        for numbers in channels::of_group(store, data, None)? {
            let first = match &step {
                Some(step) => step.first_of(store, &numbers.name)?,
                None => 0,
            };
            let mut channel = Channel::of(numbers);
            channel.first = first;
            attributes.push(channel);
        }
    }
    let mut positions = Channel::of(points);
    positions.first = first;
    channels::read(store, &positions, &attributes, count, options)
}

/// Where the data of a time step are.
struct Step {
    steps: Group,
    frame: usize,
    first: u64,
    count: u64,
}

impl Step {
    fn of(store: &Store, group: &Group, frame: usize) -> Result<Step, Error> {
        let steps = store.group(group, "Steps")?;
        let Some(offsets) = store.integers(&steps, "PointOffsets")? else {
            return Err(store.fail("VTKHDF/Steps has no PointOffsets"));
        };
        let Some(&first) = offsets.get(frame) else {
            return Err(
                store.fail(format!("there is no time step {frame}: the file has {}, counted from 0", offsets.len()))
            );
        };
        let Some(counts) = store.integers(group, "NumberOfPoints")? else {
            return Err(store.fail("VTKHDF has no NumberOfPoints"));
        };
        let at = |list: Option<Vec<i64>>, otherwise: i64| {
            list.map_or(Some(otherwise), |list| list.get(frame).copied()).and_then(|value| usize::try_from(value).ok())
        };
        let part = at(store.integers(&steps, "PartOffsets")?, i64::try_from(frame).unwrap_or(i64::MAX));
        let parts = at(store.integers(&steps, "NumberOfParts")?, 1);
        let counts = part.zip(parts).and_then(|(part, parts)| counts.get(part..part.checked_add(parts)?));
        let count = counts
            .and_then(|counts| counts.iter().try_fold(0u64, |sum, &count| sum.checked_add(u64::try_from(count).ok()?)));
        match (u64::try_from(first), count) {
            (Ok(first), Some(count)) => Ok(Step { steps, frame, first, count }),
            _ => Err(store.fail(format!("VTKHDF/Steps contradicts NumberOfPoints at time step {frame}"))),
        }
    }

    /// The first row of an array of PointData, which may stay the same over several steps.
    fn first_of(&self, store: &Store, name: &str) -> Result<u64, Error> {
        if !store.names(&self.steps)?.0.iter().any(|group| group == "PointDataOffsets") {
            return Ok(self.first);
        }
        let offsets = store.integers(&store.group(&self.steps, "PointDataOffsets")?, name)?;
        let Some(offsets) = offsets else { return Ok(self.first) };
        let first = offsets.get(self.frame).and_then(|&first| u64::try_from(first).ok());
        first.ok_or_else(|| store.fail(format!("VTKHDF/Steps/PointDataOffsets/{name} has no step {}", self.frame)))
    }
}
