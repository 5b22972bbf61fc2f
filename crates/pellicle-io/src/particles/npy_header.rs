//! The header of a NumPy array: type, order and shape.
//!
//! Source: the NPY format, versions 1.0 to 3.0, <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>.

use crate::error::Error;
use crate::formats::detect;
use crate::scalar::{Endian, Scalar};
use crate::source::Source;

const MAGIC: &[u8] = b"\x93NUMPY";
/// Longest header that is read, and most numbers in a row.
const MAX_HEADER: u64 = 64 << 10;
const MAX_COLUMNS: usize = 4096;

/// Numbers of one type in a row: the row itself, or a field of a structured type.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Part {
    /// Empty for the row itself.
    pub(crate) name: String,
    /// `None` for what is passed over: text, padding, times.
    pub(crate) scalar: Option<Scalar>,
    /// Bytes of one number.
    pub(crate) size: usize,
    pub(crate) endian: Endian,
    pub(crate) count: usize,
}

/// What the header says.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Header {
    /// One part, or the fields of a structured type.
    pub(crate) parts: Vec<Part>,
    pub(crate) is_structured: bool,
    pub(crate) is_fortran: bool,
    pub(crate) shape: Vec<u64>,
    pub(crate) rows: u64,
    /// Numbers in a row, of an array of numbers.
    pub(crate) columns: usize,
}

impl Header {
    /// Bytes of a row.
    pub(crate) fn stride(&self) -> usize {
        self.parts.iter().map(|part| part.size * part.count).sum()
    }
}

/// An array as a whole, of any shape.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Array {
    pub(crate) scalar: Scalar,
    pub(crate) endian: Endian,
    pub(crate) is_fortran: bool,
    pub(crate) shape: Vec<u64>,
}

/// Reads the header of an array whose first axis counts rows.
pub(crate) fn read(source: &mut Source<'_>) -> Result<Header, Error> {
    let text = read_text(source)?;
    parse(source, &text)
}

/// Reads the header of an array of numbers, of any shape.
pub(crate) fn read_array(source: &mut Source<'_>) -> Result<Array, Error> {
    let text = read_text(source)?;
    let Dictionary { shape, is_fortran, descr } = Dictionary::parse(source, &text)?;
    let Part { scalar: Some(scalar), endian, .. } = simple(source, descr, 1)? else {
        return Err(source.unsupported("the array does not hold numbers"));
    };
    Ok(Array { scalar, endian, is_fortran, shape })
}

fn read_text(source: &mut Source<'_>) -> Result<String, Error> {
    let head = source.peek(8)?;
    if !head.starts_with(MAGIC) {
        let what = detect::mismatch("a NumPy array", &head[..head.len().min(64)]);
        return Err(source.fail(what));
    }
    let prefix = source.exact(8, "the header")?;
    let major = prefix[6];
    let length = match major {
        1 => {
            let bytes = source.exact(2, "the header")?;
            u64::from(u16::from_le_bytes([bytes[0], bytes[1]]))
        }
        2 | 3 => {
            let bytes = source.exact(4, "the header")?;
            u64::from(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
        }
        _ => return Err(source.unsupported(format!("NPY version {major} is not known: 1, 2 and 3 are read"))),
    };
    if length > MAX_HEADER {
        return Err(source.fail(format!("a header of {length} bytes: the limit is {MAX_HEADER}")));
    }
    Ok(String::from_utf8_lossy(source.exact(length as usize, "the header")?).into_owned())
}

/// The dictionary `{'descr': '<f4', 'fortran_order': False, 'shape': (10, 3), }`.
struct Dictionary<'a> {
    shape: Vec<u64>,
    is_fortran: bool,
    /// From the type on.
    descr: &'a str,
}

impl<'a> Dictionary<'a> {
    fn parse(source: &Source<'_>, text: &'a str) -> Result<Dictionary<'a>, Error> {
        let value = |key: &str| {
            let at = text.find(&format!("'{key}'")).or_else(|| text.find(&format!("\"{key}\"")));
            let rest = at.and_then(|at| text[at + key.len() + 2..].trim_start().strip_prefix(':')).map(str::trim_start);
            rest.ok_or_else(|| source.fail(format!("the header has no '{key}'")))
        };
        let shape = value("shape")?;
        let inner = shape.strip_prefix('(').and_then(|s| s.split_once(')')).map(|(inner, _)| inner);
        let Some(inner) = inner else { return Err(source.fail("the header's 'shape' is not a tuple")) };
        let Some(shape) = numbers(inner) else {
            return Err(source.fail(format!("the header's 'shape' ({inner}) is not made of numbers")));
        };
        Ok(Dictionary { shape, is_fortran: value("fortran_order")?.starts_with("True"), descr: value("descr")? })
    }
}

/// The type of an array of numbers, `columns` of them a row.
fn simple(source: &Source<'_>, descr: &str, columns: usize) -> Result<Part, Error> {
    let name = descr.get(1..).and_then(|t| t.split_once(['\'', '"'])).map_or("", |(name, _)| name);
    part("", name, columns).filter(|part| part.scalar.is_some()).ok_or_else(|| {
        source.unsupported(format!(
            "the array holds '{name}': floats of 2, 4 and 8 bytes and integers are read; convert it by .astype('f4')"
        ))
    })
}

