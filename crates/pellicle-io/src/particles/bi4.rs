//! DualSPHysics' binary particles (`Part_0001.bi4`).
//!
//! A file is a head of 64 bytes, whose byte 60 tells the byte order (0 little, 1 big; 10 more if sizes of arrays have 64
//! bits, as byte 61 tells, too), and an item. An item has a definition (name, numbers of its arrays and items, size of its
//! values), values, arrays and further items; an array has a definition (name, type, count, size) and its numbers. Text
//! is a length of 32 bits and its bytes. The particles are the item that has an array `Pos` or `Posd`, three floats or
//! doubles for each. The other arrays of as many elements are attributes: `Idp` is `id`, `Vel` `velocity`, `Rhop` `density`.
//!
//! Source: the layout as `JBinaryData` and `JPartDataBi4` of DualSPHysics 5 write it
//! (<https://github.com/DualSPHysics/DualSPHysics>); there is no specification. What is read here was tested on files of
//! that layout that we made ourselves, of no simulation.

use std::path::Path;

use super::{AttributeValues, ParticleAttribute, Particles, PositionData, ReadOptions, xyz};
use crate::error::Error;
use crate::formats::{detect, names};
use crate::scalar::{Encoding, Endian, Field, Records, Scalar};
use crate::source::{self, Source};

/// Depth to which items are looked into, and bytes of a definition or of values.
const MAX_DEPTH: usize = 16;
const MAX_DEFINITION: u32 = 64 << 10;

/// What to do where the layout is not as expected.
const CONVERT: &str = "convert it by DualSPHysics' PartVTK to .vtk or .csv";

struct Array {
    name: String,
    scalar: Scalar,
    components: usize,
    count: u64,
    /// Place of the numbers.
    offset: u64,
}

struct Reader {
    source: Source<'static>,
    endian: Endian,
    has_long_sizes: bool,
}

pub(crate) fn read(path: &Path, options: &ReadOptions) -> Result<Particles, Error> {
    options.single(path, "BI4")?;
    let mut source = Source::open(path)?;
    let head = source.peek(64)?;
    if !head.starts_with(b"#FileJBD ") {
        let what = detect::mismatch("DualSPHysics' binary data", &head[..head.len().min(64)]);
        return Err(source.fail(what));
    }
    let head = source.exact(64, "the head")?;
    let (order, has_long_sizes) = (head[60], head[61] != 0);
    let endian = match order {
        0 | 10 => Endian::Little,
        1 | 11 => Endian::Big,
        _ => return Err(source.unsupported(format!("the byte order {order} is not known: {CONVERT}"))),
    };
    let mut reader = Reader { source, endian, has_long_sizes: has_long_sizes || order >= 10 };
    let Some(arrays) = reader.item(0)? else {
        return Err(reader.source.unsupported(format!("there is no array Pos or Posd: {CONVERT}")));
    };
    reader.particles(&arrays, options)
}

/// Whether an array holds positions.
fn is_position(array: &Array) -> bool {
    array.components == 3 && matches!(array.name.as_str(), "Pos" | "Posd")
}

/// The name in memory.
fn canonical(array: &Array) -> String {
    match array.name.as_str() {
        "Idp" | "Idpd" => "id".into(),
        "Rhop" => "density".into(),
        name => names::canonical(name, array.components),
    }
}

