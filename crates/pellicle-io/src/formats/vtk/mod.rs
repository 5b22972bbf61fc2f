//! The grammar of legacy VTK files, versions 2.0 to 5.1, ASCII and binary, as a sequence of sections.
//!
//! The caller asks for the [next](Reader::next) section and must read or skip its data before it asks again. Blocks of
//! METADATA and lookup tables are passed over here. Binary data are big-endian.
//!
//! Source: "VTK File Formats", The VTK User's Guide, and for 5.1 `vtkDataReader.cxx` of VTK 9.

mod data;

use std::path::Path;

use crate::error::Error;
use crate::formats::detect;
use crate::scalar::{Encoding, Endian, Scalar};
use crate::source::Source;

/// Components of an array, at most.
const MAX_COMPONENTS: usize = 4096;

/// Which lists of cells a section holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum CellKind {
    Vertices,
    Lines,
    Polygons,
    Strips,
    /// The cells of an unstructured grid, whose types follow.
    Mixed,
}

/// Announces cells: how many, and how long their lists are.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cells {
    pub(crate) kind: CellKind,
    /// Cells; or offsets, one more than there are cells, if `has_offsets`.
    count: u64,
    size: u64,
    has_offsets: bool,
}

impl Cells {
    /// Whether there is no cell.
    pub(crate) fn is_empty(&self) -> bool {
        self.count <= u64::from(self.has_offsets)
    }
}

/// Type of an array's values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Content {
    Numbers(Scalar),
    Bits,
    Strings,
}

/// Announces an array.
#[derive(Debug, Clone)]
pub(crate) struct Array {
    pub(crate) name: String,
    pub(crate) components: usize,
    pub(crate) tuples: u64,
    pub(crate) content: Content,
    /// Whether it has a tuple for every point.
    pub(crate) is_of_points: bool,
    /// Whether the numbers are bytes of colours that ASCII has as 0 to 1.
    pub(crate) is_color_text: bool,
}

/// A part of the file; its data come next.
#[derive(Debug)]
pub(crate) enum Section {
    Points { count: u64, scalar: Scalar },
    Cells(Cells),
    CellTypes { count: u64 },
    Array(Array),
}

/// What the arrays to come belong to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Owner {
    Whole,
    Points(u64),
    Cells(u64),
}

/// The grid of STRUCTURED_POINTS.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Points {
    /// Points along each axis; `None` until they are told.
    pub(crate) dims: Option<[u64; 3]>,
    pub(crate) origin: Option<[f64; 3]>,
    pub(crate) spacing: Option<[f64; 3]>,
}

/// A legacy VTK file, from its first section on.
pub(crate) struct Reader {
    source: Source<'static>,
    encoding: Encoding,
    dataset: String,
    points: Points,
    owner: Owner,
    /// Arrays of the current FIELD that are still to come.
    fields_left: u64,
}

impl Reader {
    /// Opens a file and reads its header.
    pub(crate) fn open(path: &Path) -> Result<Reader, Error> {
        let mut source = Source::open(path)?;
        let head = source.peek(64)?;
        if !head.starts_with(b"# vtk DataFile Version") {
            let what = detect::mismatch("a legacy VTK file", head);
            return Err(source.fail(what));
        }
        source.set_text(true);
        source.line()?;
        // The title.
        source.line()?;
        let format = words(&mut source)?;
        let encoding = match format.first().map(|w| w.to_ascii_uppercase()).as_deref() {
            Some("ASCII") => Encoding::Ascii,
            Some("BINARY") => Encoding::Binary(Endian::Big),
            _ => return Err(source.fail("the third line is neither ASCII nor BINARY")),
        };
        let dataset = match words(&mut source)?.as_slice() {
            [key, kind, ..] if key.eq_ignore_ascii_case("DATASET") => kind.to_ascii_uppercase(),
            other => return Err(source.fail(format!("'{}' stands where DATASET is expected", shorten(other)))),
        };
        source.set_text(encoding == Encoding::Ascii);
        Ok(Reader { source, encoding, dataset, points: Points::default(), owner: Owner::Whole, fields_left: 0 })
    }

    /// `POLYDATA`, `UNSTRUCTURED_GRID`, …
    pub(crate) fn dataset(&self) -> &str {
        &self.dataset
    }

