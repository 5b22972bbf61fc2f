//! Which frames there are to make, and under which names: what `sequence` finds, together with what else a frame writes,
//! lists of files (`.pvd`) in and out, and the difference between one file and a sequence.

use std::path::{Path, PathBuf};

use pellicle_io::{PvdEntry, read_pvd};

use crate::console::Console;
use crate::failure::Failure;
use crate::resolve::Files;
use crate::sequence::gaps::gaps_text;
use crate::sequence::output::{self, Outputs};
use crate::sequence::pattern::Pattern;
use crate::sequence::{self, Missing, Request, Sequence};

/// Where a frame comes from and where it goes.
#[derive(Debug, Clone)]
pub struct Frame {
    /// Number in the names of a sequence.
    pub number: Option<i64>,
    /// Time, where a list of files tells it.
    pub time: Option<f64>,
    /// The file to read.
    pub input: PathBuf,
    /// Which time step of the file, if a list tells it.
    pub step: Option<usize>,
    /// The file to write.
    pub output: PathBuf,
    /// The picture besides.
    pub png: Option<PathBuf>,
    /// The file of isolated particles besides.
    pub spray: Option<PathBuf>,
}

/// What there is to do.
#[derive(Debug)]
pub struct Plan {
    /// The only frame, if a plain file was named and not a sequence.
    pub single: Option<Frame>,
    /// The frames to make here, in order.
    pub frames: Vec<Frame>,
    /// The frames of the whole sequence, whoever makes them.
    pub whole: Vec<Frame>,
    /// Names of the outputs, if they follow a pattern.
    pub pattern: Option<Pattern>,
    /// The list to write in the end.
    pub pvd: Option<PathBuf>,
    names: Names,
}

/// Where outputs go.
#[derive(Debug, Clone)]
struct Names {
    output: Outputs,
    png: Option<Outputs>,
    spray: Option<Outputs>,
}

/// What to do where no frame is there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Absent {
    /// It is an error.
    Refuse,
    /// They may come later.
    Await,
}

impl Plan {
    /// Finds the frames, and tells of gaps.
    ///
    /// # Errors
    /// Names that cannot mean anything, frames that are not there, outputs that would meet each other or an input.
    pub fn new(files: &Files, absent: Absent, console: &Console) -> Result<Self, Failure> {
        let (plan, gaps) = Self::find(files, absent)?;
        if let Some(gaps) = gaps {
            console.warn(gaps);
        }
        Ok(plan)
    }

    /// The same without a word; the gaps in words.
    pub fn find(files: &Files, absent: Absent) -> Result<(Self, Option<String>), Failure> {
        let (output, pvd) = match &files.output {
            Some(list) if has_extension(list, "pvd") => (Some(listed(list)), Some(list.clone())),
            output => (output.clone(), None),
        };
        let names = Names {
            output: Outputs::new(output.as_deref())?,
            png: files.png.as_deref().map(|png| Outputs::new(Some(png))).transpose()?,
            spray: files.spray.as_deref().map(|spray| Outputs::new(Some(spray))).transpose()?,
        };
        let request = Request {
            frames: files.frames.as_ref(),
            missing: if absent == Absent::Await { Missing::Skip } else { Missing::Refuse },
            output: output.as_deref(),
            extension: files.extension,
        };
        let (frames, gaps) = match inputs(files, &request) {
            Ok(found) => found,
            Err(Failure::Work(_)) if absent == Absent::Await => (Vec::new(), None),
            Err(failure) => return Err(failure),
        };
        let whole = names.complete(frames)?;
        let pattern = match &names.output {
            Outputs::Pattern(pattern) => Some(pattern.clone()),
            _ => None,
        };
        let is_single = pvd.is_none() && absent == Absent::Refuse && is_plain_file(&files.inputs);
        let plan = match <[Frame; 1]>::try_from(whole) {
            Ok([frame]) if is_single => {
                Self { single: Some(frame), frames: Vec::new(), whole: Vec::new(), pattern, pvd, names }
            }
            whole => {
                let whole = whole.map_or_else(|many| many, Vec::from);
                let frames = match files.shard {
                    Some(shard) => shard.take(whole.clone()),
                    None => whole.clone(),
                };
                Self { single: None, frames, whole, pattern, pvd, names }
            }
        };
        Ok((plan, gaps))
    }

