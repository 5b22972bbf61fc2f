//! What writers write: numbers per point, borrowed from a mesh or from particles, and their way into bytes.
//!
//! A writer sees no difference between the vertices of a mesh and particles: both are [`Points`], positions and further
//! columns. Numbers become bytes a range at a time, so several threads can write one array.

use std::ops::Range;

use pellicle::Mesh;
use rayon::prelude::*;

use crate::formats::catalog::Format;
use crate::formats::names;
use crate::particles::{AttributeValues, Particles, PositionData};
use crate::scalar::{Endian, Scalar};

/// Numbers that a thread looks at together.
const PART: usize = 1 << 14;

/// An array of numbers that is written to a file.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Values<'a> {
    U32(&'a [u32]),
    I32(&'a [i32]),
    I64(&'a [i64]),
    F32(&'a [f32]),
    F64(&'a [f64]),
    /// Triples in single precision that count from an origin; written as world positions in double precision.
    World(&'a [f32], [f64; 3]),
    /// In double precision in memory, written in single precision.
    Narrowed(&'a [f64]),
    /// World positions, written in single precision.
    NarrowedWorld(&'a [f32], [f64; 3]),
    /// Integers of 64 bits that fit in 32, and are written so.
    Short(&'a [i64]),
    /// Integers of 64 bits that a double precision number holds, and are written so.
    Rounded(&'a [i64]),
    /// In single precision in memory, written in double precision.
    Widened(&'a [f32]),
    /// Parts of a colour from 0 to 1, written as bytes up to 255. What is beyond is cut off.
    Unit(&'a [f32]),
    /// The same in double precision in memory.
    UnitDouble(&'a [f64]),
    /// `start`, `start + step`, …: the given number of them, of 32 bits.
    Count {
        start: u32,
        step: u32,
        len: usize,
    },
    /// The same of 64 bits.
    LongCount {
        start: u64,
        step: u64,
        len: usize,
    },
    /// One byte, again and again.
    Repeated(u8, usize),
    /// One number in single precision, again and again.
    Constant(f32, usize),
}

impl<'a> Values<'a> {
    /// The type in the file.
    pub(crate) fn scalar(self) -> Scalar {
        match self {
            Values::Repeated(..) | Values::Unit(_) | Values::UnitDouble(_) => Scalar::U8,
            Values::U32(_) | Values::Count { .. } => Scalar::U32,
            Values::I32(_) | Values::Short(_) => Scalar::I32,
            Values::I64(_) | Values::LongCount { .. } => Scalar::I64,
            Values::F32(_) | Values::Narrowed(_) | Values::NarrowedWorld(..) | Values::Constant(..) => Scalar::F32,
            Values::F64(_) | Values::World(..) | Values::Rounded(_) | Values::Widened(_) => Scalar::F64,
        }
    }

    pub(crate) fn len(self) -> usize {
        match self {
            Values::U32(v) => v.len(),
            Values::I32(v) => v.len(),
            Values::I64(v) | Values::Short(v) | Values::Rounded(v) => v.len(),
            Values::F32(v)
            | Values::World(v, _)
            | Values::NarrowedWorld(v, _)
            | Values::Widened(v)
            | Values::Unit(v) => v.len(),
            Values::F64(v) | Values::Narrowed(v) | Values::UnitDouble(v) => v.len(),
            Values::Count { len, .. } | Values::LongCount { len, .. } => len,
            Values::Repeated(_, len) | Values::Constant(_, len) => len,
        }
    }

    /// Bytes in the file.
    pub(crate) fn bytes(self) -> u64 {
        self.len() as u64 * self.scalar().size() as u64
    }

    /// The bytes themselves, where memory has them as a file of this byte order does.
    pub(crate) fn plain(self, endian: Endian) -> Option<&'a [u8]> {
        if (endian == Endian::Little) != cfg!(target_endian = "little") {
            return None;
        }
        match self {
            Values::U32(v) => Some(bytemuck::cast_slice(v)),
            Values::I32(v) => Some(bytemuck::cast_slice(v)),
            Values::I64(v) => Some(bytemuck::cast_slice(v)),
            Values::F32(v) => Some(bytemuck::cast_slice(v)),
            Values::F64(v) => Some(bytemuck::cast_slice(v)),
            _ => None,
        }
    }

    /// Puts the numbers of `range` into `to`: `group` of them at the start of every `stride` bytes.
    pub(crate) fn put(self, range: Range<usize>, endian: Endian, to: &mut [u8], stride: usize, group: usize) {
        match endian {
            Endian::Little => self.put_ordered::<true>(range, to, stride, group),
            Endian::Big => self.put_ordered::<false>(range, to, stride, group),
        }
    }

    fn put_ordered<const LITTLE: bool>(self, range: Range<usize>, to: &mut [u8], stride: usize, group: usize) {
        macro_rules! copy {
            ($numbers:expr) => {
                scatter(to, stride, group, $numbers.map(|v| if LITTLE { v.to_le_bytes() } else { v.to_be_bytes() }))
            };
        }
        let first = range.start;
        macro_rules! world {
            ($v:expr, $origin:expr) => {
                $v[range].iter().enumerate().map(|(i, &x)| $origin[(first + i) % 3] + f64::from(x))
            };
        }
        match self {
            Values::U32(v) => copy!(v[range].iter()),
            Values::I32(v) => copy!(v[range].iter()),
            Values::I64(v) => copy!(v[range].iter()),
            Values::F32(v) => copy!(v[range].iter()),
            Values::F64(v) => copy!(v[range].iter()),
            Values::World(v, origin) => copy!(world!(v, origin)),
            Values::NarrowedWorld(v, origin) => copy!(world!(v, origin).map(|x| x as f32)),
            Values::Narrowed(v) => copy!(v[range].iter().map(|&x| x as f32)),
            Values::Widened(v) => copy!(v[range].iter().map(|&x| f64::from(x))),
            Values::Short(v) => copy!(v[range].iter().map(|&x| x as i32)),
            Values::Rounded(v) => copy!(v[range].iter().map(|&x| x as f64)),
            Values::Unit(v) => copy!(v[range].iter().map(|&x| unit_to_byte(x))),
            Values::UnitDouble(v) => copy!(v[range].iter().map(|&x| unit_to_byte(x as f32))),
            Values::Count { start, step, .. } => copy!(range.map(|i| start + step * i as u32)),
            Values::LongCount { start, step, .. } => copy!(range.map(|i| start + step * i as u64)),
            Values::Repeated(byte, _) => copy!(range.map(|_| byte)),
            Values::Constant(value, _) => copy!(range.map(|_| value)),
        }
    }

    /// A number as text: the fewest digits that read back to the same value.
    pub(crate) fn show(self, i: usize, out: &mut String) {
        use std::fmt::Write;
        // Writing to a string cannot fail.
        let _ = match self {
            Values::U32(v) => write!(out, "{}", v[i]),
            Values::I32(v) => write!(out, "{}", v[i]),
            Values::I64(v) | Values::Short(v) | Values::Rounded(v) => write!(out, "{}", v[i]),
            Values::F32(v) | Values::Widened(v) => write!(out, "{:?}", v[i]),
            Values::F64(v) => write!(out, "{:?}", v[i]),
            Values::World(v, origin) => write!(out, "{:?}", origin[i % 3] + f64::from(v[i])),
            Values::Narrowed(v) => write!(out, "{:?}", v[i] as f32),
            Values::NarrowedWorld(v, origin) => write!(out, "{:?}", (origin[i % 3] + f64::from(v[i])) as f32),
            Values::Unit(v) => write!(out, "{}", unit_to_byte(v[i])),
            Values::UnitDouble(v) => write!(out, "{}", unit_to_byte(v[i] as f32)),
            Values::Count { start, step, .. } => write!(out, "{}", start + step * i as u32),
            Values::LongCount { start, step, .. } => write!(out, "{}", start + step * i as u64),
            Values::Repeated(byte, _) => write!(out, "{byte}"),
            Values::Constant(value, _) => write!(out, "{value:?}"),
        };
    }

    /// The index of the first number that is NaN or infinite.
    pub(crate) fn first_not_finite(self) -> Option<usize> {
        match self {
            Values::F32(v) | Values::World(v, _) | Values::NarrowedWorld(v, _) | Values::Widened(v) => {
                first(v, |x| !x.is_finite())
            }
            Values::F64(v) | Values::Narrowed(v) => first(v, |x| !x.is_finite()),
            _ => None,
        }
    }

    /// Parts of a colour as bytes. Integers stay.
    pub(crate) fn color_bytes(self) -> Values<'a> {
        match self {
            Values::F32(v) => Values::Unit(v),
            Values::F64(v) => Values::UnitDouble(v),
            other => other,
        }
    }

    /// With floating point numbers in single precision. Integers stay.
    pub(crate) fn narrowed(self) -> Values<'a> {
        match self {
            Values::F64(v) => Values::Narrowed(v),
            Values::World(v, origin) => Values::NarrowedWorld(v, origin),
            other => other,
        }
    }

    /// With integers of 64 bits as 32 bits where all fit.
    pub(crate) fn shortened(self) -> Values<'a> {
        match self {
            Values::I64(v) if v.iter().all(|&x| i32::try_from(x).is_ok()) => Values::Short(v),
            other => other,
        }
    }

    /// With integers of 64 bits as `f64` where that holds all of them.
    pub(crate) fn rounded(self) -> Values<'a> {
        match self {
            Values::I64(v) if v.iter().all(|x| x.unsigned_abs() <= 1 << 53) => Values::Rounded(v),
            other => other,
        }
    }
}

/// The byte that stands for a part of a colour; NaN is 0.
pub(crate) fn unit_to_byte(part: f32) -> u8 {
    (part * 255.0).round() as u8
}

/// Whether bytes cannot tell these parts of colours, so that something is lost.
pub(crate) fn exceeds_bytes(parts: &[f32]) -> bool {
    first(parts, |&part| f32::from(unit_to_byte(part)) / 255.0 != part).is_some()
}

/// The index of the first item that `is_wanted`. Whole parts are asked, since a question an item costs more than the item.
pub(crate) fn first<T: Sync>(items: &[T], is_wanted: impl Fn(&T) -> bool + Sync) -> Option<usize> {
    // Without an early end, so that the loop is one of vectors.
    let is_in = |part: &[T]| part.iter().fold(false, |found, item| found | is_wanted(item));
    let part = items.par_chunks(PART).position_first(is_in)?;
    items.iter().skip(part * PART).position(is_wanted).map(|at| part * PART + at)
}

/// Lays numbers out, `group` of them at the start of every `stride` bytes.
#[inline(always)]
fn scatter<const N: usize>(to: &mut [u8], stride: usize, group: usize, mut numbers: impl Iterator<Item = [u8; N]>) {
    if stride == N * group {
        for (to, bytes) in to.as_chunks_mut::<N>().0.iter_mut().zip(numbers) {
            *to = bytes;
        }
        return;
    }
    for record in to.chunks_mut(stride) {
        for (to, bytes) in record.as_chunks_mut::<N>().0.iter_mut().take(group).zip(&mut numbers) {
            *to = bytes;
        }
    }
}

/// Values per point.
#[derive(Debug, Clone)]
pub(crate) struct Column<'a> {
    /// The name in memory.
    pub(crate) name: &'a str,
    /// Numbers per point.
    pub(crate) components: usize,
    pub(crate) values: Values<'a>,
}

/// Points of a mesh or particles.
#[derive(Debug, Clone)]
pub(crate) struct Points<'a> {
    pub(crate) count: usize,
    /// Three numbers per point.
    pub(crate) positions: Values<'a>,
    /// Normals of a mesh come first, as `normal`.
    pub(crate) columns: Vec<Column<'a>>,
}

impl<'a> Points<'a> {
    /// Positions in single precision if the mesh's origin is zero.
    pub(crate) fn of_mesh(mesh: &'a Mesh) -> Points<'a> {
        let offsets = mesh.vertices.as_flattened();
        let positions =
            if mesh.origin == [0.0; 3] { Values::F32(offsets) } else { Values::World(offsets, mesh.origin) };
        let mut columns = Vec::new();
        if !mesh.normals.is_empty() {
            let values = Values::F32(mesh.normals.as_flattened());
            columns.push(Column { name: "normal", components: 3, values });
        }
        let attributes = mesh.attributes.iter();
        columns.extend(attributes.map(|a| Column {
            name: &a.name,
            components: a.components,
            values: Values::F32(&a.values),
        }));
        columns.retain(|column| column.components > 0);
        Points { count: mesh.vertices.len(), positions, columns }
    }

    pub(crate) fn of_particles(particles: &'a Particles) -> Points<'a> {
        let positions = match &particles.positions {
            PositionData::F32(p) => Values::F32(p.as_flattened()),
            PositionData::F64(p) => Values::F64(p.as_flattened()),
        };
        let columns = particles.attributes.iter().filter(|a| a.components > 0).map(|a| {
            let values = match &a.values {
                AttributeValues::F32(v) => Values::F32(v),
                AttributeValues::F64(v) => Values::F64(v),
                AttributeValues::I32(v) => Values::I32(v),
                AttributeValues::I64(v) => Values::I64(v),
            };
            Column { name: &a.name, components: a.components, values }
        });
        Points { count: particles.positions.len(), positions, columns: columns.collect() }
    }

    /// The names of the columns in a file of `format`, each different from the others and from `taken`.
    pub(crate) fn names(&self, format: Format, taken: &[&str]) -> Vec<String> {
        let mut used: Vec<String> = taken.iter().map(|&name| name.to_owned()).collect();
        let names = self.columns.iter().map(|column| {
            let name = names::foreign(format, column.name, column.components);
            let free = (2..).map(|i| format!("{name}_{i}"));
            let name = std::iter::once(name.clone()).chain(free).find(|n| !used.contains(n)).unwrap_or(name);
            used.push(name.clone());
            name
        });
        names.collect()
    }
}

/// Points as records: the numbers of one point lie together, positions first.
#[derive(Debug)]
pub(crate) struct Records<'a> {
    /// Numbers per record, and their values.
    parts: Vec<(usize, Values<'a>)>,
    /// Bytes per record.
    pub(crate) stride: usize,
}

impl<'a> Records<'a> {
    pub(crate) fn new(parts: Vec<(usize, Values<'a>)>) -> Records<'a> {
        let stride = parts.iter().map(|(group, values)| group * values.scalar().size()).sum();
        Records { parts, stride }
    }

    /// The bytes of a range of records.
    pub(crate) fn put(&self, range: Range<usize>, endian: Endian, to: &mut Vec<u8>) {
        to.clear();
        to.resize(range.len() * self.stride, 0);
        let mut at = 0;
        for &(group, values) in &self.parts {
            if let Some(to) = to.get_mut(at..) {
                values.put(range.start * group..range.end * group, endian, to, self.stride, group);
            }
            at += group * values.scalar().size();
        }
    }
}
