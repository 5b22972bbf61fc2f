//! Numbered series among the files of a folder, or of a list.
//!
//! Every run of digits in a name may be its frame number; the run counts by which most files belong together. So
//! `run2_0001.vtk … run2_0100.vtk` is one series of 100 and not 100 of one.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

use pellicle_io::FormatInfo;

use crate::failure::Failure;

use super::gaps::span_text;
use super::pattern::distinct;

/// Series that a message shows.
const SHOWN: usize = 8;

/// Files that differ by one number.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    before: String,
    after: String,
    /// Digits of the shortest number, where numbers are padded.
    padding: usize,
    /// In numeric order.
    pub files: Vec<(i64, PathBuf)>,
}

/// What a folder, or a list, holds.
#[derive(Debug, Default)]
pub struct Sorted {
    /// Two files each at least.
    pub series: Vec<Series>,
    /// Files that belong to no series.
    pub single: Vec<PathBuf>,
}

/// Whether the name's extension is one that particles are read from.
fn is_readable(name: &str) -> bool {
    let of_particles = |format: &FormatInfo| format.reads_particles;
    let mut known = pellicle_io::formats().filter(of_particles).flat_map(|format| format.extensions);
    extension(name).is_some_and(|found| known.any(|e| *e == found))
}

/// The longest extension of a format of particles or volumes that the name has, without its dot.
fn extension(name: &str) -> Option<&'static str> {
    let lower = name.to_ascii_lowercase();
    let is_read = |format: &FormatInfo| format.reads_particles || format.reads_volumes;
    let known = pellicle_io::formats().filter(is_read).flat_map(|format| format.extensions);
    let has = |e: &&&str| lower.strip_suffix(**e).is_some_and(|stem| stem.ends_with('.') && stem.len() > 1);
    known.filter(has).max_by_key(|e| e.len()).copied()
}

/// The frames of a folder: all particle files in it, which must be one series, or one file.
///
/// # Errors
/// A folder that cannot be read, has no particle files, or more than one series: then they are listed with what to type.
pub fn of_folder(folder: &Path) -> Result<Vec<(Option<i64>, PathBuf)>, Failure> {
    let failed = |error: std::io::Error| Failure::file(folder, format_args!("cannot list the folder: {error}"));
    let mut paths = Vec::new();
    for entry in fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        // A leading dot hides a file: one that is being written, or a resource of the system's.
        if is_readable(&name) && !name.starts_with('.') && path.is_file() {
            paths.push(path);
        }
    }
    paths.sort();
    if paths.is_empty() {
        let known: Vec<String> = pellicle_io::formats()
            .filter(|format| format.reads_particles)
            .flat_map(|format| format.extensions)
            .map(|e| format!(".{e}"))
            .collect();
        let what = format!("no particle files are in this folder: they are read from {}", known.join(" "));
        return Err(Failure::file(folder, what));
    }
    let Sorted { mut series, single } = sort(&paths);
    match (series.len(), single.as_slice()) {
        (1, []) => Ok(distinct(series.remove(0).files)?.into_iter().map(|(n, path)| (Some(n), path)).collect()),
        (0, [path]) => Ok(vec![(None, path.clone())]),
        _ => Err(several(folder, &series, &single)),
    }
}

/// What a folder holds, and what to type for each.
fn several(folder: &Path, series: &[Series], single: &[PathBuf]) -> Failure {
    let numbers = |s: &Series| s.files.iter().map(|(n, _)| *n).collect::<Vec<_>>();
    let series = series.iter().map(|s| format!("{} ({})", folder.join(s.pattern()).display(), span_text(&numbers(s))));
    let all: Vec<String> = series.chain(single.iter().map(|path| path.display().to_string())).collect();
    let more = if all.len() > SHOWN { format!("\n  and {} more", all.len() - SHOWN) } else { String::new() };
    let shown = &all[..all.len().min(SHOWN)];
    Failure::file(
        folder,
        format_args!("the particle files here are no single series; name one:\n  {}{more}", shown.join("\n  ")),
    )
}

