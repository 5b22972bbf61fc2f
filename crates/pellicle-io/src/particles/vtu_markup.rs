//! The markup of a VTK XML file: which arrays there are, and where in the file their data lie. No data are read here.

use std::ops::Range;
use std::path::Path;

use quick_xml::XmlVersion;
use quick_xml::events::{BytesStart, Event};
use quick_xml::reader::Reader;

use crate::error::{Error, Place};
use crate::scalar::{Endian, Scalar};

/// Where an array's data lie.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Location {
    /// Decimal numbers between the tags.
    Text(Range<usize>),
    /// Base64 between the tags.
    Base64(Range<usize>),
    /// In the appended data, this far from their start.
    Appended(u64),
}

/// An array as its tag describes it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct DataArray {
    pub(super) name: String,
    /// `None` for strings and bits.
    pub(super) scalar: Option<Scalar>,
    pub(super) components: usize,
    pub(super) location: Location,
}

/// A part of the particles.
#[derive(Debug, Default)]
pub(super) struct Piece {
    pub(super) count: u64,
    pub(super) positions: Option<DataArray>,
    pub(super) attributes: Vec<DataArray>,
}

/// The appended data.
#[derive(Debug, Clone, Copy)]
pub(super) struct Appended {
    /// Place of the first byte after the underscore.
    pub(super) start: usize,
    pub(super) is_base64: bool,
}

/// What the markup says.
#[derive(Debug)]
pub(super) struct Document {
    pub(super) endian: Endian,
    /// Type of the sizes that stand before binary data.
    pub(super) header: Scalar,
    pub(super) is_compressed: bool,
    pub(super) pieces: Vec<Piece>,
    pub(super) appended: Option<Appended>,
}

/// Which element the arrays to come belong to.
#[derive(Clone, Copy, PartialEq)]
enum Section {
    Points,
    PointData,
    Other,
}

/// Components of an array, at most.
const MAX_COMPONENTS: u64 = 4096;
/// Pieces, and arrays in all of them, at most: what describes them is larger than their tags.
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
pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<Document, Error> {
    let document = Document {
        endian: Endian::Little,
        header: Scalar::U32,
        is_compressed: false,
        pieces: Vec::new(),
        appended: None,
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
                if matches!(tag.local_name().as_ref(), "Points" | "PointData") {
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
            "Piece" => {
                self.enter()?;
                let count = self.attribute(tag, "NumberOfPoints")?.unwrap_or_else(|| "0".into());
                let count =
                    count.trim().parse().map_err(|_| self.fail(format!("'{count}' is not a number of points")))?;
                self.document.pieces.push(Piece { count, ..Piece::default() });
            }
            "Points" if !is_empty => self.section = Section::Points,
            "PointData" if !is_empty => self.section = Section::PointData,
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
        Err(self.fail(format!("more than {MAX_ENTRIES} pieces and arrays: join the pieces into larger ones")))
    }

    fn file(&mut self, tag: &BytesStart<'_>) -> Result<(), Error> {
        let kind = self.attribute(tag, "type")?.unwrap_or_default();
        if !matches!(kind.as_str(), "UnstructuredGrid" | "PolyData") {
            let what = format!("a VTK file of type '{kind}': particles are read from UnstructuredGrid and PolyData");
            return Err(Error::Unsupported { path: self.path.into(), what });
        }
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
            Some("vtkZLibDataCompressor") => self.document.is_compressed = true,
            Some(other) => {
                let what =
                    format!("the compression '{other}' is not read: write the file with zlib or without compression");
                return Err(Error::Unsupported { path: self.path.into(), what });
            }
        }
        Ok(())
    }

    fn array(&mut self, tag: &BytesStart<'_>, is_empty: bool) -> Result<(), Error> {
        let format = self.attribute(tag, "format")?.unwrap_or_else(|| "ascii".into());
        let end = self.reader.buffer_position() as usize;
        let content = if is_empty {
            end..end
        } else {
            let span =
                self.reader.read_to_end(tag.name()).map_err(|error| self.fail(format!("damaged XML: {error}")))?;
            span.start as usize..span.end as usize
        };
        if self.section == Section::Other {
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
        match section {
            Section::Points => piece.positions = Some(array),
            _ => piece.attributes.push(array),
        }
        Ok(())
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
