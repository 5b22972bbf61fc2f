//! Output that appears whole or not at all.
//!
//! Linux lets a file exist without any name (`O_TMPFILE`) and gives it one when it is complete: whatever ends the program
//! before, nothing remains. Where the system or the file system has no such files, the output has a temporary name in the
//! same folder and is renamed.
//!
//! All unfinished files are listed, so that a program that is interrupted can remove them, and that none gets its name
//! after that. Data are not forced to the disk: the promise holds for errors and for the program's end, not for a loss
//! of power.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::error::Error;

static LIVE: Mutex<Vec<Live>> = Mutex::new(Vec::new());
static NEXT: AtomicU64 = AtomicU64::new(0);

/// An unfinished file.
#[derive(Debug)]
struct Live {
    id: u64,
    /// `None` for a file without a name.
    name: Option<PathBuf>,
}

/// The list of live files. It is valid after every step, so a panic elsewhere does not spoil it.
fn live() -> MutexGuard<'static, Vec<Live>> {
    LIVE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes all unfinished output of this process, in whatever thread it is being written. Work that goes on after this
/// fails when it finishes. Meant for the moment before the process ends: call it from an ordinary thread that was told
/// of the interruption, not from within a signal handler.
pub fn remove_temporaries() {
    for file in live().drain(..) {
        file.remove();
    }
}

impl Live {
    fn remove(self) {
        if let Some(name) = self.name {
            let _ = fs::remove_file(name);
        }
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

/// Writes a file that is whole or not there, such as a picture.
///
/// # Errors
/// [`Error::Sink`].
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    let output = Temporary::create(path)?;
    io::Write::write_all(&mut output.file(), bytes).map_err(|source| output.fail("write", source))?;
    output.finish()
}

/// A file that is not complete yet; dropping it removes it.
#[derive(Debug)]
pub(crate) struct Temporary {
    file: File,
    id: u64,
    folder: PathBuf,
    path: PathBuf,
    is_finished: bool,
}

impl Temporary {
    /// Creates the file that is to become the output `path`.
    pub(crate) fn create(path: &Path) -> Result<Temporary, Error> {
        let fail = |action, source| Error::Sink { path: path.into(), action, source };
        let path = &resolve(path).map_err(|source| fail("write there", source))?;
        if path.file_name().is_none() {
            return Err(fail("write there", io::Error::new(io::ErrorKind::InvalidInput, "the path names no file")));
        }
        let folder = match path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        if !folder.is_dir() {
            let what = format!("the folder {} does not exist: create it first", folder.display());
            return Err(fail("write there", io::Error::new(io::ErrorKind::NotFound, what)));
        }
        let id = NEXT.fetch_add(1, Ordering::Relaxed);
        // Listed and created under one lock, lest an interruption falls between the two.
        let mut live = live();
        let (file, name) = match unnamed::create(folder) {
            Some(file) => (file, None),
            None => {
                let name = hidden_name(folder, path, id);
                let file = OpenOptions::new().write(true).create_new(true).open(&name);
                (file.map_err(|source| fail("create a file in its folder", source))?, Some(name))
            }
        };
        live.push(Live { id, name });
        Ok(Temporary { file, id, folder: folder.into(), path: path.clone(), is_finished: false })
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
        let Some(at) = live.iter().position(|f| f.id == self.id) else {
            let interrupted = io::Error::new(io::ErrorKind::Interrupted, "the work was interrupted");
            return Err(self.fail("finish the file", interrupted));
        };
        if live[at].name.is_none() {
            match unnamed::link(&self.file, &self.path) {
                Ok(()) => {
                    live.swap_remove(at);
                    self.is_finished = true;
                    return Ok(());
                }
                // A link does not take the place of a file, a renamed one does.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
                    let name = hidden_name(&self.folder, &self.path, self.id);
                    unnamed::link(&self.file, &name).map_err(|source| self.fail("name the finished file", source))?;
                    live[at].name = Some(name);
                }
                Err(source) => return Err(self.fail("name the finished file", source)),
            }
        }
        if let Some(name) = &live[at].name {
            fs::rename(name, &self.path).map_err(|source| self.fail("rename the finished file", source))?;
        }
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
        if let Some(at) = live.iter().position(|f| f.id == self.id) {
            live.swap_remove(at).remove();
        }
    }
}