impl Series {
    /// The name to type for it, in its folder.
    pub fn pattern(&self) -> String {
        let place = if self.padding > 0 { "#".repeat(self.padding) } else { "{}".to_owned() };
        format!("{}{place}{}", self.before, self.after)
    }
}

/// A run of digits in a name.
struct Run<'a> {
    before: &'a str,
    digits: &'a str,
    after: &'a str,
}

impl Run<'_> {
    fn number(&self) -> Option<i64> {
        self.digits.parse().ok()
    }
}

/// The runs of digits before the extension. A minus belongs to the number where nothing or a separator stands before it.
fn runs(name: &str) -> Vec<Run<'_>> {
    let stem = extension(name).map_or(name.len(), |e| name.len() - e.len() - 1);
    let bytes = &name.as_bytes()[..stem];
    let mut runs = Vec::new();
    let mut at = 0;
    while at < stem {
        let digits = bytes[at..].iter().take_while(|b| b.is_ascii_digit()).count();
        if digits == 0 {
            at += 1;
            continue;
        }
        let separated =
            at >= 1 && bytes[at - 1] == b'-' && (at == 1 || matches!(bytes[at - 2], b'_' | b'.' | b'-' | b' '));
        let start = at - usize::from(separated);
        // Digits and a minus are ASCII, so these are boundaries of characters.
        runs.push(Run { before: &name[..start], digits: &name[start..at + digits], after: &name[at + digits..] });
        at += digits;
    }
    runs.retain(|run| run.number().is_some());
    runs
}

/// Sorts files of one folder into series, in the order of their names.
pub fn sort(paths: &[PathBuf]) -> Sorted {
    let named: Vec<(&PathBuf, Option<&str>)> =
        paths.iter().map(|path| (path, path.file_name().and_then(|name| name.to_str()))).collect();
    let mut sizes: HashMap<(&str, &str), usize> = HashMap::new();
    for (_, name) in &named {
        for run in name.map(runs).unwrap_or_default() {
            *sizes.entry((run.before, run.after)).or_default() += 1;
        }
    }
    let mut sorted = Sorted::default();
    let mut places: HashMap<(&str, &str), usize> = HashMap::new();
    for (path, name) in &named {
        // Of equal ones the last, where numbers usually stand.
        let best = name.map(runs).unwrap_or_default().into_iter().max_by_key(|run| sizes[&(run.before, run.after)]);
        let Some((run, number)) = best.and_then(|run| run.number().map(|number| (run, number))) else {
            sorted.single.push((*path).clone());
            continue;
        };
        let place = *places.entry((run.before, run.after)).or_insert_with(|| {
            let (before, after) = (run.before.to_owned(), run.after.to_owned());
            sorted.series.push(Series { before, after, padding: 0, files: Vec::new() });
            sorted.series.len() - 1
        });
        let series = &mut sorted.series[place];
        let digits = run.digits.trim_start_matches('-');
        if digits.len() > 1 && digits.starts_with('0') {
            series.padding = if series.padding == 0 { digits.len() } else { series.padding.min(digits.len()) };
        }
        series.files.push((number, (*path).clone()));
    }
    for series in &mut sorted.series {
        series.files.sort();
    }
    let (series, lone): (Vec<_>, Vec<_>) = sorted.series.into_iter().partition(|series| series.files.len() > 1);
    sorted.series = series;
    sorted.single.extend(lone.into_iter().flat_map(|series| series.files).map(|(_, path)| path));
    sorted.single.sort();
    sorted
}

