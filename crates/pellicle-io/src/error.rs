//! Why a file could not be read or written, by cause: opening, damage, a feature that is not supported, a limit, the
//! caller's data, the output.
//!
//! Every message names the file, the place in it where that is known, and what to do about it. It is one line of no more than
//! some hundred characters, all of them printable, whatever a damaged file has for names.

use std::borrow::Cow;
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
    #[error("{}: {place}{}", path.display(), shortened(what))]
    Format {
        /// The file.
        path: PathBuf,
        /// Where in it.
        place: Place,
        /// What was found and what was expected.
        what: String,
    },
    /// The file may be sound, but it is of a kind that is not read or written here.
    #[error("{}: {}", path.display(), shortened(what))]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// What it is, and what to use instead.
        what: String,
    },
    /// An attribute was asked for by name that the file does not have.
    #[error("{}: no attribute is named '{name}'; it has: {}", path.display(), shortened(&list(available)))]
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
    #[error("{}: {} has {found} values, {expected} were expected", path.display(), shortened(what))]
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

/// Characters of a message that are shown of its beginning and of its end. Names are in the middle.
const HEAD: usize = 400;
const TAIL: usize = 200;

/// Text as it can be shown in a line of a terminal: characters that would move its cursor or change its colours are
/// escaped.
pub fn printable(text: &str) -> Cow<'_, str> {
    if !text.contains(char::is_control) {
        return Cow::Borrowed(text);
    }
    let escaped = |c: char| if c.is_control() { c.escape_default().to_string() } else { c.to_string() };
    Cow::Owned(text.chars().map(escaped).collect())
}

/// Printable, and without the middle if it is long.
fn shortened(text: &str) -> String {
    let count = text.chars().count();
    if count <= HEAD + TAIL {
        return printable(text).into_owned();
    }
    let place = |n: usize| text.char_indices().nth(n).map_or(text.len(), |(at, _)| at);
    let (head, tail) = (&text[..place(HEAD)], &text[place(count - TAIL)..]);
    format!("{} […] {}", printable(head), printable(tail))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_out_of_damaged_files_cannot_flood_or_steer_a_terminal() {
        let what = format!("the attribute '{}' has 5000 components: the limit is 4096", "\u{1b}[2Jä\n".repeat(10_000));
        let error = Error::Format { path: "a.bgeo".into(), place: Place::Byte(7), what };
        let message = error.to_string();
        assert!(message.len() < 2000, "{}", message.len());
        assert!(!message.contains(char::is_control) && message.contains("\\u{1b}[2Jä\\n"), "{message}");
        assert!(message.starts_with("a.bgeo: at byte 7: the attribute"), "{message}");
        assert!(message.ends_with("the limit is 4096"), "{message}");
        assert_eq!(printable("größe"), "größe");
    }
}