impl Reader {
    fn unsigned(&mut self, what: &str) -> Result<u32, Error> {
        let bytes = self.source.exact(4, what)?;
        let bytes = [bytes[0], bytes[1], bytes[2], bytes[3]];
        Ok(if self.endian == Endian::Big { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) })
    }

    /// A size of an array.
    fn size(&mut self) -> Result<u64, Error> {
        const WHAT: &str = "the size of an array";
        if !self.has_long_sizes {
            return self.unsigned(WHAT).map(u64::from);
        }
        let (first, second) = (u64::from(self.unsigned(WHAT)?), u64::from(self.unsigned(WHAT)?));
        Ok(if self.endian == Endian::Big { first << 32 | second } else { second << 32 | first })
    }

    fn text(&mut self, what: &str) -> Result<String, Error> {
        let length = self.unsigned(what)?;
        if length > MAX_DEFINITION {
            return Err(self.source.fail(format!("a text of {length} bytes in {what}: the limit is {MAX_DEFINITION}")));
        }
        Ok(String::from_utf8_lossy(self.source.exact(length as usize, what)?).into_owned())
    }

    fn mark(&mut self, expected: &str) -> Result<(), Error> {
        let found = self.text("a mark")?;
        if found.trim() == expected {
            return Ok(());
        }
        let found: String = found.chars().take(40).collect();
        Err(self.source.fail(format!("'{expected}' was expected, but this is '{}'", found.escape_debug())))
    }

    /// The arrays of this item or of the first one in it that has positions.
    fn item(&mut self, depth: usize) -> Result<Option<Vec<Array>>, Error> {
        const WHAT: &str = "the definition of an item";
        if depth > MAX_DEPTH {
            return Err(self.source.fail(format!("items within items, more than {MAX_DEPTH} deep")));
        }
        self.unsigned(WHAT)?;
        self.mark("ITEM")?;
        self.text(WHAT)?;
        // Whether it and its values are hidden.
        self.source.skip(8, WHAT)?;
        // Formats of floats and doubles.
        self.text(WHAT)?;
        self.text(WHAT)?;
        let (arrays, items, values) = (self.unsigned(WHAT)?, self.unsigned(WHAT)?, self.unsigned(WHAT)?);
        self.source.skip(u64::from(values), "the values of an item")?;
        // A definition of an array takes 30 bytes at least, that of an item 40.
        self.source.room(u64::from(arrays), 30, "arrays")?;
        let mut found = Vec::new();
        for _ in 0..arrays {
            found.extend(self.array()?);
        }
        if found.iter().any(is_position) {
            return Ok(Some(found));
        }
        self.source.room(u64::from(items), 40, "items")?;
        for _ in 0..items {
            if let Some(found) = self.item(depth + 1)? {
                return Ok(Some(found));
            }
        }
        Ok(None)
    }

    /// An array of numbers; `None` for one of text.
    fn array(&mut self) -> Result<Option<Array>, Error> {
        const WHAT: &str = "the definition of an array";
        self.unsigned(WHAT)?;
        self.mark("ARRAY")?;
        let name = self.text(WHAT)?;
        self.source.skip(4, WHAT)?;
        let kind = self.unsigned(WHAT)?;
        let (count, size) = (self.size()?, self.size()?);
        let offset = self.source.offset();
        let array = match kind {
            1 => None,
            // A logical value takes a byte or four.
            2 if size == count => Some((Scalar::U8, 1)),
            2 | 7 => Some((Scalar::I32, 1)),
            3 => Some((Scalar::I8, 1)),
            4 => Some((Scalar::U8, 1)),
            5 => Some((Scalar::I16, 1)),
            6 => Some((Scalar::U16, 1)),
            8 => Some((Scalar::U32, 1)),
            9 => Some((Scalar::I64, 1)),
            10 => Some((Scalar::U64, 1)),
            11 => Some((Scalar::F32, 1)),
            12 => Some((Scalar::F64, 1)),
            20 => Some((Scalar::I32, 3)),
            21 => Some((Scalar::U32, 3)),
            22 => Some((Scalar::F32, 3)),
            23 => Some((Scalar::F64, 3)),
            _ => return Err(self.source.unsupported(format!("'{name}' has the unknown type {kind}: {CONVERT}"))),
        };
        if let Some((scalar, components)) = array {
            let bytes = (scalar.size() * components) as u64;
            self.source.room(count, bytes, "elements of an array")?;
            if count.checked_mul(bytes) != Some(size) {
                return Err(self.source.fail(format!("'{name}' has {count} elements in {size} bytes")));
            }
            self.source.skip(size, "an array")?;
            return Ok(Some(Array { name, scalar, components, count, offset }));
        }
        self.source.skip(size, "an array")?;
        Ok(None)
    }

    fn particles(&self, arrays: &[Array], options: &ReadOptions) -> Result<Particles, Error> {
        let path = self.source.path();
        // Of both, the doubles.
        let position = arrays.iter().filter(|a| is_position(a)).max_by_key(|a| a.scalar.size());
        let Some(position) = position else { return Err(self.source.fail("there are no positions")) };
        let is_attribute = |a: &&Array| !is_position(a) && a.count == position.count;
        let others: Vec<(String, &Array)> = arrays.iter().filter(is_attribute).map(|a| (canonical(a), a)).collect();
        options.check(path, others.iter().map(|(name, a)| (name.as_str(), a.name.as_str())))?;
        let positions = self.positions(position)?;
        let mut attributes = Vec::new();
        for (name, array) in others {
            if options.wants(&name, &array.name) {
                let capacity = self.capacity(array)? * array.components;
                let mut values = AttributeValues::of([array.scalar], capacity);
                let fields = self::fields(array);
                self.each(array, |records| values.append(records, &fields))?;
                attributes.push(ParticleAttribute { name, components: array.components, values });
            }
        }
        Ok(Particles { positions, attributes })
    }

    fn positions(&self, array: &Array) -> Result<PositionData, Error> {
        let (path, count) = (self.source.path(), self.capacity(array)?);
        if self.endian == Endian::Little && matches!(array.scalar, Scalar::F32 | Scalar::F64) {
            let (file, _) = source::open(path)?;
            return xyz::read_positions(path, &file, array.offset, count, array.scalar == Scalar::F64);
        }
        let mut positions = PositionData::of([array.scalar], count);
        let fields = fields(array);
        self.each(array, |records| {
            if let [x, y, z] = fields[..] {
                positions.append(records, &[x, y, z]);
            }
        })?;
        Ok(positions)
    }

    /// All elements were found to be in the file before.
    fn capacity(&self, array: &Array) -> Result<usize, Error> {
        usize::try_from(array.count).map_err(|_| self.source.fail("too large for the memory of this machine"))
    }

    fn each(&self, array: &Array, mut each: impl FnMut(Records<'_>)) -> Result<(), Error> {
        let stride = array.scalar.size() * array.components;
        let size = array.count * stride as u64;
        let mut source = Source::open_part(self.source.path(), array.offset, size)?;
        let layout = vec![array.scalar; array.components];
        source.records(Encoding::Binary(self.endian), &layout, array.count, "an array", |bytes, endian| {
            each(Records { bytes, stride, endian });
            Ok(())
        })
    }
}

fn fields(array: &Array) -> Vec<Field> {
    let field = |i| Field { offset: i * array.scalar.size(), scalar: array.scalar };
    (0..array.components).map(field).collect()
}
