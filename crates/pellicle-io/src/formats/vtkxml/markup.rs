//! Reads the markup of a VTK XML file into a [`Document`]. No data are read here.

use std::ops::Range;
use std::path::Path;
use std::str::FromStr;

use quick_xml::XmlVersion;
use quick_xml::events::{BytesStart, Event};
use quick_xml::reader::Reader;

use super::document::{Appended, Compressor, DataArray, Document, Image, Kind, Listed, Location, Piece};
use crate::error::{Error, Place};
use crate::scalar::{Endian, Scalar};

/// Which element the arrays to come belong to.
#[derive(Clone, Copy, PartialEq)]
enum Section {
    Points,
    PointData,
    CellData,
    Cells,
    Strips,
    Other,
}

impl Section {
    fn of(tag: &str) -> Section {
        match tag {
            "Points" => Section::Points,
            "PointData" | "PPointData" => Section::PointData,
            "CellData" | "PCellData" => Section::CellData,
            "Cells" | "Polys" => Section::Cells,
            "Strips" => Section::Strips,
            _ => Section::Other,
        }
    }
}

/// Components of an array, at most.
const MAX_COMPONENTS: u64 = 4096;
/// Pieces, arrays in all of them, and files that are listed, at most: what describes them is larger than their tags.
const MAX_ENTRIES: usize = 1 << 16;

struct Parser<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    reader: Reader<&'a [u8]>,
    section: Section,
    document: Document,
    entries: usize,
    /// Whether the end of the outermost element was seen.
    is_closed: bool,
}

/// Reads the markup of a file.
pub(crate) fn parse(path: &Path, bytes: &[u8]) -> Result<Document, Error> {
    let document = Document {
        kind: Kind::UnstructuredGrid,
        endian: Endian::Little,
        header: Scalar::U32,
        compressor: None,
        pieces: Vec::new(),
        listed: Vec::new(),
        appended: None,
        image: None,
        active: [None, None],
    };
    let reader = Reader::from_reader(bytes);
    let mut parser = Parser { path, bytes, reader, section: Section::Other, document, entries: 0, is_closed: false };
    while parser.step()? {}
    Ok(parser.document)
}

