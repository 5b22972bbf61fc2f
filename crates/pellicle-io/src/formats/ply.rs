//! The grammar of PLY: a text header that declares elements, then their records, in ASCII or binary.
//!
//! Source: Greg Turk, "The PLY Polygon File Format", 1994.

use crate::error::Error;
use crate::formats::detect;
use crate::scalar::{Encoding, Endian, Scalar, integer};
use crate::source::Source;

/// Lines of a header, at most: damaged files are told early.
const MAX_HEADER_LINES: usize = 10_000;

/// A column of an element.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Property {
    Scalar { name: String, scalar: Scalar },
    List { name: String, length: Scalar, item: Scalar },
}

/// Records of one kind.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Element {
    pub(crate) name: String,
    pub(crate) count: u64,
    pub(crate) properties: Vec<Property>,
}

/// All that stands before the data.
#[derive(Debug)]
pub(crate) struct Header {
    pub(crate) encoding: Encoding,
    pub(crate) elements: Vec<Element>,
}

impl Element {
    /// Names and types of the properties that are not lists.
    pub(crate) fn scalars(&self) -> (Vec<String>, Vec<Scalar>) {
        self.properties
            .iter()
            .filter_map(|property| match property {
                Property::Scalar { name, scalar } => Some((name.clone(), *scalar)),
                Property::List { .. } => None,
            })
            .unzip()
    }

    fn has_lists(&self) -> bool {
        self.properties.iter().any(|p| matches!(p, Property::List { .. }))
    }

    /// Bytes that a record takes at least: an empty list is only its length.
    pub(crate) fn least_bytes(&self, encoding: Encoding) -> u64 {
        let layout: Vec<Scalar> = self
            .properties
            .iter()
            .map(|property| match property {
                Property::Scalar { scalar, .. } => *scalar,
                Property::List { length, .. } => *length,
            })
            .collect();
        Source::least_bytes(encoding, &layout)
    }
}

/// Reads the header, up to and with `end_header`.
pub(crate) fn read_header(source: &mut Source<'_>) -> Result<Header, Error> {
    let head = source.peek(64)?;
    if !(head.starts_with(b"ply\n") || head.starts_with(b"ply\r\n")) {
        let what = detect::mismatch("a PLY file", head);
        return Err(source.fail(what));
    }
    source.set_text(true);
    source.line()?;
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    for _ in 0..MAX_HEADER_LINES {
        let Some(line) = source.line()? else { return Err(source.fail("the file ends within the header")) };
        let line = String::from_utf8_lossy(line).into_owned();
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        match words.as_slice() {
            ["format", format, _version] => encoding = Some(parse_format(source, format)?),
            ["element", name, count] => {
                let Ok(count) = count.parse() else {
                    return Err(source.fail(format!("'{count}' is not a number of elements")));
                };
                elements.push(Element { name: (*name).into(), count, properties: Vec::new() });
            }
            ["property", rest @ ..] => {
                let property = parse_property(source, rest)?;
                let Some(element) = elements.last_mut() else {
                    return Err(source.fail("a property stands before the first element"));
                };
                element.properties.push(property);
            }
            ["end_header"] => {
                let Some(encoding) = encoding else { return Err(source.fail("the header has no line 'format'")) };
                source.set_text(encoding == Encoding::Ascii);
                return Ok(Header { encoding, elements });
            }
            [] | ["comment" | "obj_info", ..] => {}
            _ => return Err(source.fail(format!("'{}' is not a line of a PLY header", shorten(&line)))),
        }
    }
    Err(source.fail(format!("the header has more than {MAX_HEADER_LINES} lines")))
}

fn shorten(line: &str) -> String {
    line.chars().take(60).collect()
}

fn parse_format(source: &Source<'_>, format: &str) -> Result<Encoding, Error> {
    match format {
        "ascii" => Ok(Encoding::Ascii),
        "binary_little_endian" => Ok(Encoding::Binary(Endian::Little)),
        "binary_big_endian" => Ok(Encoding::Binary(Endian::Big)),
        _ => Err(source.fail(format!("the format '{format}' is not ascii, binary_little_endian or binary_big_endian"))),
    }
}

fn parse_property(source: &Source<'_>, words: &[&str]) -> Result<Property, Error> {
    let scalar =
        |name: &str| parse_type(name).ok_or_else(|| source.fail(format!("'{name}' is not a type of a PLY property")));
    match words {
        ["list", length, item, name] => {
            let length = scalar(length)?;
            if matches!(length, Scalar::F32 | Scalar::F64) {
                return Err(source.fail(format!("the list '{name}' has a length that is not an integer")));
            }
            Ok(Property::List { name: (*name).into(), length, item: scalar(item)? })
        }
        [kind, name] => Ok(Property::Scalar { name: (*name).into(), scalar: scalar(kind)? }),
        _ => Err(source.fail(format!("'property {}' is not a property", shorten(&words.join(" "))))),
    }
}

fn parse_type(name: &str) -> Option<Scalar> {
    Some(match name {
        "char" | "int8" => Scalar::I8,
        "uchar" | "uint8" => Scalar::U8,
        "short" | "int16" => Scalar::I16,
        "ushort" | "uint16" => Scalar::U16,
        "int" | "int32" => Scalar::I32,
        "uint" | "uint32" => Scalar::U32,
        "int64" => Scalar::I64,
        "uint64" => Scalar::U64,
        "float" | "float32" => Scalar::F32,
        "double" | "float64" => Scalar::F64,
        _ => return None,
    })
}