    /// A plan of frames that share one input, each with an output of the pattern.
    pub fn around(self, frames: Vec<Frame>, pattern: Pattern) -> Self {
        let names = Names { output: Outputs::Pattern(pattern.clone()), ..self.names };
        let whole = self.single.into_iter().collect();
        Self { single: None, frames, whole, pattern: Some(pattern), pvd: None, names }
    }

    /// Makes the folders that the outputs of a frame go to, where they are missing and may be made.
    ///
    /// # Errors
    /// What the system says, by folder.
    pub fn prepare(&self, frame: &Frame) -> Result<(), Failure> {
        self.names.output.prepare(&frame.output)?;
        for (names, path) in [(&self.names.png, &frame.png), (&self.names.spray, &frame.spray)] {
            if let (Some(names), Some(path)) = (names, path) {
                names.prepare(path)?;
            }
        }
        Ok(())
    }
}

impl Names {
    /// Adds what else each frame writes.
    fn complete(&self, mut frames: Vec<Frame>) -> Result<Vec<Frame>, Failure> {
        for (position, frame) in frames.iter_mut().enumerate() {
            let name = |names: &Option<Outputs>, extension| {
                names.as_ref().map(|names| names.name(&frame.input, frame.number, position, extension))
            };
            (frame.png, frame.spray) = (name(&self.png, "png"), name(&self.spray, "ply"));
        }
        let pairs = |path: fn(&Frame) -> Option<&PathBuf>| -> Vec<(&Path, &Path)> {
            frames.iter().filter_map(|frame| Some((frame.input.as_path(), path(frame)?.as_path()))).collect()
        };
        if let Some(names) = &self.png {
            output::check(names, &pairs(|frame| frame.png.as_ref()))?;
        }
        if let Some(names) = &self.spray {
            output::check(names, &pairs(|frame| frame.spray.as_ref()))?;
        }
        let all = |frame: &Frame| [Some(frame.output.clone()), frame.png.clone(), frame.spray.clone()];
        for frame in &frames {
            let [output, png, spray] = all(frame);
            if output == png || output == spray || (png.is_some() && png == spray) {
                let what = "two outputs of one frame have this name (choose another with -o, --png or --spray)";
                return Err(Failure::Usage(format!("{}: {what}", frame.output.display())));
            }
        }
        Ok(frames)
    }
}

/// Whether the frame's output is there and not older than its input.
pub fn is_done(frame: &Frame) -> bool {
    output::is_done(&frame.input, &frame.output)
}

fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension))
}

/// The files that a list `a.pvd` is of: `a_####.vtp` beside it.
fn listed(list: &Path) -> PathBuf {
    let mut name = list.file_stem().unwrap_or_default().to_owned();
    name.push("_####.vtp");
    list.with_file_name(name)
}

fn is_plain_file(inputs: &[PathBuf]) -> bool {
    let [input] = inputs else { return false };
    !has_extension(input, "pvd") && !input.is_dir() && (input.exists() || matches!(Pattern::parse(input), Ok(None)))
}

/// The frames as the names say; missing ones in words.
fn inputs(files: &Files, request: &Request<'_>) -> Result<(Vec<Frame>, Option<String>), Failure> {
    if let [list] = files.inputs.as_slice()
        && has_extension(list, "pvd")
        && list.is_file()
    {
        return Ok((of_list(list, read_pvd(list)?, request)?, None));
    }
    let found = Sequence::resolve(&files.inputs, request)?;
    let gaps = (!found.gaps.is_empty())
        .then(|| format!("{}: {}; what is there is taken", files.inputs[0].display(), gaps_text(&found.gaps)));
    Ok((found.frames.into_iter().map(Frame::from).collect(), gaps))
}