fn parse(source: &Source<'_>, text: &str) -> Result<Header, Error> {
    let Dictionary { shape, is_fortran, descr } = Dictionary::parse(source, text)?;
    let rows = shape.first().copied().unwrap_or(1);
    let columns = shape.iter().skip(1).try_fold(1u64, |product, &n| product.checked_mul(n));
    let columns = columns.and_then(|n| usize::try_from(n).ok()).filter(|&n| n <= MAX_COLUMNS);
    let Some(columns) = columns else {
        let what = format!("the array has the shape {shape:?}: a row may have {MAX_COLUMNS} numbers at most");
        return Err(source.unsupported(what));
    };
    let is_structured = descr.starts_with('[');
    let parts = if is_structured {
        fields(descr).ok_or_else(|| source.fail("the header's 'descr' is not a list of fields"))?
    } else {
        vec![simple(source, descr, columns)?]
    };
    let stride = parts.iter().try_fold(0usize, |sum, part| sum.checked_add(part.size.checked_mul(part.count)?));
    if stride.is_none_or(|stride| stride == 0 && columns > 0 || stride > 64 << 10) || parts.len() > MAX_COLUMNS {
        return Err(source.fail("the type's size is not between 1 and 65536 bytes"));
    }
    Ok(Header { parts, is_structured, is_fortran, shape, rows, columns })
}

/// Numbers with commas between them.
fn numbers(text: &str) -> Option<Vec<u64>> {
    let words = text.split(',').map(str::trim).filter(|s| !s.is_empty());
    words.map(|s| s.trim_end_matches('L').parse().ok()).collect()
}

/// Parses `[('x', '<f4'), ('v', '<f4', (3,)), (('title', 'id'), '<i4')]`. `None` for nested types.
fn fields(text: &str) -> Option<Vec<Part>> {
    let mut rest = text.strip_prefix('[')?.trim_start();
    let mut parts = Vec::new();
    while !rest.starts_with(']') {
        rest = rest.strip_prefix('(')?.trim_start();
        if let Some(title) = rest.strip_prefix('(') {
            rest = quoted(title)?.1.trim_start().strip_prefix(',')?.trim_start();
        }
        let (name, behind) = quoted(rest)?;
        let behind = behind.trim_start();
        let behind = behind.strip_prefix(')').unwrap_or(behind).trim_start().strip_prefix(',')?.trim_start();
        let (kind, behind) = quoted(behind)?;
        let mut behind = behind.trim_start();
        let mut count = 1usize;
        if let Some(shape) = behind.strip_prefix(',') {
            let (inner, after) = shape.trim_start().strip_prefix('(')?.split_once(')')?;
            for n in numbers(inner)? {
                count = count.checked_mul(usize::try_from(n).ok()?).filter(|&n| n <= MAX_COLUMNS)?;
            }
            behind = after.trim_start();
        }
        rest = behind.strip_prefix(')')?.trim_start();
        rest = rest.strip_prefix(',').unwrap_or(rest).trim_start();
        parts.push(part(name, kind, count)?);
    }
    Some(parts)
}

/// What is between the quotes that `text` begins with, and what is behind them.
fn quoted(text: &str) -> Option<(&str, &str)> {
    let quote = text.chars().next().filter(|c| matches!(c, '\'' | '"'))?;
    text[1..].split_once(quote)
}

/// A type such as `<f4`. `None` if its size is not known.
fn part(name: &str, kind: &str, count: usize) -> Option<Part> {
    let native = if cfg!(target_endian = "big") { Endian::Big } else { Endian::Little };
    let (endian, rest) = match kind.split_at_checked(1) {
        Some(("<", rest)) => (Endian::Little, rest),
        Some((">", rest)) => (Endian::Big, rest),
        Some(("=" | "|", rest)) => (native, rest),
        _ => (native, kind),
    };
    let scalar = match rest {
        "f2" => Some(Scalar::F16),
        "f4" => Some(Scalar::F32),
        "f8" => Some(Scalar::F64),
        "i1" => Some(Scalar::I8),
        "u1" | "b1" => Some(Scalar::U8),
        "i2" => Some(Scalar::I16),
        "u2" => Some(Scalar::U16),
        "i4" => Some(Scalar::I32),
        "u4" => Some(Scalar::U32),
        "i8" => Some(Scalar::I64),
        "u8" => Some(Scalar::U64),
        _ => None,
    };
    let size = match scalar {
        Some(scalar) => scalar.size(),
        None => {
            let (letter, digits) = rest.split_at_checked(1)?;
            let digits = digits.split_once('[').map_or(digits, |(digits, _)| digits);
            let number: usize = digits.parse().ok()?;
            number.checked_mul(if letter == "U" { 4 } else { 1 })?
        }
    };
    Some(Part { name: name.into(), scalar, size, endian, count })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn structured_types_are_parsed_with_shapes_titles_padding_and_text() {
        let text = "[('pos', '<f4', (3,)), ('', '|V4'), (('a title', 'id'), '>i8'), ('name', '<U5'),], 'shape': (2,)";
        let parts = fields(text).expect("a list of fields");
        let found: Vec<_> = parts.iter().map(|p| (p.name.as_str(), p.scalar, p.size, p.count)).collect();
        let expected = [
            ("pos", Some(Scalar::F32), 4, 3),
            ("", None, 4, 1),
            ("id", Some(Scalar::I64), 8, 1),
            ("name", None, 20, 1),
        ];
        assert_eq!(found, expected);
        assert_eq!(parts[2].endian, Endian::Big);
        assert!(fields("[('a', [('b', '<f4')])]").is_none());
        assert!(fields("[('a', '<f4'").is_none());
        assert!(fields("[(").is_none());
    }
}
