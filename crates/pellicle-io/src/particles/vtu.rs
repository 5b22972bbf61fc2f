//! VTK XML particles: the points of an UnstructuredGrid (`.vtu`) or PolyData (`.vtp`) and their PointData.
//!
//! The file is held in memory as long as it is read, since arrays may point to any place in it.
//!
//! Source: "VTK XML file formats", <https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html>.

use std::io::Read;
use std::path::Path;

use super::vtu_data;
use super::vtu_markup::{self, DataArray, Document, Piece};
use super::{AttributeValues, ParticleAttribute, Particles, PositionData, ReadOptions};
use crate::error::{Error, Place};
use crate::formats::{detect, names};
use crate::scalar::{Field, Records, Scalar};
use crate::source::{self, Source};

pub(crate) fn read(path: &Path, options: &ReadOptions) -> Result<Particles, Error> {
    let (file, len) = source::open(path)?;
    let mut bytes = Vec::new();
    let fits = usize::try_from(len).is_ok_and(|len| bytes.try_reserve_exact(len).is_ok());
    if !fits {
        return Err(fail(path, format!("{len} bytes do not fit into memory")));
    }
    file.take(len).read_to_end(&mut bytes).map_err(|source| Error::Read { path: path.into(), source })?;
    let head = &bytes[..bytes.len().min(64)];
    if !bytes.trim_ascii_start().starts_with(b"<") && !bytes.starts_with(b"\xef\xbb\xbf<") {
        return Err(fail(path, detect::mismatch("a VTK XML file", head)));
    }
    let document = vtu_markup::parse(path, &bytes)?;
    if document.pieces.is_empty() {
        return Err(fail(
            path,
            "there is no Piece: this is not a VTK XML file of particles, or it is cut short".into(),
        ));
    }
    let budget = source::inflated_limit(len);
    let mut assembly = Assembly { path, bytes: &bytes, document: &document, budget };
    let positions = assembly.positions()?;
    let attributes = assembly.attributes(options)?;
    Ok(Particles { positions, attributes })
}

fn fail(path: &Path, what: String) -> Error {
    Error::Format { path: path.into(), place: Place::Whole, what }
}

/// Puts the pieces together.
struct Assembly<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    document: &'a Document,
    /// Bytes that may still be decoded. Compressed data, and arrays that share their data, hold more than the file.
    budget: u64,
}

impl Assembly<'_> {
    fn positions(&mut self) -> Result<PositionData, Error> {
        let pieces = self.document.pieces.iter().filter(|piece| piece.count > 0);
        let mut arrays = Vec::new();
        for piece in pieces {
            let Some(array) = &piece.positions else {
                return Err(fail(self.path, format!("a Piece of {} points has no Points", piece.count)));
            };
            let (3, Some(scalar)) = (array.components, array.scalar) else {
                return Err(fail(self.path, format!("the points have {} components, not 3 numbers", array.components)));
            };
            arrays.push((piece, array, scalar));
        }
        let mut positions = PositionData::of(arrays.iter().map(|(_, _, scalar)| *scalar), 0);
        for (piece, array, scalar) in arrays {
            let size = scalar.size();
            let fields = [0, size, 2 * size].map(|offset| Field { offset, scalar });
            self.array(piece, array, scalar, |step| match step {
                Step::Reserve(tuples) => positions.reserve(tuples),
                Step::Append(records) => positions.append(records, &fields),
            })?;
        }
        Ok(positions)
    }

    /// The attributes that are asked for: the arrays of the first piece that has points, which every other must have too.
    fn attributes(&mut self, options: &ReadOptions) -> Result<Vec<ParticleAttribute>, Error> {
        let pieces: Vec<&Piece> = self.document.pieces.iter().filter(|piece| piece.count > 0).collect();
        let first = pieces.first().copied().or(self.document.pieces.first());
        let usable = first.into_iter().flat_map(|piece| &piece.attributes).filter(|array| array.scalar.is_some());
        let named: Vec<(String, &DataArray)> =
            usable.map(|array| (names::canonical(&array.name, array.components), array)).collect();
        options.check(self.path, named.iter().map(|(name, array)| (name.as_str(), array.name.as_str())))?;
        let mut attributes = Vec::new();
        for (name, array) in named.into_iter().filter(|(name, array)| options.wants(name, &array.name)) {
            let values = self.attribute(&pieces, array)?;
            attributes.push(ParticleAttribute { name, components: array.components, values });
        }
        Ok(attributes)
    }

    fn attribute(&mut self, pieces: &[&Piece], wanted: &DataArray) -> Result<AttributeValues, Error> {
        let (name, components) = (&wanted.name, wanted.components);
        let mut parts: Vec<(&Piece, &DataArray, Scalar)> = Vec::new();
        for piece in pieces {
            let found = piece.attributes.iter().find(|a| a.name == *name && a.components == components);
            match found.and_then(|array| Some((*piece, array, array.scalar?))) {
                Some(part) => parts.push(part),
                None => return Err(fail(self.path, format!("the array '{name}' is not in every Piece"))),
            }
        }
        let mut values = AttributeValues::of(parts.iter().map(|(_, _, scalar)| *scalar).chain(wanted.scalar), 0);
        for (piece, array, scalar) in parts {
            let fields: Vec<Field> = (0..components).map(|i| Field { offset: i * scalar.size(), scalar }).collect();
            self.array(piece, array, scalar, |step| match step {
                Step::Reserve(tuples) => values.reserve(tuples * components),
                Step::Append(records) => values.append(records, &fields),
            })?;
        }
        Ok(values)
    }

    /// Reads the data of one array of one piece.
    fn array(
        &mut self,
        piece: &Piece,
        array: &DataArray,
        scalar: Scalar,
        mut each: impl FnMut(Step<'_>),
    ) -> Result<(), Error> {
        let tuple = (array.components * scalar.size()) as u64;
        let size = piece.count.saturating_mul(tuple);
        if size > self.budget {
            let what = "bytes of data, out of proportion to the file's size: write it uncompressed";
            return Err(Error::TooLarge { path: self.path.into(), what, needed: size, available: self.budget });
        }
        self.budget -= size;
        let (mut source, encoding) = vtu_data::open(self.path, self.bytes, self.document, array, size)?;
        let layout = vec![scalar; array.components];
        let what = if array.name.is_empty() { "points" } else { array.name.as_str() };
        each(Step::Reserve(source.room(piece.count, Source::least_bytes(encoding, &layout), what)?));
        source.records(encoding, &layout, piece.count, what, |bytes, endian| {
            each(Step::Append(Records { bytes, stride: tuple as usize, endian }));
            Ok(())
        })
    }
}

/// What happens to the destination of an array.
enum Step<'a> {
    /// Room for this many more tuples.
    Reserve(usize),
    Append(Records<'a>),
}