impl Parser<'_> {
    fn fail(&self, what: impl Into<String>) -> Error {
        Error::Format { path: self.path.into(), place: Place::Byte(self.reader.buffer_position()), what: what.into() }
    }

    /// Takes in one tag; `false` when there is no more to read.
    fn step(&mut self) -> Result<bool, Error> {
        let event = self.reader.read_event().map_err(|error| self.fail(format!("damaged XML: {error}")))?;
        match event {
            Event::Start(tag) => self.start(&tag, false),
            Event::Empty(tag) => self.start(&tag, true),
            Event::End(tag) => {
                self.is_closed |= tag.local_name().as_ref() == "VTKFile";
                if Section::of(tag.local_name().as_ref()) != Section::Other {
                    self.section = Section::Other;
                }
                Ok(true)
            }
            Event::Eof if self.is_closed => Ok(false),
            Event::Eof => Err(self.fail("there is no </VTKFile>: the file seems to be cut short")),
            _ => Ok(true),
        }
    }

    fn start(&mut self, tag: &BytesStart<'_>, is_empty: bool) -> Result<bool, Error> {
        match tag.local_name().as_ref() {
            "VTKFile" => self.file(tag)?,
            "Piece" => self.piece(tag)?,
            "DataSet" => self.listed(tag)?,
            "ImageData" if self.document.kind == Kind::ImageData => self.image(tag)?,
            "PImageData" if self.document.kind == Kind::ParallelImage => {
                self.image(tag)?;
                self.document.pieces.push(Piece::default());
            }
            "PPointData" | "PCellData" if self.document.kind == Kind::ParallelImage && !is_empty => {
                self.section = Section::of(tag.local_name().as_ref());
                self.active(tag)?;
            }
            "PDataArray" if self.document.kind == Kind::ParallelImage => {
                self.enter()?;
                self.described(tag, Location::Text(0..0))?;
            }
            "Points" | "PointData" | "CellData" | "Cells" | "Polys" | "Strips" if !is_empty => {
                self.section = Section::of(tag.local_name().as_ref());
                self.active(tag)?;
            }
            "DataArray" => self.array(tag, is_empty)?,
            "AppendedData" if !is_empty => {
                self.appended(tag)?;
                return Ok(false);
            }
            _ => {}
        }
        Ok(true)
    }

    /// Counts a piece or array.
    fn enter(&mut self) -> Result<(), Error> {
        self.entries += 1;
        if self.entries <= MAX_ENTRIES {
            return Ok(());
        }
        Err(self.fail(format!("more than {MAX_ENTRIES} pieces, arrays and files: join the pieces into larger ones")))
    }

    fn file(&mut self, tag: &BytesStart<'_>) -> Result<(), Error> {
        let kind = self.attribute(tag, "type")?.unwrap_or_default();
        self.document.kind = match kind.as_str() {
            "UnstructuredGrid" => Kind::UnstructuredGrid,
            "PolyData" => Kind::PolyData,
            "Collection" => Kind::Collection,
            "PUnstructuredGrid" | "PPolyData" => Kind::Parallel,
            "ImageData" => Kind::ImageData,
            "PImageData" => Kind::ParallelImage,
            _ => {
                let what =
                    format!("a VTK file of type '{kind}': only UnstructuredGrid, PolyData and ImageData are read");
                return Err(Error::Unsupported { path: self.path.into(), what });
            }
        };
        if let Some(order) = self.attribute(tag, "byte_order")? {
            self.document.endian = match order.as_str() {
                "LittleEndian" => Endian::Little,
                "BigEndian" => Endian::Big,
                _ => return Err(self.fail(format!("the byte order '{order}' is neither LittleEndian nor BigEndian"))),
            };
        }
        if let Some(header) = self.attribute(tag, "header_type")? {
            self.document.header = match header.as_str() {
                "UInt32" => Scalar::U32,
                "UInt64" => Scalar::U64,
                _ => return Err(self.fail(format!("the header type '{header}' is neither UInt32 nor UInt64"))),
            };
        }
        match self.attribute(tag, "compressor")?.as_deref() {
            None | Some("") => {}
            Some("vtkZLibDataCompressor") => self.document.compressor = Some(Compressor::Zlib),
            Some("vtkLZ4DataCompressor") => self.document.compressor = Some(Compressor::Lz4),
            Some("vtkLZMADataCompressor") => self.document.compressor = Some(Compressor::Lzma),
            Some(other) => {
                let what = format!(
                    "the compression '{other}' is not read: write the file with zlib, LZ4 or LZMA, or without compression"
                );
                return Err(Error::Unsupported { path: self.path.into(), what });
            }
        }
        Ok(())
    }

    fn piece(&mut self, tag: &BytesStart<'_>) -> Result<(), Error> {
        self.enter()?;
        if let Some(file) = self.attribute(tag, "Source")? {
            let extent = self.numbers(tag, "Extent")?;
            self.document.listed.push(Listed { file: file.into(), time: 0.0, part: String::new(), extent });
            return Ok(());
        }
        let mut piece = Piece { count: self.count(tag, "NumberOfPoints")?, ..Piece::default() };
        let cells = if self.document.kind == Kind::PolyData { "NumberOfPolys" } else { "NumberOfCells" };
        piece.cells.count = self.count(tag, cells)?;
        piece.strips.count = self.count(tag, "NumberOfStrips")?;
        piece.extent = self.numbers(tag, "Extent")?;
        self.document.pieces.push(piece);
        Ok(())
    }

    /// A number of things; 0 where it is not told.
    fn count(&self, tag: &BytesStart<'_>, name: &str) -> Result<u64, Error> {
        let Some(count) = self.attribute(tag, name)? else { return Ok(0) };
        count.trim().parse().map_err(|_| self.fail(format!("'{count}' is not a count, in {name}")))
    }

    /// A list of so many numbers; `None` where it is not told.
    fn numbers<T: FromStr, const N: usize>(&self, tag: &BytesStart<'_>, name: &str) -> Result<Option<[T; N]>, Error> {
        let Some(text) = self.attribute(tag, name)? else { return Ok(None) };
        let numbers: Option<Vec<T>> = text.split_ascii_whitespace().map(|word| word.parse().ok()).collect();
        let numbers = numbers.and_then(|numbers| <[T; N]>::try_from(numbers).ok());
        numbers.map(Some).ok_or_else(|| self.fail(format!("{name}=\"{text}\" is not a list of {N} numbers")))
    }

    fn image(&mut self, tag: &BytesStart<'_>) -> Result<(), Error> {
        let Some(extent) = self.numbers(tag, "WholeExtent")? else {
            return Err(self.fail("the ImageData has no WholeExtent"));
        };
        let origin = self.numbers(tag, "Origin")?.unwrap_or([0.0; 3]);
        let spacing = self.numbers(tag, "Spacing")?.unwrap_or([1.0; 3]);
        let straight = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
        let direction = self.numbers(tag, "Direction")?.unwrap_or(straight);
        self.document.image = Some(Image { extent, origin, spacing, direction });
        Ok(())
    }

    /// The active scalars of the section that begins, as the first piece has them.
    fn active(&mut self, tag: &BytesStart<'_>) -> Result<(), Error> {
        let place = match self.section {
            Section::PointData => 0,
            Section::CellData => 1,
            _ => return Ok(()),
        };
        if self.document.active[place].is_none() {
            self.document.active[place] = self.attribute(tag, "Scalars")?;
        }
        Ok(())
    }

    /// A file of a Collection.
    fn listed(&mut self, tag: &BytesStart<'_>) -> Result<(), Error> {
        self.enter()?;
        if self.document.kind != Kind::Collection {
            return Ok(());
        }
        let Some(file) = self.attribute(tag, "file")? else {
            return Err(self.fail("a DataSet names no file"));
        };
        let time = self.attribute(tag, "timestep")?.unwrap_or_else(|| "0".into());
        let Some(time) = time.trim().parse::<f64>().ok().filter(|time| time.is_finite()) else {
            return Err(self.fail(format!("the time step '{time}' is not a finite number")));
        };
        let part = self.attribute(tag, "part")?.unwrap_or_default();
        self.document.listed.push(Listed { file: file.into(), time, part, extent: None });
        Ok(())
    }

    fn array(&mut self, tag: &BytesStart<'_>, is_empty: bool) -> Result<(), Error> {
        let format = self.attribute(tag, "format")?.unwrap_or_else(|| "ascii".into());
        let end = self.reader.buffer_position() as usize;
        let content = if is_empty { end..end } else { self.content()? };
        let is_ignored = self.section == Section::CellData && self.document.kind != Kind::ImageData;
        if self.section == Section::Other || is_ignored {
            return Ok(());
        }
        self.enter()?;
        let location = match format.as_str() {
            "ascii" => Location::Text(content),
            "binary" => Location::Base64(content),
            "appended" => {
                let offset = self.attribute(tag, "offset")?.unwrap_or_default();
                let offset = offset.trim().parse().map_err(|_| self.fail(format!("'{offset}' is not an offset")))?;
                Location::Appended(offset)
            }
            _ => return Err(self.fail(format!("the format '{format}' is not ascii, binary or appended"))),
        };
        self.described(tag, location)
    }

    /// Takes in an array of the section at hand.
    fn described(&mut self, tag: &BytesStart<'_>, location: Location) -> Result<(), Error> {
        let components = self.attribute(tag, "NumberOfComponents")?.unwrap_or_else(|| "1".into());
        let components = components.trim().parse::<u64>().ok().filter(|&c| (1..=MAX_COMPONENTS).contains(&c));
        let Some(components) = components else {
            return Err(self.fail(format!("an array's number of components must be 1 to {MAX_COMPONENTS}")));
        };
        let array = DataArray {
            name: self.attribute(tag, "Name")?.unwrap_or_default(),
            scalar: parse_type(&self.attribute(tag, "type")?.unwrap_or_default()),
            components: components as usize,
            location,
        };
        let section = self.section;
        let Some(piece) = self.document.pieces.last_mut() else { return Err(self.fail("an array outside of a Piece")) };
        let cells = match section {
            Section::Points => {
                piece.positions = Some(array);
                return Ok(());
            }
            Section::Cells => &mut piece.cells,
            Section::Strips => &mut piece.strips,
            Section::CellData => {
                piece.of_cells.push(array);
                return Ok(());
            }
            _ => {
                piece.attributes.push(array);
                return Ok(());
            }
        };
        match array.name.as_str() {
            "connectivity" => cells.connectivity = Some(array),
            "offsets" => cells.offsets = Some(array),
            "types" => cells.types = Some(array),
            // Faces of polyhedra, which are refused by their types.
            _ => {}
        }
        Ok(())
    }

    /// The data between the tags of an array: its first text. What VTK knows about the array stands beside it, as
    /// elements of their own.
    fn content(&mut self) -> Result<Range<usize>, Error> {
        let (mut depth, mut found) = (0u32, None);
        loop {
            let from = self.reader.buffer_position() as usize;
            let event = self.reader.read_event().map_err(|error| self.fail(format!("damaged XML: {error}")))?;
            match event {
                Event::Start(_) => depth += 1,
                Event::End(_) if depth == 0 => return Ok(found.unwrap_or(from..from)),
                Event::End(_) => depth -= 1,
                Event::Text(text) if depth == 0 && found.is_none() && !text.trim_ascii().is_empty() => {
                    found = Some(from..self.reader.buffer_position() as usize);
                }
                Event::Eof => return Err(self.fail("the file ends within an array: it seems to be cut short")),
                _ => {}
            }
        }
    }

    fn appended(&mut self, tag: &BytesStart<'_>) -> Result<(), Error> {
        let is_base64 = match self.attribute(tag, "encoding")?.as_deref() {
            Some("raw") => false,
            Some("base64") => true,
            other => {
                let other = other.unwrap_or("none").to_owned();
                return Err(self.fail(format!("the encoding '{other}' of the appended data is neither raw nor base64")));
            }
        };
        let from = self.reader.buffer_position() as usize;
        let blank = self.bytes.get(from..).unwrap_or_default().iter().take_while(|b| b.is_ascii_whitespace()).count();
        if self.bytes.get(from + blank) != Some(&b'_') {
            return Err(self.fail("the appended data do not begin with an underscore"));
        }
        self.document.appended = Some(Appended { start: from + blank + 1, is_base64 });
        Ok(())
    }

    fn attribute(&self, tag: &BytesStart<'_>, name: &str) -> Result<Option<String>, Error> {
        let found = tag.try_get_attribute(name).map_err(|error| self.fail(format!("damaged XML: {error}")))?;
        let Some(found) = found else { return Ok(None) };
        let value = found.normalized_value(XmlVersion::Implicit1_0);
        value.map(|value| Some(value.into_owned())).map_err(|error| self.fail(format!("damaged XML: {error}")))
    }
}

fn parse_type(name: &str) -> Option<Scalar> {
    Some(match name {
        "Int8" => Scalar::I8,
        "UInt8" => Scalar::U8,
        "Int16" => Scalar::I16,
        "UInt16" => Scalar::U16,
        "Int32" => Scalar::I32,
        "UInt32" => Scalar::U32,
        "Int64" => Scalar::I64,
        "UInt64" => Scalar::U64,
        "Float32" => Scalar::F32,
        "Float64" => Scalar::F64,
        _ => return None,
    })
}
