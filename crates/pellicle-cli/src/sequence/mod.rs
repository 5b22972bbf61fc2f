//! Several frames in one run: which files they are, and where the result of each goes.
//!
//! ```text
//! names as typed ─► pattern, folder or list ─► frames ─ --frames ─► outputs ─► checked ─► Sequence
//! ```
//!
//! Everything is settled before the first frame is read: missing frames, results that would meet, inputs in danger. An
//! existing file is always taken literally, whatever signs its name has.

pub mod gaps;
pub mod output;
pub mod pattern;
pub mod range;
#[cfg(test)]
pub mod scratch;
mod series;
pub mod shard;

use std::path::{Path, PathBuf};

use crate::failure::Failure;
use gaps::Gap;
use output::Outputs;
use pattern::Pattern;
use range::FrameRange;

/// One frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Its number, where names or a pattern say it.
    pub number: Option<i64>,
    /// Its time in the simulation's units, where a list says it.
    pub time: Option<f64>,
    /// The particles.
    pub input: PathBuf,
    /// The result.
    pub output: PathBuf,
}

/// The frames to work on.
#[derive(Debug, Clone, PartialEq)]
pub struct Sequence {
    /// In order.
    pub frames: Vec<Frame>,
    /// Frames that seem to be missing, where nobody said which there are.
    pub gaps: Vec<Gap>,
}

/// What to do about frames of `--frames` that have no file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Missing {
    /// They are an error.
    #[default]
    Refuse,
    /// They are left out.
    Skip,
}

/// What was asked for.
#[derive(Debug, Clone, Copy)]
pub struct Request<'a> {
    /// `--frames`: these alone.
    pub frames: Option<&'a FrameRange>,
    /// When some of them have no file.
    pub missing: Missing,
    /// `-o`.
    pub output: Option<&'a Path>,
    /// The extension of results whose name is not given: `ply`.
    pub extension: &'a str,
}

/// An input with what is known of it.
struct Input {
    number: Option<i64>,
    time: Option<f64>,
    path: PathBuf,
}

impl Sequence {
    /// The frames that these names mean: one file, a pattern, a folder, or several files in their order. Whether a single
    /// file is there is left to its reader.
    ///
    /// # Errors
    /// [`Failure::Usage`] for names that cannot mean anything together, [`Failure::Work`] for frames that are not there or
    /// not clear.
    pub fn resolve(inputs: &[PathBuf], request: &Request<'_>) -> Result<Self, Failure> {
        match inputs {
            [] => Err(Failure::Usage("no input is given".into())),
            [one] => Self::of_one(one, request),
            several => {
                let numbers = series::numbers(several);
                let number = |i: usize| numbers.as_ref().and_then(|n| n.get(i).copied());
                let inputs = several.iter().enumerate().map(|(i, path)| {
                    let is_pattern = !path.exists() && Pattern::parse(path)?.is_some();
                    if is_pattern || path.is_dir() {
                        let what = "a pattern or folder stands alone: give one, or list files";
                        return Err(Failure::Usage(format!("{}: {what}", path.display())));
                    }
                    Ok(Input { number: number(i), time: None, path: path.clone() })
                });
                Self::finish(inputs.collect::<Result<_, _>>()?, Vec::new(), request)
            }
        }
    }

    /// The frames of a list of files with their times, such as ParaView's.
    ///
    /// # Errors
    /// As [`resolve`](Self::resolve).
    pub fn from_list(list: Vec<(f64, PathBuf)>, request: &Request<'_>) -> Result<Self, Failure> {
        if list.is_empty() {
            return Err(Failure::Work("the list has no files".into()));
        }
        let paths: Vec<PathBuf> = list.iter().map(|(_, path)| path.clone()).collect();
        let numbers = series::numbers(&paths);
        let number = |i: usize| numbers.as_ref().and_then(|n| n.get(i).copied());
        let inputs = list.into_iter().enumerate();
        let inputs = inputs.map(|(i, (time, path))| Input { number: number(i), time: Some(time), path }).collect();
        Self::finish(inputs, Vec::new(), request)
    }

    fn of_one(name: &Path, request: &Request<'_>) -> Result<Self, Failure> {
        let numbered = |(number, path)| Input { number: Some(number), time: None, path };
        if name.is_dir() {
            let found = series::of_folder(name)?;
            let numbers: Vec<i64> = found.iter().filter_map(|(number, _)| *number).collect();
            let inputs = found.into_iter().map(|(number, path)| Input { number, time: None, path });
            return Self::finish(inputs.collect(), gaps::gaps(&numbers), request);
        }
        let pattern = if name.exists() { None } else { Pattern::parse(name)? };
        let Some(pattern) = pattern else {
            if !name.exists() && name.to_string_lossy().contains('*') {
                let what =
                    "no such file: a * is for the shell; write the frame number as ####, or {} if it is not padded";
                return Err(Failure::file(name, what));
            }
            return Self::finish(vec![Input { number: None, time: None, path: name.to_owned() }], Vec::new(), request);
        };
        let found = pattern.find()?;
        if found.is_empty() {
            let example = pattern.name(request.frames.and_then(|range| range.numbers().first()).copied().unwrap_or(1));
            let what = format!("no file has a name of this form, such as {}", example.display());
            return Err(Failure::file(name, what));
        }
        let numbers: Vec<i64> = found.iter().map(|(number, _)| *number).collect();
        Self::finish(found.into_iter().map(numbered).collect(), gaps::gaps(&numbers), request)
    }

    /// Chooses frames, names outputs, and checks them.
    fn finish(mut inputs: Vec<Input>, gaps: Vec<Gap>, request: &Request<'_>) -> Result<Self, Failure> {
        let gaps = match request.frames {
            Some(range) => {
                choose(&mut inputs, range, request.missing)?;
                Vec::new()
            }
            None => gaps,
        };
        if inputs.is_empty() {
            return Err(Failure::Work("no frame is left to work on".into()));
        }
        let outputs = Outputs::new(request.output)?;
        let frames: Vec<Frame> = inputs
            .into_iter()
            .enumerate()
            .map(|(position, Input { number, time, path })| {
                let output = outputs.name(&path, number, position, request.extension);
                Frame { number, time, input: path, output }
            })
            .collect();
        let pairs: Vec<_> = frames.iter().map(|frame| (frame.input.as_path(), frame.output.as_path())).collect();
        output::check(&outputs, &pairs)?;
        Ok(Self { frames, gaps })
    }
}

/// Leaves the frames of the range.
fn choose(inputs: &mut Vec<Input>, range: &FrameRange, missing: Missing) -> Result<(), Failure> {
    let Some(there) = inputs.iter().map(|input| input.number).collect::<Option<Vec<i64>>>() else {
        let first = inputs.first().map(|input| input.path.display().to_string()).unwrap_or_default();
        return Err(Failure::Usage(format!(
            "--frames {range}: the frames have no numbers to go by, the first is {first} (use a pattern such as frame_####.vtk)"
        )));
    };
    let mut sorted = there;
    sorted.sort_unstable();
    let absent: Vec<i64> =
        range.numbers().iter().copied().filter(|number| sorted.binary_search(number).is_err()).collect();
    let has_none = absent.len() == range.numbers().len();
    if has_none || (missing == Missing::Refuse && !absent.is_empty()) {
        let what = gaps::gaps_text(&gaps::runs(&absent));
        return Err(Failure::Work(format!("--frames {range}: {what}; there are {}", gaps::span_text(&sorted))));
    }
    inputs.retain(|input| input.number.is_some_and(|number| range.contains(number)));
    Ok(())
}

#[cfg(test)]
mod tests;
