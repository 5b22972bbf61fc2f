//! Why a run ends without its result, and with which exit code.

use std::fmt;
use std::io::ErrorKind;
use std::path::Path;

use pellicle::Error;

use crate::machine::LANES_VARIABLE;
use crate::values::show_bytes;

/// The ways to fail.
#[derive(Debug)]
pub enum Failure {
    /// The command line cannot mean anything, whatever the data: exit code 2.
    Usage(String),
    /// The work could not be done with this data on this machine: exit code 1.
    Work(String),
    /// The work needs more memory than it may take: exit code 1, unless it is tried again with more.
    Memory(String),
    /// The user interrupted: exit code 130.
    Interrupted,
}

impl Failure {
    /// The exit code of the process.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Work(_) | Self::Memory(_) => 1,
            Self::Usage(_) => 2,
            // 128 + SIGINT, as shells report it.
            Self::Interrupted => 130,
        }
    }

    /// Whether the user ended the run.
    pub fn is_interruption(&self) -> bool {
        matches!(self, Self::Interrupted)
    }

    /// Work that failed on `file`, with what is wrong and how to fix it.
    pub fn file(file: &Path, what: impl fmt::Display) -> Self {
        Self::Work(format!("{}: {what}", file.display()))
    }

    /// An error of the core while it worked on `file`, with the advice in terms of this command's options.
    pub fn core(file: &Path, error: Error) -> Self {
        match error {
            Error::Cancelled => Self::Interrupted,
            Error::NotFinite { index, position: [x, y, z] } => Self::file(
                file,
                format_args!(
                    "particle {index} has the position ({x}, {y}, {z}), which is not finite (--drop-invalid leaves such particles out)"
                ),
            ),
            Error::Parameter { name: "lanes", .. } => {
                Self::Work(format!("{LANES_VARIABLE}: this machine has no such vector unit (use auto)"))
            }
            Error::Memory { what, needed, available } => Self::Memory(format!(
                "{}: {what} needs {} of memory, {} are left of the limit (raise --max-memory by at least {}, or use a larger cell with -c)",
                file.display(),
                show_bytes(needed),
                show_bytes(available),
                show_bytes(needed.saturating_sub(available)),
            )),
            error @ Error::OutsideLattice { .. } => {
                Self::file(file, format_args!("{error} (the cell's edge is -r times -c)"))
            }
            other => Self::file(file, other),
        }
    }
}

impl From<pellicle_io::Error> for Failure {
    /// Messages of `pellicle-io` name the file and what to do.
    fn from(error: pellicle_io::Error) -> Self {
        let hint = match &error {
            pellicle_io::Error::Open { path, source } if source.kind() == ErrorKind::NotFound => similar(path),
            _ => None,
        };
        Self::Work(match hint {
            Some(name) => format!("{error} (is it {name}?)"),
            None => error.to_string(),
        })
    }
}

/// A file in the same folder whose name is nearly the same as that of one that is not there.
fn similar(path: &Path) -> Option<String> {
    /// Of 1: one letter in ten may be wrong.
    const ALIKE: f64 = 0.9;
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let wanted = path.file_name()?.to_str()?;
    let names = std::fs::read_dir(folder).ok()?.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let judged = names.map(|name| (strsim::normalized_damerau_levenshtein(wanted, &name), name));
    let best = judged.filter(|(alike, _)| *alike >= ALIKE).max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)))?;
    Some(path.with_file_name(best.1).display().to_string())
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Usage(message) | Self::Work(message) | Self::Memory(message) => f.write_str(message),
            Self::Interrupted => f.write_str("interrupted: what was not complete is not there"),
        }
    }
}
