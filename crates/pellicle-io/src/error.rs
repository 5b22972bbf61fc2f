//! Why a file could not be read or written, by cause: opening, damage, a feature that is not supported, a limit, the
//! caller's data, the output.
//!
//! Every message names the file, the place in it where that is known, and what to do about it.

use std::fmt;
use std::io;
use std::path::PathBuf;

/// Where in a file something was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Place {
    /// Offset in bytes from the start of the file; of the inflated data where the file is compressed.
    Byte(u64),
    /// Line of a text file, counted from 1.
    Line(u64),
    /// The file as a whole.
    Whole,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::Byte(byte) => write!(f, "at byte {byte}: "),
            Place::Line(line) => write!(f, "in line {line}: "),
            Place::Whole => Ok(()),
        }
    }
}

/// What went wrong with a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The file could not be opened.
    #[error("{}: cannot open: {source}", path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// The system failed while reading.
    #[error("{}: cannot read: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// The content is damaged, cut short, or contradicts itself.
    #[error("{}: {place}{what}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// Where in it.
        place: Place,
        /// What was found and what was expected.
        what: String,
    },
    /// The file may be sound, but it is of a kind that is not read or written here.
    #[error("{}: {what}", path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// What it is, and what to use instead.
        what: String,
    },
    /// An attribute was asked for by name that the file does not have.
    #[error("{}: no attribute is named '{name}'; it has: {}", path.display(), list(available))]
    NoAttribute {
        /// The file.
        path: PathBuf,
        /// The name asked for.
        name: String,
        /// The names in the file.
        available: Vec<String>,
    },
    /// A count exceeds what the format or this program can hold.
    #[error("{}: {what}: {needed} are needed, {available} are possible", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// What was counted.
        what: &'static str,
        /// The count.
        needed: u64,
        /// The largest possible.
        available: u64,
    },
    /// What the caller wants written does not fit together, such as normals for only some of the vertices.
    #[error("{}: {what} has {found} values, {expected} were expected", path.display())]
    Length {
        /// The file.
        path: PathBuf,
        /// What was measured.
        what: String,
        /// Values found.
        found: u64,
        /// Values expected.
        expected: u64,
    },
    /// The output could not be created, written or given its name. Nothing is left of it.
    #[error("{}: cannot {action}: {}", path.display(), explain(source))]
    Sink {
        /// The output file.
        path: PathBuf,
        /// What was tried.
        action: &'static str,
        /// The system's reason.
        source: io::Error,
    },
}

fn list(names: &[String]) -> String {
    if names.is_empty() { "none".into() } else { names.join(", ") }
}

fn explain(source: &io::Error) -> String {
    match source.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            format!("the disk is full ({source}): free some space or choose another folder")
        }
        _ => source.to_string(),
    }
}
