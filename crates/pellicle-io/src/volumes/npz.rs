//! NumPy archives: the array that is named, else the only one of three or four axes.

use std::path::Path;

use super::file::VolumeFile;
use super::header::{Placement, VolumeArray, VolumeHeader, VolumeOptions, check_dims};
use super::npy::Layout;
use super::samples::SampleType;
use crate::error::Error;
use crate::particles::npy_header::{self, Array};
use crate::particles::npz::Archive;

pub(crate) fn open(path: &Path, options: &VolumeOptions) -> Result<VolumeFile, Error> {
    options.check_frame(path, 1)?;
    let mut archive = Archive::open(path)?;
    let arrays = archive.arrays(npy_header::read_array)?;
    let (index, name, array) = choose(path, &arrays, options)?.clone();
    let header = archive.part(index, &name, |source| {
        npy_header::read_array(source)?;
        let layout = Layout::of(source, &array, options)?;
        let mut header = VolumeHeader::new(check_dims(source, layout.dims)?, SampleType::from(array.scalar));
        layout.complete(&mut header);
        source.room(header.count() as u64, (array.scalar.size() * header.components) as u64, "samples")?;
        Ok(header)
    })?;
    let header = VolumeHeader { name: name.clone(), arrays: listed(&arrays), ..header };
    let (count, options) = (header.count(), options.clone());
    let whole = move || {
        archive.part(index, &name, |source| {
            npy_header::read_array(source)?;
            let layout = Layout::of(source, &array, &options)?;
            layout.skip_to_component(source)?;
            layout.numbers().read(source, count)
        })
    };
    Ok(VolumeFile::of_whole(path, header, Box::new(whole)))
}

fn is_volume(array: &Array) -> bool {
    matches!(array.shape.len(), 3 | 4)
}

fn listed(arrays: &[(usize, String, Array)]) -> Vec<VolumeArray> {
    let volumes = arrays.iter().filter(|(_, _, array)| is_volume(array));
    let listed = volumes.map(|(_, name, array)| VolumeArray {
        name: name.clone(),
        kind: array.scalar.into(),
        components: array.shape.get(3).map_or(1, |&n| n as usize),
        placement: Placement::Points,
    });
    listed.collect()
}

fn choose<'a>(
    path: &Path,
    arrays: &'a [(usize, String, Array)],
    options: &VolumeOptions,
) -> Result<&'a (usize, String, Array), Error> {
    let list = || {
        let list = arrays.iter().map(|(_, name, a)| format!("{name} {:?}", a.shape)).collect::<Vec<_>>().join(", ");
        if list.is_empty() { "none".to_owned() } else { list }
    };
    let (found, what) = match &options.array {
        Some(wanted) => {
            let wanted = wanted.trim_end_matches(".npy");
            let found = arrays.iter().find(|(_, name, _)| name == wanted);
            (found, format!("no array is named '{wanted}'"))
        }
        None => {
            let mut volumes = arrays.iter().filter(|(_, _, array)| is_volume(array));
            let only = volumes.next().filter(|_| volumes.next().is_none());
            (only, "which array is the volume is not clear: name one of three axes".to_owned())
        }
    };
    found.ok_or_else(|| Error::Unsupported {
        path: path.into(),
        what: format!("{what}; the arrays of numbers are: {}", list()),
    })
}

/// Whether an archive holds a volume rather than particles: an array of three axes, and none of N × 3.
pub(crate) fn is_volume_archive(path: &Path) -> Result<bool, Error> {
    let arrays = Archive::open(path)?.arrays(npy_header::read_array)?;
    let is_points = |array: &Array| array.shape.len() == 2 && array.shape[1] >= 3;
    Ok(arrays.iter().any(|(_, _, a)| is_volume(a)) && !arrays.iter().any(|(_, _, a)| is_points(a)))
}
