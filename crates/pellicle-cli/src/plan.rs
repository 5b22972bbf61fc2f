//! Which frames there are to make, and under which names.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use crate::console::Console;
use crate::failure::Failure;
use crate::resolve::{Files, MeshJob};
use crate::sequence::Pattern;

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
    /// Names of the outputs.
    pub pattern: Option<Pattern>,
    /// The list to write in the end.
    pub pvd: Option<PathBuf>,
}

impl Plan {
    /// Finds the frames.
    pub fn new(files: &Files, _console: &Console) -> Result<Self, Failure> {
        let input = files.inputs[0].clone();
        let output = files.output.clone().unwrap_or_else(|| default_output(&input, files.extension));
        let frame = Frame {
            number: None,
            time: None,
            input,
            step: None,
            output,
            png: files.png.clone(),
            spray: files.spray.clone(),
        };
        if same_file(&frame.input, &frame.output) {
            return Err(Failure::Usage(format!(
                "{}: the output would overwrite its input (choose another file with -o)",
                frame.input.display()
            )));
        }
        Ok(Plan { single: Some(frame), frames: Vec::new(), whole: Vec::new(), pattern: None, pvd: None })
    }
}

/// Whether the frame's output is there and not older than its input.
pub fn is_done(frame: &Frame) -> bool {
    frame.output.exists()
}

/// The frames that are there now.
pub fn look(_job: &MeshJob) -> Result<Vec<Frame>, Failure> {
    Ok(Vec::new())
}

fn default_output(input: &Path, extension: &str) -> PathBuf {
    let is_compressed = input.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("gz"));
    let output = if is_compressed { input.with_extension("") } else { input.to_owned() }.with_extension(extension);
    if output != input {
        return output;
    }
    let mut name = OsString::from(input.file_stem().unwrap_or_default());
    name.push(format!("_surface.{extension}"));
    input.with_file_name(name)
}

/// Whether both names lead to one file, also through links and `..`.
fn same_file(a: &Path, b: &Path) -> bool {
    a == b || matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}
