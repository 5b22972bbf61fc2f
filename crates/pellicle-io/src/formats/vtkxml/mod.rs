//! VTK XML files: `.vtu`, `.vtp`, `.vti`, and the lists of files `.pvd`, `.pvtu`, `.pvtp`, `.pvti`. What the readers of
//! particles, meshes and volumes share.
//!
//! The file is held in memory as long as it is read, since arrays may point to any place in it.
//!
//! Source: "VTK XML file formats", <https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html>.

mod base64;
mod data;
pub(crate) mod document;
mod markup;

use std::cell::Cell;
use std::io::Read;
use std::path::{Path, PathBuf};

use crate::error::{Error, Place};
use crate::formats::{detect, names};
use crate::particles::{AttributeValues, ParticleAttribute, PositionData, ReadOptions};
use crate::scalar::{Kind as Memory, Scalar, Target};
use crate::source;
use data::Data;
use document::{DataArray, Document, Kind, Piece};

/// A file whose markup has been read.
pub(crate) struct XmlFile {
    path: PathBuf,
    bytes: Vec<u8>,
    document: Document,
    /// Bytes of memory that may still be filled. Compressed data, and arrays that share their data, hold more than the
    /// file.
    budget: Cell<u64>,
}

impl XmlFile {
    /// Opens a file and reads its markup.
    pub(crate) fn open(path: &Path) -> Result<XmlFile, Error> {
        let (file, len) = source::open(path)?;
        let mut bytes = Vec::new();
        let fits = usize::try_from(len).is_ok_and(|len| bytes.try_reserve_exact(len).is_ok());
        if !fits {
            return Err(fail(path, format!("{len} bytes do not fit into memory")));
        }
        file.take(len).read_to_end(&mut bytes).map_err(|source| Error::Read { path: path.into(), source })?;
        if !bytes.trim_ascii_start().starts_with(b"<") && !bytes.starts_with(b"\xef\xbb\xbf<") {
            return Err(fail(path, detect::mismatch("a VTK XML file", &bytes[..bytes.len().min(64)])));
        }
        let document = markup::parse(path, &bytes)?;
        Ok(XmlFile { path: path.into(), bytes, document, budget: Cell::new(source::inflated_limit(len)) })
    }

    /// As [`open`](Self::open), for a file that holds data and not a list of others.
    pub(crate) fn open_grid(path: &Path) -> Result<XmlFile, Error> {
        let file = XmlFile::open(path)?;
        match file.document.kind {
            Kind::UnstructuredGrid | Kind::PolyData if file.document.pieces.is_empty() => {
                Err(file.fail("there is no Piece: the file holds no points, or it is cut short"))
            }
            Kind::UnstructuredGrid | Kind::PolyData => Ok(file),
            Kind::ImageData | Kind::ParallelImage => {
                let what = "this is an image, a volume of samples: it holds no points and faces".into();
                Err(Error::Unsupported { path: path.into(), what })
            }
            Kind::Collection | Kind::Parallel => {
                let what = "this is a list of other files: name it .pvd (a Collection), .pvtu or .pvtp".into();
                Err(Error::Unsupported { path: path.into(), what })
            }
        }
    }

    pub(crate) fn document(&self) -> &Document {
        &self.document
    }

    /// An error about the file as a whole.
    pub(crate) fn fail(&self, what: impl Into<String>) -> Error {
        fail(&self.path, what.into())
    }

    /// The points of all pieces.
    pub(crate) fn positions(&self) -> Result<PositionData, Error> {
        let mut arrays = Vec::new();
        for piece in self.document.pieces.iter().filter(|piece| piece.count > 0) {
            let Some(array) = &piece.positions else {
                return Err(self.fail(format!("a Piece of {} points has no Points", piece.count)));
            };
            let (3, Some(scalar)) = (array.components, array.scalar) else {
                return Err(self.fail(format!("the points have {} components, not 3 numbers", array.components)));
            };
            arrays.push((piece.count, array, scalar));
        }
        let mut positions = PositionData::of(arrays.iter().map(|(_, _, scalar)| *scalar), 0);
        for (count, array, scalar) in arrays {
            match &mut positions {
                PositionData::F32(out) => self.append_points(out, count, array, scalar)?,
                PositionData::F64(out) => self.append_points(out, count, array, scalar)?,
            }
        }
        Ok(positions)
    }

    fn append_points<D: Target + Send>(
        &self,
        out: &mut Vec<[D; 3]>,
        count: u64,
        array: &DataArray,
        scalar: Scalar,
    ) -> Result<(), Error> {
        let data = self.data::<D>(array, scalar, count)?;
        // What was opened fits into memory.
        data.fill(grow(out, count as usize, [D::default(); 3]).as_flattened_mut())
    }

