//! ParaView's lists of files: `.pvd`, the files of a sequence over time, and `.pvtu` and `.pvtp`, the pieces of one step.

use std::cmp::Ordering;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use super::join::join;
use super::{AttributeChoice, Particles, ReadOptions, read_particles};
use crate::error::{Error, Place};
use crate::formats::catalog::Format;
use crate::formats::detect;
use crate::formats::vtkxml::XmlFile;
use crate::formats::vtkxml::document::{Kind, Listed};

/// A file of a sequence, as a PVD lists it.
#[derive(Debug, Clone, PartialEq)]
pub struct PvdEntry {
    /// Time of the step, in whatever unit the writer used. Finite.
    pub time: f64,
    /// Which part of the step: often `0`, `1`, …, but a name is possible. Empty where the list does not tell.
    pub part: String,
    /// The file, with the PVD's folder before it unless the list has an absolute path.
    pub file: PathBuf,
}

/// Reads the list of files that a PVD is, sorted by time, then by part: numbers before names, in their order.
///
/// # Errors
/// [`Error::Open`], [`Error::Read`]; [`Error::Format`] if it is damaged or lists itself or another PVD;
/// [`Error::Unsupported`] if it is another kind of file.
pub fn read_pvd(path: &Path) -> Result<Vec<PvdEntry>, Error> {
    let file = XmlFile::open(path)?;
    if file.document().kind != Kind::Collection {
        let what = "this is no list of files over time: a PVD is a VTKFile of type Collection".into();
        return Err(Error::Unsupported { path: path.into(), what });
    }
    let mut entries = Vec::new();
    for listed in &file.document().listed {
        let file = resolve(path, listed)?;
        entries.push(PvdEntry { time: listed.time, part: listed.part.clone(), file });
    }
    entries.sort_by(|a, b| a.time.total_cmp(&b.time).then_with(|| compare_parts(&a.part, &b.part)));
    Ok(entries)
}

fn compare_parts(a: &str, b: &str) -> Ordering {
    match (a.trim().parse::<i64>(), b.trim().parse::<i64>()) {
        (Ok(a), Ok(b)) => a.cmp(&b),
        (Ok(_), Err(_)) => Ordering::Less,
        (Err(_), Ok(_)) => Ordering::Greater,
        (Err(_), Err(_)) => a.cmp(b),
    }
}

/// Reads one time step, all its parts joined; or the pieces of a `.pvtu` or `.pvtp`.
pub(crate) fn read(path: &Path, options: &ReadOptions) -> Result<Particles, Error> {
    read_list(path, options, None)
}

/// `above` is the list that names this one. Lists go no deeper, or they could go round in circles.
fn read_list(path: &Path, options: &ReadOptions, above: Option<&Path>) -> Result<Particles, Error> {
    let list = XmlFile::open(path)?;
    let files = match list.document().kind {
        Kind::Collection if above.is_some() => {
            return Err(fail(path, "a list of files over time stands in another list: name files of data".into()));
        }
        Kind::Collection => step(path, options.frame)?,
        Kind::Parallel if options.frame > 0 => {
            return Err(fail(path, format!("there is no time step {}: the file holds one, 0", options.frame)));
        }
        Kind::Parallel => {
            list.document().listed.iter().map(|listed| resolve(path, listed)).collect::<Result<_, Error>>()?
        }
        Kind::ParallelImage => {
            let what = "this lists the pieces of an image, a volume: it holds no particles (name it .pvti)";
            return Err(Error::Unsupported { path: path.into(), what: what.into() });
        }
        Kind::UnstructuredGrid | Kind::PolyData | Kind::ImageData => {
            let what = "this is no list of files but data: name it .vtu (an UnstructuredGrid), .vtp (PolyData) or .vti (ImageData)";
            return Err(Error::Unsupported { path: path.into(), what: what.into() });
        }
    };
    let may_hold_lists = list.document().kind == Kind::Collection;
    drop(list);
    check_distinct(path, &files)?;
    // What stands in a list is a single step, whatever the step's number in the list.
    let options = ReadOptions { frame: 0, ..options.clone() };
    let mut parts = Vec::with_capacity(files.len());
    for file in &files {
        let row = detect::particles(file)?;
        let part = match row.format {
            Format::Pvd if may_hold_lists => read_list(file, &options, Some(path)),
            Format::Pvd => Err(fail(path, format!("the list names '{}', which is a list, too", file.display()))),
            _ => read_particles(file, &options),
        };
        match part {
            // A part without particles may come without attributes.
            Err(Error::NoAttribute { .. }) if is_empty(file, &options) => {}
            part => parts.push(part?),
        }
    }
    let most = parts.iter().map(|part| part.attributes.len()).max().unwrap_or(0);
    let joined = join(parts);
    if matches!(options.attributes, AttributeChoice::Names(_)) && joined.attributes.len() < most {
        let what = "an attribute that was asked for has different numbers of components in the parts of the step";
        return Err(fail(path, what.into()));
    }
    Ok(joined)
}

/// The files of a step.
fn step(path: &Path, frame: usize) -> Result<Vec<PathBuf>, Error> {
    let entries = read_pvd(path)?;
    let steps: Vec<&[PvdEntry]> = entries.chunk_by(|a, b| a.time == b.time).collect();
    match steps.get(frame) {
        Some(step) => Ok(step.iter().map(|entry| entry.file.clone()).collect()),
        None => {
            let what = format!("there is no time step {frame}: the list has {}, counted from 0", steps.len());
            Err(fail(path, what))
        }
    }
}

/// A file that counted more than once would make much of a small list.
fn check_distinct(path: &Path, files: &[PathBuf]) -> Result<(), Error> {
    let mut known = BTreeSet::new();
    match files.iter().find(|file| !known.insert(file.canonicalize().unwrap_or_else(|_| file.to_path_buf()))) {
        None => Ok(()),
        Some(file) => {
            let what = format!("the list names '{}' twice for one time step: name each part once", file.display());
            Err(fail(path, what))
        }
    }
}

fn is_empty(file: &Path, options: &ReadOptions) -> bool {
    let options = ReadOptions { attributes: AttributeChoice::None, also: Vec::new(), ..options.clone() };
    read_particles(file, &options).is_ok_and(|particles| particles.positions.is_empty())
}

/// Where a listed file is.
fn resolve(path: &Path, listed: &Listed) -> Result<PathBuf, Error> {
    let file = path.parent().unwrap_or(Path::new("")).join(&listed.file);
    let is_collection = file.extension().is_some_and(|e| e.eq_ignore_ascii_case("pvd"));
    if is_collection || listed.file.as_os_str().is_empty() || same_file(path, &file) {
        let name = listed.file.display();
        return Err(fail(path, format!("the list names '{name}': itself, another list, or no file")));
    }
    Ok(file)
}

fn same_file(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

fn fail(path: &Path, what: String) -> Error {
    Error::Format { path: path.into(), place: Place::Whole, what }
}
