//! An HDF5 file with its limits: no more memory than its size justifies.

use std::cell::Cell;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use hdf5_reader::error::ByteOrder;
use hdf5_reader::group::Group;
use hdf5_reader::storage::FileStorage;
use hdf5_reader::{Dataset, Datatype, Hdf5File, OpenOptions, SliceInfo, SliceInfoElem};
use rayon::prelude::*;

use crate::error::{Error, Place};
use crate::formats::detect;
use crate::scalar::{Sample, Scalar, Target};
use crate::source;

/// Numbers that a thread reads at a time, more where a chunk of the file is larger.
const RUN: usize = 1 << 20;
/// A chunk is inflated as a whole; those that programs write have a few MiB.
const MAX_CHUNK: u64 = 256 << 20;
/// Memory for chunks that are needed again.
const CACHE: usize = 16 << 20;

/// An open file.
pub(super) struct Store {
    path: PathBuf,
    root: Group,
    len: u64,
    /// Bytes of memory that may still be filled.
    budget: Cell<u64>,
}

/// A dataset of numbers: `rows` times `width` of them.
#[derive(Clone)]
pub(super) struct Numbers {
    pub(super) dataset: Dataset,
    pub(super) name: String,
    pub(super) rows: u64,
    pub(super) width: usize,
    pub(super) scalar: Scalar,
}