/// Hands out the scalar properties of an element in runs of packed records; lists are passed over.
pub(crate) fn read_scalars(
    source: &mut Source<'_>,
    encoding: Encoding,
    element: &Element,
    mut each: impl FnMut(&[u8], Endian) -> Result<(), Error>,
) -> Result<(), Error> {
    let (_, layout) = element.scalars();
    if !element.has_lists() {
        return source.records(encoding, &layout, element.count, &element.name, each);
    }
    let mut packed = Vec::new();
    let endian = match encoding {
        Encoding::Ascii => Endian::Little,
        Encoding::Binary(endian) => endian,
    };
    walk(source, encoding, element, None, |_, record| {
        packed.extend_from_slice(record.scalars);
        if packed.len() > 64 << 10 {
            each(&packed, endian)?;
            packed.clear();
        }
        Ok(())
    })?;
    each(&packed, endian)
}

/// Passes over an element.
pub(crate) fn skip_element(source: &mut Source<'_>, encoding: Encoding, element: &Element) -> Result<(), Error> {
    if let (Encoding::Binary(_), false) = (encoding, element.has_lists()) {
        let bytes = u128::from(element.count) * u128::from(element.least_bytes(encoding));
        return source.skip(u64::try_from(bytes).unwrap_or(u64::MAX), &element.name);
    }
    walk(source, encoding, element, None, |_, _| Ok(()))
}

/// Items of a list that is kept, at most: a polygon of more corners is damage.
const MAX_LIST: u64 = 1 << 20;

/// A record of an element with lists.
pub(crate) struct Record<'a> {
    /// Its scalar properties, packed.
    pub(crate) scalars: &'a [u8],
    /// The items of the list that was asked for.
    pub(crate) items: &'a [i64],
}

/// Reads an element record by record, and keeps the items of one list: that of property number `wanted`.
pub(crate) fn walk(
    source: &mut Source<'_>,
    encoding: Encoding,
    element: &Element,
    wanted: Option<usize>,
    mut each: impl FnMut(&Source<'_>, Record<'_>) -> Result<(), Error>,
) -> Result<(), Error> {
    if element.properties.is_empty() {
        return Ok(());
    }
    source.room(element.count, element.least_bytes(encoding), &element.name)?;
    let (mut scalars, mut items) = (Vec::new(), Vec::new());
    let mut reader = NumberReader { encoding, text: Vec::new(), what: &element.name };
    for _ in 0..element.count {
        scalars.clear();
        items.clear();
        for (i, property) in element.properties.iter().enumerate() {
            match *property {
                Property::Scalar { scalar, .. } => reader.append(source, scalar, &mut scalars)?,
                Property::List { length, item, .. } => {
                    let length = reader.length(source, length, item)?;
                    if wanted == Some(i) {
                        reader.keep(source, item, length, &mut items)?;
                    } else {
                        reader.skip(source, item, length)?;
                    }
                }
            }
        }
        each(source, Record { scalars: &scalars, items: &items })?;
    }
    Ok(())
}

/// Reads single numbers.
struct NumberReader<'a> {
    encoding: Encoding,
    text: Vec<u8>,
    what: &'a str,
}

impl NumberReader<'_> {
    fn append(&mut self, source: &mut Source<'_>, scalar: Scalar, out: &mut Vec<u8>) -> Result<(), Error> {
        match self.encoding {
            Encoding::Ascii => source.number(scalar, out, self.what),
            Encoding::Binary(_) => {
                out.extend_from_slice(source.exact(scalar.size(), self.what)?);
                Ok(())
            }
        }
    }

    fn integer(&mut self, source: &mut Source<'_>, scalar: Scalar) -> Result<i64, Error> {
        match self.encoding {
            Encoding::Ascii => {
                self.text.clear();
                source.number(scalar, &mut self.text, self.what)?;
                Ok(integer(&self.text, scalar, Endian::Little))
            }
            Encoding::Binary(endian) => Ok(integer(source.exact(scalar.size(), self.what)?, scalar, endian)),
        }
    }

    /// The length of a list, checked against what is left of the file.
    fn length(&mut self, source: &mut Source<'_>, length: Scalar, item: Scalar) -> Result<u64, Error> {
        let found = self.integer(source, length)?;
        let Ok(length) = u64::try_from(found) else {
            return Err(source.fail(format!("a list of {found} items, in {}", self.what)));
        };
        source.room(length, Source::least_bytes(self.encoding, &[item]), "list items")?;
        Ok(length)
    }

    fn keep(&mut self, source: &mut Source<'_>, item: Scalar, length: u64, to: &mut Vec<i64>) -> Result<(), Error> {
        if length > MAX_LIST {
            return Err(source.fail(format!("a list of {length} items, in {}: the limit is {MAX_LIST}", self.what)));
        }
        for _ in 0..length {
            to.push(self.integer(source, item)?);
        }
        Ok(())
    }

    fn skip(&mut self, source: &mut Source<'_>, item: Scalar, length: u64) -> Result<(), Error> {
        if self.encoding != Encoding::Ascii {
            return source.skip(length * item.size() as u64, self.what);
        }
        for _ in 0..length {
            self.text.clear();
            source.number(item, &mut self.text, self.what)?;
        }
        Ok(())
    }
}
