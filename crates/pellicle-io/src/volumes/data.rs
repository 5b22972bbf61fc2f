//! Where the samples of formats with a header of text or of NIfTI lie: behind it, in a file beside it, or in several; plain or
//! compressed.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use flate2::read::{MultiGzDecoder, ZlibDecoder};

use super::header::VolumeOptions;
use crate::error::{Error, Place};
use crate::source::{self, Source};

/// Files that the data may be in, at most.
pub(super) const MAX_FILES: usize = 1 << 16;

/// How data are compressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Packing {
    Plain,
    Gzip,
    Zlib,
}

/// The data of a file from `skip` bytes on.
pub(super) fn open(
    path: &Path,
    skip: u64,
    packing: Packing,
    options: &VolumeOptions,
) -> Result<Source<'static>, Error> {
    if packing == Packing::Plain {
        let mut source = Source::open(path)?;
        source.skip(skip, "what stands before the samples")?;
        return Ok(source);
    }
    let (mut file, len) = source::open(path)?;
    file.seek(SeekFrom::Start(skip)).map_err(|source| Error::Read { path: path.into(), source })?;
    let limit = options.inflated_limit(len.saturating_sub(skip));
    Ok(match packing {
        Packing::Zlib => Source::inflating(path, ZlibDecoder::new(file), limit),
        // Some programs write a member for each block.
        _ => Source::inflating(path, MultiGzDecoder::new(file), limit),
    })
}

/// The data of a file that a header names; the error tells whose data are not there.
pub(super) fn open_beside(
    header: &Path,
    name: &str,
    skip: u64,
    packing: Packing,
    options: &VolumeOptions,
) -> Result<Source<'static>, Error> {
    open(&beside(header, name), skip, packing, options).map_err(|error| missing(header, error))
}

/// In the words of the header that names a file which cannot be opened.
pub(super) fn missing(header: &Path, error: Error) -> Error {
    match error {
        Error::Open { path, source } if path != header => {
            let what = format!("its data, '{}', cannot be opened: {source}", path.display());
            Error::Format { path: header.into(), place: Place::Whole, what }
        }
        other => other,
    }
}

/// A file that a header names: beside it, unless the path is absolute.
pub(super) fn beside(header: &Path, name: &str) -> PathBuf {
    header.parent().unwrap_or(Path::new("")).join(name)
}

/// The data of several files, one behind the other, each from `skip` bytes on; all have the same size.
pub(super) fn joined(header: &Path, names: &[String], skip: u64) -> Result<Source<'static>, Error> {
    let fail = |what: String| Error::Format { path: header.into(), place: Place::Whole, what };
    if names.is_empty() || names.len() > MAX_FILES {
        return Err(fail(format!("{} files of data are named: 1 to {MAX_FILES} are read", names.len())));
    }
    let files: Vec<PathBuf> = names.iter().map(|name| beside(header, name)).collect();
    let mut total = 0u64;
    for (i, file) in files.iter().enumerate() {
        let (_, len) = source::open(file).map_err(|error| missing(header, error))?;
        let Some(len) = len.checked_sub(skip) else {
            return Err(fail(format!("'{}' has {len} bytes, fewer than are to be skipped", file.display())));
        };
        if i > 0 && total != len.saturating_mul(i as u64) {
            return Err(fail(format!("'{}' has another size than the files before it", file.display())));
        }
        total = total.saturating_add(len);
    }
    let chain = Chain { files: files.into_iter(), skip, open: None };
    Ok(Source::joined(header, chain, total))
}

/// Reads file after file.
struct Chain {
    files: std::vec::IntoIter<PathBuf>,
    skip: u64,
    open: Option<File>,
}

impl Read for Chain {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        loop {
            if let Some(file) = &mut self.open {
                let count = file.read(to)?;
                if count > 0 || to.is_empty() {
                    return Ok(count);
                }
            }
            let Some(next) = self.files.next() else { return Ok(0) };
            let mut file = File::open(next)?;
            file.seek(SeekFrom::Start(self.skip))?;
            self.open = Some(file);
        }
    }
}