/// The frames of a list: one for each time. Where several files make a frame, the list itself is read at that time step.
fn of_list(list: &Path, entries: Vec<PvdEntry>, request: &Request<'_>) -> Result<Vec<Frame>, Failure> {
    let times: Vec<&[PvdEntry]> = entries.chunk_by(|a, b| a.time == b.time).collect();
    let first = times.iter().filter_map(|parts| parts.first()).map(|part| (part.time, part.file.clone())).collect();
    let found = Sequence::from_list(first, request)?;
    let mut frames: Vec<Frame> = found.frames.into_iter().map(Frame::from).collect();
    for frame in &mut frames {
        let step = times.iter().position(|parts| parts.first().is_some_and(|part| part.file == frame.input));
        if let Some(step) = step.filter(|&step| times[step].len() > 1) {
            (frame.input, frame.step) = (list.to_owned(), Some(step));
        }
    }
    Ok(frames)
}

impl From<sequence::Frame> for Frame {
    fn from(frame: sequence::Frame) -> Self {
        let sequence::Frame { number, time, input, output } = frame;
        Self { number, time, input, step: None, output, png: None, spray: None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sequence::scratch::Folder;

    fn files(folder: &Folder, input: &str, output: Option<&str>) -> Files {
        Files {
            inputs: vec![folder.path().join(input)],
            output: output.map(|name| folder.path().join(name)),
            extension: "ply",
            png: None,
            spray: None,
            frames: None,
            shard: None,
        }
    }

    #[test]
    fn one_plain_file_is_no_sequence_and_everything_else_is() {
        let folder = Folder::with(&["f_1.xyz", "f_2.xyz", "f_3.xyz"]);
        let find = |input: &str, output| Plan::find(&files(&folder, input, output), Absent::Refuse);
        let plan = find("f_1.xyz", None).unwrap().0;
        assert_eq!(plan.single.map(|frame| frame.output), Some(folder.path().join("f_1.ply")));
        let plan = find("f_{}.xyz", Some("s_##.obj")).unwrap().0;
        assert!(plan.single.is_none() && plan.frames.len() == 3);
        assert_eq!(plan.frames[2].output, folder.path().join("s_03.obj"));
        let plan = find("f_{}.xyz", Some("all.pvd")).unwrap().0;
        assert_eq!(plan.frames[0].output, folder.path().join("all_0001.vtp"));
        assert_eq!(plan.pvd, Some(folder.path().join("all.pvd")));
        assert!(find("g_{}.xyz", None).is_err());
        let plan = Plan::find(&files(&folder, "g_{}.xyz", None), Absent::Await).unwrap().0;
        assert!(plan.single.is_none() && plan.frames.is_empty());
    }

    #[test]
    fn parts_know_the_whole_and_keep_its_names() {
        let folder = Folder::with(&["f_1.vtk", "f_2.vtk", "f_3.vtk"]);
        let mut files = files(&folder, "f_{}.vtk", Some("w_{}.ply"));
        files.shard = Some("2/2".parse().unwrap());
        let plan = Plan::find(&files, Absent::Refuse).unwrap().0;
        assert_eq!((plan.frames.len(), plan.whole.len(), plan.frames[0].number), (1, 3, Some(2)));
        assert_eq!(plan.frames[0].output, folder.path().join("w_2.ply"));
        files.shard = Some("4/5".parse().unwrap());
        assert!(Plan::find(&files, Absent::Refuse).unwrap().0.frames.is_empty(), "more parts than frames");
    }

    #[test]
    fn further_outputs_follow_their_own_patterns_and_never_meet() {
        let folder = Folder::with(&["f_1.xyz", "f_2.xyz"]);
        let mut files = files(&folder, "f_{}.xyz", None);
        files.png = Some(folder.path().join("p_####.png"));
        files.spray = Some(folder.path().join("s_{}.ply"));
        let plan = Plan::find(&files, Absent::Refuse).unwrap().0;
        assert_eq!(plan.frames[1].png, Some(folder.path().join("p_0002.png")));
        assert_eq!(plan.frames[1].spray, Some(folder.path().join("s_2.ply")));
        files.png = Some(folder.path().join("one.png"));
        assert!(Plan::find(&files, Absent::Refuse).is_err(), "two frames, one picture");
        files.png = None;
        files.spray = Some(folder.path().join("f_{}.ply"));
        assert!(Plan::find(&files, Absent::Refuse).is_err(), "spray in the place of the mesh");
    }
}