    pub(crate) fn source(&self) -> &Source<'static> {
        &self.source
    }

    /// The grid of a dataset `STRUCTURED_POINTS`, as far as it has been read.
    pub(crate) fn points(&self) -> Points {
        self.points
    }

    /// What comes next, without the grammar.
    pub(crate) fn into_source(self) -> (Source<'static>, Encoding) {
        (self.source, self.encoding)
    }

    /// The next section, or `None` at the end of the file.
    pub(crate) fn next(&mut self) -> Result<Option<Section>, Error> {
        loop {
            let line = words(&mut self.source)?;
            let Some(first) = line.first() else { return Ok(None) };
            let key = first.to_ascii_uppercase();
            if key == "METADATA" {
                self.skip_metadata()?;
                continue;
            }
            if self.fields_left > 0 {
                self.fields_left -= 1;
                if key == "NULL_ARRAY" {
                    continue;
                }
                return self.field_array(&line).map(|array| Some(Section::Array(array)));
            }
            let rest: Vec<&str> = line[1..].iter().map(String::as_str).collect();
            if let Some(section) = self.section(&key, &rest)? {
                return Ok(Some(section));
            }
        }
    }

    /// The section that a line begins, or `None` if it only sets the stage for others.
    fn section(&mut self, key: &str, rest: &[&str]) -> Result<Option<Section>, Error> {
        match (key, rest) {
            ("DIMENSIONS" | "ORIGIN" | "SPACING" | "ASPECT_RATIO", [x, y, z, ..])
                if self.dataset == "STRUCTURED_POINTS" =>
            {
                match key {
                    "DIMENSIONS" => self.points.dims = Some([self.count(x)?, self.count(y)?, self.count(z)?]),
                    "ORIGIN" => self.points.origin = Some([self.length(x)?, self.length(y)?, self.length(z)?]),
                    _ => self.points.spacing = Some([self.length(x)?, self.length(y)?, self.length(z)?]),
                }
                Ok(None)
            }
            ("POINTS", [count, kind, ..]) => {
                let count = self.count(count)?;
                let Content::Numbers(scalar) = self.content(kind)? else {
                    return Err(self.source.fail(format!("points of type {kind}")));
                };
                Ok(Some(Section::Points { count, scalar }))
            }
            ("VERTICES" | "LINES" | "POLYGONS" | "TRIANGLE_STRIPS" | "CELLS", [count, size, ..]) => {
                let (count, size) = (self.count(count)?, self.count(size)?);
                self.cells(key, count, size).map(Some)
            }
            ("CELL_TYPES", [count, ..]) => Ok(Some(Section::CellTypes { count: self.count(count)? })),
            ("POINT_DATA", [count, ..]) => {
                self.owner = Owner::Points(self.count(count)?);
                Ok(None)
            }
            ("CELL_DATA", [count, ..]) => {
                self.owner = Owner::Cells(self.count(count)?);
                Ok(None)
            }
            ("FIELD", [_name, count, ..]) => {
                self.fields_left = self.count(count)?;
                Ok(None)
            }
            ("LOOKUP_TABLE", [_name, count]) => {
                let count = self.count(count)?;
                self.skip_table(count)?;
                Ok(None)
            }
            _ => self.attribute(key, rest).map(Some),
        }
    }

    /// The old kinds of arrays, one keyword for each role.
    fn attribute(&mut self, key: &str, rest: &[&str]) -> Result<Section, Error> {
        let color = if self.encoding == Encoding::Ascii { "float" } else { "unsigned_char" };
        let (name, components, kind) = match (key, rest) {
            ("SCALARS", [name, kind]) => (name, 1, *kind),
            ("SCALARS", [name, kind, components, ..]) => (name, self.count(components)?, *kind),
            ("COLOR_SCALARS", [name, components, ..]) => (name, self.count(components)?, color),
            ("VECTORS" | "NORMALS", [name, kind, ..]) => (name, 3, *kind),
            ("TENSORS", [name, kind, ..]) => (name, 9, *kind),
            ("TENSORS6", [name, kind, ..]) => (name, 6, *kind),
            ("TEXTURE_COORDINATES", [name, dimension, kind, ..]) => (name, self.count(dimension)?, *kind),
            ("GLOBAL_IDS" | "PEDIGREE_IDS" | "EDGE_FLAGS", [name, kind, ..]) => (name, 1, *kind),
            _ => {
                let line = format!("{key} {}", rest.join(" ")).chars().take(60).collect::<String>();
                return Err(self.source.fail(format!("'{line}' is not a section of a legacy VTK file")));
            }
        };
        let tuples = match self.owner {
            Owner::Points(count) | Owner::Cells(count) => count,
            Owner::Whole => return Err(self.source.fail(format!("{key} stands before POINT_DATA and CELL_DATA"))),
        };
        let mut array = self.array(name, components, tuples, kind)?;
        array.is_color_text = key == "COLOR_SCALARS" && self.encoding == Encoding::Ascii;
        if key == "SCALARS" && self.source.peek(12)?.get(..12).is_some_and(|b| b.eq_ignore_ascii_case(b"LOOKUP_TABLE"))
        {
            self.source.line()?;
        }
        Ok(Section::Array(array))
    }

    fn field_array(&mut self, line: &[String]) -> Result<Array, Error> {
        match line {
            [name, components, tuples, kind, ..] => {
                let (components, tuples) = (self.count(components)?, self.count(tuples)?);
                self.array(name, components, tuples, kind)
            }
            _ => Err(self.source.fail(format!("'{}' does not announce an array of a FIELD", shorten(line)))),
        }
    }

    fn array(&mut self, name: &str, components: u64, tuples: u64, kind: &str) -> Result<Array, Error> {
        let components = usize::try_from(components).ok().filter(|&c| c <= MAX_COMPONENTS).ok_or_else(|| {
            self.source.fail(format!("the array '{name}' has {components} components: the limit is {MAX_COMPONENTS}"))
        })?;
        let content = self.content(kind)?;
        let is_of_points = matches!(self.owner, Owner::Points(_));
        Ok(Array { name: decode_name(name), components, tuples, content, is_of_points, is_color_text: false })
    }

    fn cells(&mut self, key: &str, count: u64, size: u64) -> Result<Section, Error> {
        let kind = match key {
            "VERTICES" => CellKind::Vertices,
            "LINES" => CellKind::Lines,
            "POLYGONS" => CellKind::Polygons,
            "TRIANGLE_STRIPS" => CellKind::Strips,
            _ => CellKind::Mixed,
        };
        let has_offsets = self.source.peek(7)?.get(..7).is_some_and(|b| b.eq_ignore_ascii_case(b"OFFSETS"));
        Ok(Section::Cells(Cells { kind, count, size, has_offsets }))
    }

    fn count(&self, word: &str) -> Result<u64, Error> {
        word.parse().map_err(|_| self.source.fail(format!("'{word}' is not a count")))
    }

    fn length(&self, word: &str) -> Result<f64, Error> {
        word.parse().map_err(|_| self.source.fail(format!("'{word}' is not a number")))
    }

    fn content(&self, kind: &str) -> Result<Content, Error> {
        Ok(Content::Numbers(match kind.to_ascii_lowercase().as_str() {
            "bit" => return Ok(Content::Bits),
            "string" | "utf8_string" => return Ok(Content::Strings),
            "char" | "signed_char" | "vtktypeint8" => Scalar::I8,
            "unsigned_char" | "vtktypeuint8" => Scalar::U8,
            "short" | "vtktypeint16" => Scalar::I16,
            "unsigned_short" | "vtktypeuint16" => Scalar::U16,
            // Whatever its size in memory, VTK writes its index type with 32 bits.
            "int" | "vtktypeint32" | "vtkidtype" => Scalar::I32,
            "unsigned_int" | "vtktypeuint32" => Scalar::U32,
            "long" | "long_long" | "vtktypeint64" => Scalar::I64,
            "unsigned_long" | "unsigned_long_long" | "vtktypeuint64" => Scalar::U64,
            "float" | "vtktypefloat32" => Scalar::F32,
            "double" | "vtktypefloat64" => Scalar::F64,
            _ => return Err(self.source.fail(format!("'{kind}' is not a type of a legacy VTK file"))),
        }))
    }

    /// Passes over a block of METADATA, which ends with a blank line.
    fn skip_metadata(&mut self) -> Result<(), Error> {
        while let Some(line) = self.source.line()? {
            if line.trim_ascii().is_empty() {
                break;
            }
        }
        Ok(())
    }
}

