//! Images in several files (`.pvti`): a list of VTK XML images, each a part of the whole.
//!
//! The list tells the whole extent, the grid, the arrays and the part of each file. Of a file only that part counts: what it
//! has beyond, ghost levels, is a copy of its neighbours' samples. Where parts overlap the later one counts; together they must
//! fill the image. Files are those in the list's folder or below.
//!
//! Source: "VTK XML file formats", <https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html>.

use std::collections::BTreeSet;
use std::path::{Component, Path, PathBuf};

use super::choose::Candidate;
use super::file::VolumeFile;
use super::header::VolumeOptions;
use super::samples::Samples;
use super::vti::{Assembly, Opened, Part, Reader, describe, is_empty};
use crate::error::{Error, Place};
use crate::formats::vtkxml::XmlFile;
use crate::formats::vtkxml::document::{Kind, Listed};

/// Opens an image whose list has been read.
pub(super) fn open(list: &XmlFile, path: &Path, options: &VolumeOptions) -> Result<VolumeFile, Error> {
    let document = list.document();
    let (Some(image), Some(arrays)) = (document.image.as_ref(), document.pieces.first()) else {
        return Err(list.fail("there is no PImageData"));
    };
    let Opened { header, chosen, part } = describe(list, path, image, arrays, options)?;
    let mut pieces = Vec::new();
    for listed in &document.listed {
        let Some(extent) = listed.extent else {
            return Err(list.fail(format!("the Piece '{}' has no Extent", listed.file.display())));
        };
        if is_empty(extent) {
            continue;
        }
        let piece = Part::of(extent, chosen.placement).map_err(|what| list.fail(what))?;
        if piece.count() != Some(0) {
            pieces.push((piece, resolve(path, listed)?));
        }
    }
    check_size(path, &pieces, part, &chosen, options)?;
    let (path_of_list, options, component) = (path.to_path_buf(), options.clone(), header.component);
    let whole = move || read(&path_of_list, &pieces, part, &chosen, component, &options);
    Ok(VolumeFile::of_whole(path, header, Box::new(whole)))
}

/// Checks that the files are there, and that they can hold the image, before memory is taken for it.
fn check_size(
    path: &Path,
    pieces: &[(Part, PathBuf)],
    whole: Part,
    chosen: &Candidate,
    options: &VolumeOptions,
) -> Result<(), Error> {
    let total = whole.count().unwrap_or(u64::MAX);
    let sum = pieces.iter().fold(0u64, |sum, (part, _)| sum.saturating_add(part.count().unwrap_or(u64::MAX)));
    if sum < total {
        let what = format!("the image has {total} samples, the parts of its files have {sum}: some are missing");
        return Err(fail(path, what));
    }
    let mut bytes = 0u64;
    // A file that is listed again has no more bytes for it.
    let files: BTreeSet<&PathBuf> = pieces.iter().map(|(_, file)| file).collect();
    for file in files {
        match std::fs::metadata(file) {
            Ok(found) if found.is_file() => bytes = bytes.saturating_add(found.len()),
            Ok(_) => return Err(fail(path, format!("its piece '{}' is no file", file.display()))),
            Err(error) => return Err(fail(path, format!("its piece '{}' cannot be read: {error}", file.display()))),
        }
    }
    let (needed, available) = (total.saturating_mul(chosen.kind.bytes() as u64), options.inflated_limit(bytes));
    if needed > available {
        let what = "bytes of data, out of proportion to the size of the files";
        return Err(Error::TooLarge { path: path.into(), what, needed, available });
    }
    Ok(())
}

/// Reads file after file.
fn read(
    path: &Path,
    pieces: &[(Part, PathBuf)],
    whole: Part,
    chosen: &Candidate,
    component: usize,
    options: &VolumeOptions,
) -> Result<Samples, Error> {
    let mut image = Assembly::new(whole, chosen.kind);
    for (part, file) in pieces {
        let piece = XmlFile::open(file)?;
        piece.raise_budget(options.inflated_limit.unwrap_or(0));
        if piece.document().kind != Kind::ImageData {
            let what = format!("it is a piece of '{}' and no image: pieces are .vti files", path.display());
            return Err(Error::Unsupported { path: file.clone(), what });
        }
        Reader { file: &piece, chosen, component }.read_into(&mut image, Some(part))?;
    }
    image.complete().map_err(|what| fail(path, what))
}

/// Where a listed file is: in the list's folder or below.
fn resolve(path: &Path, listed: &Listed) -> Result<PathBuf, Error> {
    let is_below = listed.file.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    if !is_below || listed.file.file_name().is_none() {
        let name = listed.file.display();
        return Err(fail(
            path,
            format!("its piece '{name}' is not in the folder of the list: pieces must be there or below"),
        ));
    }
    Ok(path.parent().unwrap_or(Path::new("")).join(&listed.file))
}

fn fail(path: &Path, what: String) -> Error {
    Error::Format { path: path.into(), place: Place::Whole, what }
}