    /// The attributes that are asked for: the arrays of the first piece that has points, which every other must have
    /// too.
    pub(crate) fn attributes(&self, options: &ReadOptions) -> Result<Vec<ParticleAttribute>, Error> {
        let pieces: Vec<&Piece> = self.document.pieces.iter().filter(|piece| piece.count > 0).collect();
        let first = pieces.first().copied().or(self.document.pieces.first());
        let usable = first.into_iter().flat_map(|piece| &piece.attributes).filter(|array| array.scalar.is_some());
        let named: Vec<(String, &DataArray)> =
            usable.map(|array| (names::canonical(&array.name, array.components), array)).collect();
        options.check(&self.path, named.iter().map(|(name, array)| (name.as_str(), array.name.as_str())))?;
        let mut attributes = Vec::new();
        for (name, array) in named.into_iter().filter(|(name, array)| options.wants(name, &array.name)) {
            let values = self.attribute(&pieces, array)?;
            attributes.push(ParticleAttribute { name, components: array.components, values });
        }
        Ok(attributes)
    }

    fn attribute(&self, pieces: &[&Piece], wanted: &DataArray) -> Result<AttributeValues, Error> {
        let (name, components) = (&wanted.name, wanted.components);
        let mut parts: Vec<(u64, &DataArray, Scalar)> = Vec::new();
        for piece in pieces {
            let found = piece.attributes.iter().find(|a| a.name == *name && a.components == components);
            match found.and_then(|array| Some((piece.count, array, array.scalar?))) {
                Some(part) => parts.push(part),
                None => return Err(self.fail(format!("the array '{name}' is not in every Piece"))),
            }
        }
        let mut values = AttributeValues::of(parts.iter().map(|(_, _, scalar)| *scalar).chain(wanted.scalar), 0);
        for (count, array, scalar) in parts {
            match &mut values {
                AttributeValues::F32(out) => self.append_values(out, count, array, scalar)?,
                AttributeValues::F64(out) => self.append_values(out, count, array, scalar)?,
                AttributeValues::I32(out) => self.append_values(out, count, array, scalar)?,
                AttributeValues::I64(out) => self.append_values(out, count, array, scalar)?,
            }
        }
        Ok(values)
    }

    /// Appends the numbers of an array of `tuples` tuples.
    pub(crate) fn append_values<D: Target + Send>(
        &self,
        out: &mut Vec<D>,
        tuples: u64,
        array: &DataArray,
        scalar: Scalar,
    ) -> Result<(), Error> {
        let data = self.data::<D>(array, scalar, tuples)?;
        data.fill(grow(out, tuples as usize * array.components, D::default()))
    }

    /// The numbers of an array that describes cells.
    pub(crate) fn indices(&self, array: Option<&DataArray>, count: u64, what: &str) -> Result<Indices, Error> {
        let Some((array, scalar)) = array.and_then(|array| Some((array, array.scalar?))) else {
            return Err(self.fail(format!("a Piece has cells, but no {what} of them")));
        };
        if array.components != 1 || matches!(scalar, Scalar::F32 | Scalar::F64) {
            return Err(self.fail(format!("the {what} of the cells are not single integers")));
        }
        if scalar.kind() == Memory::I32 {
            let mut out = Vec::new();
            self.append_values(&mut out, count, array, scalar)?;
            Ok(Indices::Narrow(out))
        } else {
            let mut out = Vec::new();
            self.append_values(&mut out, count, array, scalar)?;
            Ok(Indices::Wide(out))
        }
    }

    /// Opens an array and counts the memory that it will take as numbers of type `D`.
    fn data<'a, D>(&'a self, array: &'a DataArray, scalar: Scalar, tuples: u64) -> Result<Data<'a>, Error> {
        self.claim(tuples, size_of::<D>().max(scalar.size()) * array.components)?;
        let values = tuples * array.components as u64;
        Data::open(&self.path, &self.bytes, &self.document, array, scalar, values)
    }

    /// Lets data grow to so many bytes, if that is more than the file's size suggests.
    pub(crate) fn raise_budget(&self, bytes: u64) {
        self.budget.set(self.budget.get().max(bytes));
    }

    /// Counts the memory that `count` things of `size` bytes will take, and gives the count back.
    pub(crate) fn claim(&self, count: u64, size: usize) -> Result<usize, Error> {
        let (needed, available) = (count.saturating_mul(size as u64), self.budget.get());
        if needed > available {
            let what = "bytes of data, out of proportion to the file's size: write it uncompressed";
            return Err(Error::TooLarge { path: self.path.clone(), what, needed, available });
        }
        self.budget.set(available - needed);
        Ok(count as usize)
    }
}

/// Numbers of points, as wide as the file has them.
pub(crate) enum Indices {
    Narrow(Vec<i32>),
    Wide(Vec<i64>),
}

impl Indices {
    pub(crate) fn len(&self) -> usize {
        match self {
            Indices::Narrow(values) => values.len(),
            Indices::Wide(values) => values.len(),
        }
    }

    /// The `i`th, which must be there.
    pub(crate) fn get(&self, i: usize) -> i64 {
        match self {
            Indices::Narrow(values) => values[i].into(),
            Indices::Wide(values) => values[i],
        }
    }
}

/// Appends `more` values of zero, and gives them.
fn grow<T: Clone>(out: &mut Vec<T>, more: usize, zero: T) -> &mut [T] {
    let old = out.len();
    if old == 0 {
        // Memory that the system hands out as zeros is touched first by the threads that fill it.
        *out = vec![zero; more];
    } else {
        out.reserve_exact(more);
        out.resize(old + more, zero);
    }
    &mut out[old..]
}

fn fail(path: &Path, what: String) -> Error {
    Error::Format { path: path.into(), place: Place::Whole, what }
}