/// The frame numbers of files in a list, where all differ by one number; else `None`.
pub fn numbers(paths: &[PathBuf]) -> Option<Vec<i64>> {
    let Sorted { series, single } = sort(paths);
    let [series] = series.as_slice() else { return None };
    let is_one_folder = paths.iter().all(|path| path.parent() == paths[0].parent());
    if !single.is_empty() || !is_one_folder || series.files.array_windows().any(|[a, b]| a.0 == b.0) {
        return None;
    }
    let of: HashMap<&Path, i64> = series.files.iter().map(|(number, path)| (path.as_path(), *number)).collect();
    paths.iter().map(|path| of.get(path.as_path()).copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sequence::scratch::Folder;

    fn names(folder: &Folder, found: Vec<(Option<i64>, PathBuf)>) -> Vec<(Option<i64>, String)> {
        let name = |p: PathBuf| p.strip_prefix(folder.path()).unwrap().to_str().unwrap().to_owned();
        found.into_iter().map(|(n, p)| (n, name(p))).collect()
    }

    #[test]
    fn a_folder_with_one_series_is_its_frames_in_natural_order() {
        let folder =
            Folder::with(&["run2_10.vtk", "run2_9.vtk", "run2_-1.vtk", "notes.md", ".run2_11.vtk", "sub/run2_12.vtk"]);
        let found = names(&folder, of_folder(folder.path()).unwrap());
        let want = [(-1, "run2_-1.vtk"), (9, "run2_9.vtk"), (10, "run2_10.vtk")];
        assert_eq!(found, want.map(|(n, p)| (Some(n), p.to_owned())));
        let folder = Folder::with(&["drop.bgeo.gz"]);
        assert_eq!(names(&folder, of_folder(folder.path()).unwrap()), [(None, "drop.bgeo.gz".to_owned())]);
    }

    #[test]
    fn several_series_are_listed_with_what_to_type() {
        let folder =
            Folder::with(&["fluid_0001.vtk", "fluid_0002.vtk", "fluid_0010.vtk", "b.9.ply", "b.10.ply", "box.ply"]);
        let message = of_folder(folder.path()).unwrap_err().to_string();
        for part in ["fluid_####.vtk (3 frames, 1 to 10)", "b.{}.ply (2 frames, 9 to 10)", "box.ply"] {
            assert!(message.contains(part), "{message}");
        }
        let empty = Folder::with(&["a.md", "vtk"]);
        assert!(of_folder(empty.path()).unwrap_err().to_string().contains(".vtk"));
        let twice = Folder::with(&["a_1.ply", "a_01.ply", "a_2.ply"]);
        let message = of_folder(twice.path()).unwrap_err().to_string();
        assert!(message.contains("a_01.ply and ") && message.contains("both frame 1"), "{message}");
    }

    #[test]
    fn the_number_is_the_run_that_most_files_share() {
        let pattern = |names: &[&str]| -> Vec<String> {
            let paths: Vec<PathBuf> = names.iter().map(PathBuf::from).collect();
            sort(&paths).series.iter().map(Series::pattern).collect()
        };
        assert_eq!(pattern(&["f001_v2.ply", "f002_v2.ply", "f003_v2.ply"]), ["f###_v2.ply"]);
        assert_eq!(pattern(&["a1_1.h5", "a1_2.h5", "a2_1.h5", "a2_2.h5", "a2_3.h5"]).len(), 2);
        assert_eq!(pattern(&["t0.10.bgeo", "t0.20.bgeo"]), ["t0.{}.bgeo"]);
        assert_eq!(pattern(&["a98.csv", "a99.csv", "a100.csv"]), ["a{}.csv"]);
    }

    #[test]
    fn lists_are_numbered_only_if_all_differ_by_one_number() {
        let numbers = |names: &[&str]| numbers(&names.iter().map(PathBuf::from).collect::<Vec<_>>());
        assert_eq!(numbers(&["d/f_3.ply", "d/f_1.ply", "d/f_20.ply"]), Some(vec![3, 1, 20]));
        assert_eq!(numbers(&["f_3.ply", "g_4.ply"]), None);
        assert_eq!(numbers(&["a/f_3.ply", "b/f_4.ply"]), None);
        assert_eq!(numbers(&["f_3.ply", "f_03.ply"]), None);
        assert_eq!(numbers(&["f_3.ply", "f_4.ply", "x.ply"]), None);
        assert_eq!(numbers(&[]), None);
    }
}