impl Store {
    pub(super) fn open(path: &Path) -> Result<Store, Error> {
        let (file, len) = source::open(path)?;
        let limit = source::inflated_limit(len);
        let options = OpenOptions::default()
            .with_chunk_cache_bytes(CACHE)
            .with_max_chunk_bytes(usize::try_from(limit.min(MAX_CHUNK)).unwrap_or(usize::MAX))
            .with_max_read_bytes(usize::try_from(limit).unwrap_or(usize::MAX))
            .with_max_object_header_bytes(usize::try_from(len.min(8 << 20)).unwrap_or(usize::MAX));
        let opened = FileStorage::from_file(file)
            .and_then(|storage| Hdf5File::from_storage_with_options(Arc::new(storage), options))
            .and_then(|file| file.root_group());
        let root = opened.map_err(|error| explain(path, error))?;
        Ok(Store { path: path.into(), root, len, budget: Cell::new(limit) })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn root(&self) -> &Group {
        &self.root
    }

    pub(super) fn fail(&self, what: impl Into<String>) -> Error {
        Error::Format { path: self.path.clone(), place: Place::Whole, what: what.into() }
    }

    pub(super) fn unsupported(&self, what: impl Into<String>) -> Error {
        Error::Unsupported { path: self.path.clone(), what: what.into() }
    }

    pub(super) fn explain(&self, error: hdf5_reader::error::Error) -> Error {
        explain(&self.path, error)
    }

    /// Names of the groups and of the datasets in a group.
    pub(super) fn names(&self, group: &Group) -> Result<(Vec<String>, Vec<String>), Error> {
        group.member_names().map_err(|error| self.explain(error))
    }

    pub(super) fn group(&self, parent: &Group, name: &str) -> Result<Group, Error> {
        parent.group(name).map_err(|error| self.explain(error))
    }

    /// A dataset, if it is one of numbers in rows. What is not, such as text or records of several fields, is `None`.
    pub(super) fn numbers(&self, group: &Group, name: &str) -> Result<Option<Numbers>, Error> {
        let dataset = match group.dataset(name) {
            Ok(dataset) => dataset,
            Err(error) if is_unsupported(&error) => return Ok(None),
            Err(error) => return Err(self.explain(error)),
        };
        let (Some(scalar), Some((&rows, inner))) = (scalar(dataset.dtype()), dataset.shape().split_first()) else {
            return Ok(None);
        };
        let width = inner.iter().try_fold(1usize, |width, &n| width.checked_mul(usize::try_from(n).ok()?));
        // Wider rows are no attribute of particles.
        let Some(width) = width.filter(|width| (1..=4096).contains(width)) else { return Ok(None) };
        Ok(Some(Numbers { dataset, name: name.into(), rows, width, scalar }))
    }

    /// Reads rows of a dataset.
    pub(super) fn read<D: Target + Send>(&self, numbers: &Numbers, rows: Range<u64>) -> Result<Vec<D>, Error> {
        let name = &numbers.name;
        let count = rows.end.checked_sub(rows.start).filter(|_| rows.end <= numbers.rows).ok_or_else(|| {
            self.fail(format!("rows {} to {} are wanted of '{name}', which has {}", rows.start, rows.end, numbers.rows))
        })?;
        let in_file = count.saturating_mul((numbers.width * numbers.scalar.size()) as u64);
        let is_plain = numbers.dataset.chunks().is_none();
        if is_plain && in_file > self.len {
            let what =
                format!("the dataset '{name}' must take {in_file} bytes, the file has {}: it is cut short", self.len);
            return Err(self.fail(what));
        }
        let needed = in_file.max(count.saturating_mul((numbers.width * size_of::<D>()) as u64));
        let available = self.budget.get();
        if needed > available {
            let what = "bytes of data, out of proportion to the file's size: write it uncompressed";
            return Err(Error::TooLarge { path: self.path.clone(), what, needed, available });
        }
        self.budget.set(available - needed);
        // No more than was found available.
        let mut out = vec![D::default(); count as usize * numbers.width];
        // Whole chunks, so that none is inflated twice.
        let chunk = numbers.dataset.chunks().and_then(|chunk| chunk.first().copied()).map_or(1, |rows| rows.max(1));
        let wanted = (RUN / numbers.width).max(1);
        let per_task = wanted.next_multiple_of(chunk as usize);
        out.par_chunks_mut(per_task * numbers.width)
            .enumerate()
            .try_for_each(|(task, out)| {
                let first = rows.start + (task * per_task) as u64;
                let last = first + (out.len() / numbers.width) as u64;
                read_rows(numbers, first..last, out)
            })
            .map_err(|error| self.explain(error))?;
        Ok(out)
    }

    /// Integers of a small dataset, such as the counts of steps.
    pub(super) fn integers(&self, group: &Group, name: &str) -> Result<Option<Vec<i64>>, Error> {
        let (_, datasets) = self.names(group)?;
        if !datasets.iter().any(|dataset| dataset == name) {
            return Ok(None);
        }
        let Some(numbers) = self.numbers(group, name)? else {
            return Err(self.fail(format!("'{name}' does not hold numbers")));
        };
        self.read(&numbers, 0..numbers.rows).map(Some)
    }
}

fn read_rows<D: Target>(numbers: &Numbers, rows: Range<u64>, out: &mut [D]) -> hdf5_reader::error::Result<()> {
    let go = match numbers.scalar {
        Scalar::F16 => {
            let what = "half-precision numbers are not read: store them in single precision".to_owned();
            return Err(hdf5_reader::error::Error::InvalidData(what));
        }
        Scalar::I8 => read_typed::<D, i8>,
        Scalar::U8 => read_typed::<D, u8>,
        Scalar::I16 => read_typed::<D, i16>,
        Scalar::U16 => read_typed::<D, u16>,
        Scalar::I32 => read_typed::<D, i32>,
        Scalar::U32 => read_typed::<D, u32>,
        Scalar::I64 => read_typed::<D, i64>,
        Scalar::U64 => read_typed::<D, u64>,
        Scalar::F32 => read_typed::<D, f32>,
        Scalar::F64 => read_typed::<D, f64>,
    };
    go(&numbers.dataset, rows, out)
}

fn read_typed<D: Target, S: Sample + hdf5_reader::H5Type>(
    dataset: &Dataset,
    rows: Range<u64>,
    out: &mut [D],
) -> hdf5_reader::error::Result<()> {
    let mut selection = SliceInfo::all(dataset.shape().len());
    if let Some(first) = selection.selections.first_mut() {
        *first = SliceInfoElem::Slice { start: rows.start, end: rows.end, step: 1 };
    }
    let found = dataset.read_slice::<S>(&selection)?;
    if found.len() != out.len() {
        let what = format!("{} numbers were read, {} were expected", found.len(), out.len());
        return Err(hdf5_reader::error::Error::InvalidData(what));
    }
    for (to, from) in out.iter_mut().zip(found.iter()) {
        *to = D::from_sample(*from);
    }
    Ok(())
}

/// The type of a dataset's numbers; `None` for what is no number, or one of an unusual size.
fn scalar(datatype: &Datatype) -> Option<Scalar> {
    // The reader turns the bytes; this says which orders it knows.
    let known = |order: &ByteOrder| matches!(order, ByteOrder::LittleEndian | ByteOrder::BigEndian);
    match datatype {
        Datatype::FixedPoint { size, signed, byte_order } if known(byte_order) => Some(match (size, signed) {
            (1, true) => Scalar::I8,
            (1, false) => Scalar::U8,
            (2, true) => Scalar::I16,
            (2, false) => Scalar::U16,
            (4, true) => Scalar::I32,
            (4, false) => Scalar::U32,
            (8, true) => Scalar::I64,
            (8, false) => Scalar::U64,
            _ => return None,
        }),
        Datatype::FloatingPoint { size: 4, .. } => Some(Scalar::F32),
        Datatype::FloatingPoint { size: 8, .. } => Some(Scalar::F64),
        _ => None,
    }
}

fn is_unsupported(error: &hdf5_reader::error::Error) -> bool {
    use hdf5_reader::error::Error as E;
    match error {
        E::Context { source, .. } => is_unsupported(source),
        E::UnsupportedDatatypeClass(_) | E::UnsupportedEncoding(_) | E::UnsupportedLayoutClass(_) => true,
        _ => false,
    }
}

fn explain(path: &Path, error: hdf5_reader::error::Error) -> Error {
    use hdf5_reader::error::Error as E;
    let is_filter = |error: &E| match error {
        E::Context { source, .. } => matches!(**source, E::UnsupportedFilter(_)),
        error => matches!(error, E::UnsupportedFilter(_)),
    };
    match error {
        E::Io(source) => Error::Read { path: path.into(), source },
        E::InvalidMagic => {
            Error::Format { path: path.into(), place: Place::Byte(0), what: detect::mismatch("an HDF5 file", b"?") }
        }
        error if is_filter(&error) => {
            let what = format!("{error}: rewrite it with gzip, for example by h5repack -f GZIP=4 IN OUT");
            Error::Unsupported { path: path.into(), what }
        }
        error => Error::Format {
            path: path.into(),
            place: Place::Whole,
            what: format!("as HDF5 it is damaged or unusual: {error}"),
        },
    }
}
