//! Output that appears whole or not at all: a temporary name in the same folder, then a rename.
//!
//! All temporary files that live are listed, so that a program that is interrupted can remove them. Data are not
//! forced to the disk: the promise holds for errors and interruptions of the program, not for a loss of power.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::error::Error;

static LIVE: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());
static NEXT: AtomicU64 = AtomicU64::new(0);

/// The list of live files. It is valid after every step, so a panic elsewhere does not spoil it.
fn live() -> MutexGuard<'static, Vec<PathBuf>> {
    LIVE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes all unfinished output of this process, in whatever thread it is being written. Work that goes on after this
/// fails when it finishes. Meant for the moment before the process ends: call it from an ordinary thread that was told
/// of the interruption, not from within a signal handler.
pub fn remove_temporaries() {
    for path in live().drain(..) {
        let _ = fs::remove_file(path);
    }
}

/// Checks that a file of this name could be written now: its folder exists and takes files, and the name is not that
/// of a folder or device. To be called before work starts whose result goes there.
///
/// # Errors
/// [`Error::Sink`].
pub fn check_writable(path: &Path) -> Result<(), Error> {
    Temporary::create(path).map(drop)
}

/// A file under a temporary name; dropping it removes it.
#[derive(Debug)]
pub(crate) struct Temporary {
    file: File,
    temporary: PathBuf,
    path: PathBuf,
    is_finished: bool,
}

impl Temporary {
    /// Creates the temporary file for the output `path`.
    pub(crate) fn create(path: &Path) -> Result<Temporary, Error> {
        let fail = |action, source| Error::Sink { path: path.into(), action, source };
        let path = &resolve(path).map_err(|source| fail("write there", source))?;
        let Some(name) = path.file_name() else {
            return Err(fail("write there", io::Error::new(io::ErrorKind::InvalidInput, "the path names no file")));
        };
        let folder = match path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        if !folder.is_dir() {
            let what = format!("the folder {} does not exist: create it first", folder.display());
            return Err(fail("write there", io::Error::new(io::ErrorKind::NotFound, what)));
        }
        let mut hidden = OsString::from(".");
        // A name near the longest possible leaves no room for more.
        hidden.push(if name.len() <= 200 { name } else { OsStr::new("pellicle") });
        hidden.push(format!(".{}-{}.tmp", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed)));
        let temporary = folder.join(hidden);
        // Listed and created under one lock, lest an interruption falls between the two.
        let mut live = live();
        let file = OpenOptions::new().write(true).create_new(true).open(&temporary);
        let file = file.map_err(|source| fail("create a file in its folder", source))?;
        live.push(temporary.clone());
        Ok(Temporary { file, temporary, path: path.clone(), is_finished: false })
    }

    pub(crate) fn file(&self) -> &File {
        &self.file
    }

    /// The output's final name.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// An error about the output.
    pub(crate) fn fail(&self, action: &'static str, source: io::Error) -> Error {
        Error::Sink { path: self.path.clone(), action, source }
    }

    /// Gives the file its final name, in place of one that is there.
    pub(crate) fn finish(mut self) -> Result<(), Error> {
        let mut live = live();
        let Some(at) = live.iter().position(|p| *p == self.temporary) else {
            let interrupted = io::Error::new(io::ErrorKind::Interrupted, "the work was interrupted");
            return Err(self.fail("finish the file", interrupted));
        };
        fs::rename(&self.temporary, &self.path).map_err(|source| Error::Sink {
            path: self.path.clone(),
            action: "rename the finished file",
            source,
        })?;
        live.swap_remove(at);
        self.is_finished = true;
        Ok(())
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if self.is_finished {
            return;
        }
        let mut live = live();
        if let Some(at) = live.iter().position(|p| *p == self.temporary) {
            live.swap_remove(at);
            let _ = fs::remove_file(&self.temporary);
        }
    }
}

/// Follows links, so that the file that a link points to is replaced and not the link. Folders and devices are refused:
/// a rename would put a file in the place of `/dev/null`.
fn resolve(path: &Path) -> io::Result<PathBuf> {
    let path = match fs::symlink_metadata(path) {
        Ok(metadata) if metadata.is_symlink() => fs::canonicalize(path)?,
        _ => path.to_owned(),
    };
    match fs::metadata(&path) {
        Ok(metadata) if metadata.is_dir() => Err(io::Error::new(io::ErrorKind::IsADirectory, "this is a folder")),
        Ok(metadata) if !metadata.is_file() => {
            Err(io::Error::new(io::ErrorKind::InvalidInput, "this is a device or pipe, not a regular file"))
        }
        _ => Ok(path),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn devices_and_folders_are_not_replaced() {
        assert!(check_writable(&std::env::temp_dir()).is_err());
        if cfg!(unix) {
            assert!(check_writable(Path::new("/dev/null")).is_err());
            assert!(!fs::metadata("/dev/null").expect("it is still there").is_file());
        }
    }
}
