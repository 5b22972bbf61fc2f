//! Which groups and datasets of an HDF5 file are particles.

use hdf5_reader::group::Group;

use super::channels::{self, Channel, describe};
use super::store::{Numbers, Store};
use super::vtkhdf;
use crate::error::Error;
use crate::particles::{Particles, ReadOptions};

/// Names of a dataset of positions, in lower case.
const POSITIONS: [&str; 7] = ["coordinates", "positions", "position", "pos", "points", "point", "x"];
/// Groups that are looked into for a list of what there is.
const MAX_LISTED: usize = 40;

/// Reads the particles of a file in whatever layout it has.
pub(super) fn read(store: &Store, options: &ReadOptions) -> Result<Particles, Error> {
    let (groups, datasets) = store.names(store.root())?;
    let has = |name: &str| groups.iter().any(|group| group == name);
    if has("VTKHDF") && options.array.is_none() {
        return vtkhdf::read(store, options);
    }
    if options.frame > 0 {
        return Err(store.fail(format!("there is no time step {}: the file holds one, 0", options.frame)));
    }
    if let Some(name) = &options.array {
        return read_named(store, name, options);
    }
    if has("PartType0") {
        return read_group(store, &store.group(store.root(), "PartType0")?, options);
    }
    if has("particles") {
        let all = store.group(store.root(), "particles")?;
        let (names, _) = store.names(&all)?;
        let chosen = match names.as_slice() {
            [only] => Some(only),
            several => several.iter().find(|name| *name == "fluid"),
        };
        if let Some(name) = chosen {
            return read_group(store, &arrays_of(store, store.group(&all, name)?)?, options);
        }
    }
    // Particles at the top of the file, or in the only group that there is.
    let group = match groups.as_slice() {
        [only] if datasets.is_empty() => store.group(store.root(), only)?,
        _ => store.root().clone(),
    };
    let numbers = channels::of_group(store, &group, None)?;
    if find_positions(&mut numbers.clone()).is_some() {
        return read_group(store, &group, options);
    }
    let what =
        format!("which of its content are particles is not clear: name a group or dataset of it ({})", list(store)?);
    Err(store.unsupported(what))
}

/// Reads the group or dataset that the caller names, by its path; `fluid` will do for `particles/fluid`.
fn read_named(store: &Store, path: &str, options: &ReadOptions) -> Result<Particles, Error> {
    let names: Vec<&str> = path.split('/').filter(|name| !name.is_empty()).collect();
    let missing = || Ok(store.unsupported(format!("there is no group or dataset '{path}': it has {}", list(store)?)));
    let Some((last, above)) = names.split_last() else { return Err(missing()?) };
    let mut group = store.root().clone();
    for name in above {
        if !store.names(&group)?.0.iter().any(|found| found == name) {
            return Err(missing()?);
        }
        group = store.group(&group, name)?;
    }
    let (mut groups, datasets) = store.names(&group)?;
    if above.is_empty() && !groups.iter().any(|name| name == last) && groups.iter().any(|name| name == "particles") {
        let particles = store.group(&group, "particles")?;
        let inner = store.names(&particles)?.0;
        if inner.iter().any(|name| name == last) {
            (group, groups) = (particles, inner);
        }
    }
    if groups.iter().any(|name| name == last) {
        return read_group(store, &arrays_of(store, store.group(&group, last)?)?, options);
    }
    if !datasets.iter().any(|name| name == last) {
        return Err(missing()?);
    }
    let Some(numbers) = store.numbers(&group, last)?.filter(|numbers| numbers.width == 3) else {
        return Err(store.unsupported(format!("the dataset '{path}' does not have three columns of numbers")));
    };
    let count = numbers.rows;
    let others = channels::of_group(store, &group, Some(count))?;
    let attributes: Vec<Channel> = others.into_iter().filter(|other| other.name != *last).map(Channel::of).collect();
    channels::read(store, &Channel::of(numbers), &attributes, count, options)
}

/// PySPH keeps the datasets of a group one level below.
fn arrays_of(store: &Store, group: Group) -> Result<Group, Error> {
    if store.names(&group)?.0.iter().any(|name| name == "arrays") { store.group(&group, "arrays") } else { Ok(group) }
}

/// Reads a group of datasets, one for each quantity.
fn read_group(store: &Store, group: &Group, options: &ReadOptions) -> Result<Particles, Error> {
    let mut numbers = channels::of_group(store, group, None)?;
    let Some(positions) = find_positions(&mut numbers) else {
        let found: Vec<String> = numbers.iter().map(describe).collect();
        let what = format!(
            "the group '{}' has no Coordinates, positions or x, y, z; it has: {}",
            group.name(),
            found.join(", ")
        );
        return Err(store.unsupported(what));
    };
    let count = positions.parts.first().map_or(0, |part| part.rows);
    numbers.retain(|numbers| numbers.rows == count);
    let velocity = ["vx", "vy", "vz"];
    let velocity = channels::take_triple(&mut numbers, velocity, "velocity")
        .or_else(|| channels::take_triple(&mut numbers, ["u", "v", "w"], "velocity"));
    let attributes: Vec<Channel> = velocity.into_iter().chain(numbers.into_iter().map(Channel::of)).collect();
    channels::read(store, &positions, &attributes, count, options)
}

/// Takes the positions out of `list`.
fn find_positions(list: &mut Vec<Numbers>) -> Option<Channel> {
    for name in POSITIONS {
        let is_it = |numbers: &Numbers| numbers.width == 3 && numbers.name.eq_ignore_ascii_case(name);
        if let Some(at) = list.iter().position(is_it) {
            return Some(Channel::of(list.remove(at)));
        }
    }
    channels::take_triple(list, ["x", "y", "z"], "position")
}

/// What a file has, for messages.
fn list(store: &Store) -> Result<String, Error> {
    let mut found = Vec::new();
    let (groups, datasets) = store.names(store.root())?;
    found.extend(datasets);
    for name in groups.iter().take(MAX_LISTED) {
        let group = store.group(store.root(), name)?;
        let (inner_groups, inner) = store.names(&group)?;
        found.push(name.clone());
        found.extend(inner_groups.iter().chain(&inner).map(|inner| format!("{name}/{inner}")));
    }
    found.truncate(MAX_LISTED);
    Ok(if found.is_empty() { "nothing".into() } else { found.join(", ") })
}