/// A name beside the output that no other process and no other file of this one takes.
fn hidden_name(folder: &Path, path: &Path, id: u64) -> PathBuf {
    let name = path.file_name().unwrap_or_default();
    let mut hidden = OsString::from(".");
    // A name near the longest possible leaves no room for more.
    hidden.push(if name.len() <= 200 { name } else { OsStr::new("pellicle") });
    hidden.push(format!(".{}-{id}.tmp", std::process::id()));
    folder.join(hidden)
}

/// Files without a name.
#[cfg(target_os = "linux")]
mod unnamed {
    use std::fs::File;
    use std::io;
    use std::os::fd::AsRawFd;
    use std::path::Path;

    use rustix::fs::{AtFlags, CWD, Mode, OFlags};

    /// A file in `folder`; `None` where there is no such thing, as on some network file systems.
    pub(super) fn create(folder: &Path) -> Option<File> {
        // Names are given by way of /proc, which a container may lack.
        if !Path::new("/proc/self/fd").is_dir() {
            return None;
        }
        let flags = OFlags::TMPFILE | OFlags::WRONLY | OFlags::CLOEXEC;
        // The mode that every new file gets; the process's mask applies.
        rustix::fs::openat(CWD, folder, flags, Mode::from_raw_mode(0o666)).ok().map(File::from)
    }

    /// Gives the file a name that is free.
    pub(super) fn link(file: &File, name: &Path) -> io::Result<()> {
        let there = format!("/proc/self/fd/{}", file.as_raw_fd());
        Ok(rustix::fs::linkat(CWD, there.as_str(), CWD, name, AtFlags::SYMLINK_FOLLOW)?)
    }
}

/// Other systems have none.
#[cfg(not(target_os = "linux"))]
mod unnamed {
    use std::fs::File;
    use std::io;
    use std::path::Path;

    pub(super) fn create(_folder: &Path) -> Option<File> {
        None
    }

    pub(super) fn link(_file: &File, _name: &Path) -> io::Result<()> {
        Err(io::ErrorKind::Unsupported.into())
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

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("pellicle-temporary-{name}-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder for the test");
        folder
    }

    #[test]
    fn the_output_takes_the_place_of_a_file_that_is_there() {
        let folder = folder("replace");
        let path = folder.join("a.ply");
        for text in ["first", "second"] {
            let output = Temporary::create(&path).expect("the folder takes files");
            io::Write::write_all(&mut output.file(), text.as_bytes()).expect("room for a word");
            output.finish().expect("it gets its name");
            assert_eq!(fs::read_to_string(&path).expect("it is there"), text);
            assert_eq!(fs::read_dir(&folder).expect("it is there").count(), 1);
        }
        fs::remove_dir_all(&folder).expect("the test's own");
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn an_unfinished_file_has_no_name_and_the_usual_rights() {
        let folder = folder("unnamed");
        let path = folder.join("a.ply");
        let output = Temporary::create(&path).expect("the folder takes files");
        if unnamed::create(&folder).is_some() {
            assert_eq!(fs::read_dir(&folder).expect("it is there").count(), 0);
        }
        output.finish().expect("it gets its name");
        let usual = folder.join("usual");
        fs::write(&usual, "").expect("room for nothing");
        let rights = |path: &Path| fs::metadata(path).expect("it is there").permissions();
        assert_eq!(rights(&path), rights(&usual));
        fs::remove_dir_all(&folder).expect("the test's own");
    }

    #[test]
    fn devices_and_folders_are_not_replaced() {
        assert!(check_writable(&std::env::temp_dir()).is_err());
        if cfg!(unix) {
            assert!(check_writable(Path::new("/dev/null")).is_err());
            assert!(!fs::metadata("/dev/null").expect("it is still there").is_file());
        }
    }
}