/// The words of the next line that is not blank; none at the end of the file.
fn words(source: &mut Source<'_>) -> Result<Vec<String>, Error> {
    while let Some(line) = source.line()? {
        let line = String::from_utf8_lossy(line);
        let words: Vec<String> = line.split_ascii_whitespace().take(64).map(str::to_owned).collect();
        if !words.is_empty() {
            return Ok(words);
        }
    }
    Ok(Vec::new())
}

fn shorten(words: &[String]) -> String {
    words.join(" ").chars().take(60).collect()
}

/// Names are written with `%20` for a space and the like.
fn decode_name(name: &str) -> String {
    let mut bytes = Vec::with_capacity(name.len());
    let mut rest = name.as_bytes();
    while let Some((&first, after)) = rest.split_first() {
        let code = after.get(..2).and_then(|hex| std::str::from_utf8(hex).ok());
        match code.and_then(|hex| u8::from_str_radix(hex, 16).ok()) {
            Some(byte) if first == b'%' => {
                bytes.push(byte);
                rest = &after[2..];
            }
            _ => {
                bytes.push(first);
                rest = after;
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

#[cfg(test)]
mod tests {
    #[test]
    fn names_are_decoded_and_stray_percent_signs_kept() {
        assert_eq!(super::decode_name("flow%20rate"), "flow rate");
        assert_eq!(super::decode_name("100%"), "100%");
        assert_eq!(super::decode_name("%zz"), "%zz");
    }
}
