//! Which array of a file that has several.

use std::path::Path;

use super::header::{Placement, VolumeArray, VolumeOptions};
use crate::error::Error;

/// An array that may be chosen.
pub(super) type Candidate = VolumeArray;

/// The array that is named, or the active one (of points, or of cells), or the first of one component, or the first.
pub(super) fn array<'a>(
    path: &Path,
    candidates: &'a [Candidate],
    active: &[Option<String>; 2],
    options: &VolumeOptions,
) -> Result<&'a Candidate, Error> {
    let named = |name: &str, placement: Option<Placement>| {
        let fits = |c: &&Candidate| c.name == name && placement.is_none_or(|placement| c.placement == placement);
        candidates.iter().find(fits)
    };
    if let Some(wanted) = &options.array {
        let by_part = || match wanted.split_once('/')? {
            ("point", name) => named(name, Some(Placement::Points)),
            ("cell", name) => named(name, Some(Placement::Cells)),
            _ => None,
        };
        return named(wanted, None).or_else(by_part).ok_or_else(|| {
            let list = candidates.iter().map(qualified).collect::<Vec<_>>().join(", ");
            let list = if list.is_empty() { "none".into() } else { list };
            let what = format!("no array of numbers is named '{wanted}'; there are: {list}");
            Error::Unsupported { path: path.into(), what }
        });
    }
    let [of_points, of_cells] = active;
    let active = [(of_points, Placement::Points), (of_cells, Placement::Cells)].into_iter();
    let mut active = active.filter_map(|(name, placement)| named(name.as_ref()?, Some(placement)));
    let single = || candidates.iter().find(|c| c.components == 1);
    active.next().or_else(single).or_else(|| candidates.first()).ok_or_else(|| Error::Unsupported {
        path: path.into(),
        what: "there is no array of numbers, of points or of cells".into(),
    })
}

fn qualified(candidate: &Candidate) -> String {
    let part = if candidate.placement == Placement::Cells { "cell" } else { "point" };
    format!("{part}/{}", candidate.name)
}
