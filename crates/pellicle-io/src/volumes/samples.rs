//! The samples of a volume, in the type that the file has.
//!
//! A scan of bytes stays one of bytes: a volume is the largest thing in memory, and the extractors take every type. Only
//! half-precision numbers are widened, to `f32`, which holds them exactly.

use crate::scalar::{Field, Records, Sample, Scalar, decode_component};

/// Samples of one number each.
#[derive(Debug, Clone, PartialEq)]
pub enum Samples {
    /// Signed, 8 bits.
    I8(Vec<i8>),
    /// Unsigned, 8 bits.
    U8(Vec<u8>),
    /// Signed, 16 bits.
    I16(Vec<i16>),
    /// Unsigned, 16 bits.
    U16(Vec<u16>),
    /// Signed, 32 bits.
    I32(Vec<i32>),
    /// Unsigned, 32 bits.
    U32(Vec<u32>),
    /// Signed, 64 bits.
    I64(Vec<i64>),
    /// Unsigned, 64 bits.
    U64(Vec<u64>),
    /// Single precision.
    F32(Vec<f32>),
    /// Double precision.
    F64(Vec<f64>),
}

/// The type of samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SampleType {
    /// Signed, 8 bits.
    I8,
    /// Unsigned, 8 bits.
    U8,
    /// Signed, 16 bits.
    I16,
    /// Unsigned, 16 bits.
    U16,
    /// Signed, 32 bits.
    I32,
    /// Unsigned, 32 bits.
    U32,
    /// Signed, 64 bits.
    I64,
    /// Unsigned, 64 bits.
    U64,
    /// Half precision, in files only: in memory it is [`F32`](Self::F32).
    F16,
    /// Single precision.
    F32,
    /// Double precision.
    F64,
}

/// Runs the same code on the vector within, whatever its type.
#[macro_export]
macro_rules! each_sample_type {
    ($samples:expr, $values:ident => $body:expr) => {
        match $samples {
            $crate::Samples::I8($values) => $body,
            $crate::Samples::U8($values) => $body,
            $crate::Samples::I16($values) => $body,
            $crate::Samples::U16($values) => $body,
            $crate::Samples::I32($values) => $body,
            $crate::Samples::U32($values) => $body,
            $crate::Samples::I64($values) => $body,
            $crate::Samples::U64($values) => $body,
            $crate::Samples::F32($values) => $body,
            $crate::Samples::F64($values) => $body,
        }
    };
}

impl SampleType {
    /// Every type, with its short name.
    const NAMES: [(SampleType, &'static str); 11] = [
        (SampleType::I8, "i8"),
        (SampleType::U8, "u8"),
        (SampleType::I16, "i16"),
        (SampleType::U16, "u16"),
        (SampleType::I32, "i32"),
        (SampleType::U32, "u32"),
        (SampleType::I64, "i64"),
        (SampleType::U64, "u64"),
        (SampleType::F16, "f16"),
        (SampleType::F32, "f32"),
        (SampleType::F64, "f64"),
    ];

    /// Its short name, such as `u8` or `f32`.
    pub fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(kind, _)| *kind == self).map_or("", |(_, name)| name)
    }

    /// The type of this short name.
    pub fn by_name(name: &str) -> Option<SampleType> {
        Self::NAMES.iter().find(|(_, known)| *known == name).map(|(kind, _)| *kind)
    }

    /// Bytes of a sample in memory.
    pub fn bytes(self) -> usize {
        match self {
            SampleType::F16 => 4,
            other => Scalar::from(other).size(),
        }
    }
}

impl From<SampleType> for Scalar {
    fn from(kind: SampleType) -> Scalar {
        match kind {
            SampleType::I8 => Scalar::I8,
            SampleType::U8 => Scalar::U8,
            SampleType::I16 => Scalar::I16,
            SampleType::U16 => Scalar::U16,
            SampleType::I32 => Scalar::I32,
            SampleType::U32 => Scalar::U32,
            SampleType::I64 => Scalar::I64,
            SampleType::U64 => Scalar::U64,
            SampleType::F16 => Scalar::F16,
            SampleType::F32 => Scalar::F32,
            SampleType::F64 => Scalar::F64,
        }
    }
}

impl From<Scalar> for SampleType {
    fn from(scalar: Scalar) -> SampleType {
        match scalar {
            Scalar::I8 => SampleType::I8,
            Scalar::U8 => SampleType::U8,
            Scalar::I16 => SampleType::I16,
            Scalar::U16 => SampleType::U16,
            Scalar::I32 => SampleType::I32,
            Scalar::U32 => SampleType::U32,
            Scalar::I64 => SampleType::I64,
            Scalar::U64 => SampleType::U64,
            Scalar::F16 => SampleType::F16,
            Scalar::F32 => SampleType::F32,
            Scalar::F64 => SampleType::F64,
        }
    }
}

impl Samples {
    /// No samples, with room for so many.
    pub fn with_capacity(kind: SampleType, capacity: usize) -> Samples {
        match kind {
            SampleType::I8 => Samples::I8(Vec::with_capacity(capacity)),
            SampleType::U8 => Samples::U8(Vec::with_capacity(capacity)),
            SampleType::I16 => Samples::I16(Vec::with_capacity(capacity)),
            SampleType::U16 => Samples::U16(Vec::with_capacity(capacity)),
            SampleType::I32 => Samples::I32(Vec::with_capacity(capacity)),
            SampleType::U32 => Samples::U32(Vec::with_capacity(capacity)),
            SampleType::I64 => Samples::I64(Vec::with_capacity(capacity)),
            SampleType::U64 => Samples::U64(Vec::with_capacity(capacity)),
            SampleType::F16 | SampleType::F32 => Samples::F32(Vec::with_capacity(capacity)),
            SampleType::F64 => Samples::F64(Vec::with_capacity(capacity)),
        }
    }

    /// The type in memory.
    pub fn kind(&self) -> SampleType {
        match self {
            Samples::I8(_) => SampleType::I8,
            Samples::U8(_) => SampleType::U8,
            Samples::I16(_) => SampleType::I16,
            Samples::U16(_) => SampleType::U16,
            Samples::I32(_) => SampleType::I32,
            Samples::U32(_) => SampleType::U32,
            Samples::I64(_) => SampleType::I64,
            Samples::U64(_) => SampleType::U64,
            Samples::F32(_) => SampleType::F32,
            Samples::F64(_) => SampleType::F64,
        }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        each_sample_type!(self, values => values.len())
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The sample at this place in memory, in double precision: integers beyond 2^53 are rounded.
    pub fn get_f64(&self, i: usize) -> f64 {
        each_sample_type!(self, values => values[i].to_f64())
    }

    /// Forgets the samples and keeps the memory.
    pub fn clear(&mut self) {
        each_sample_type!(self, values => values.clear());
    }

    /// Forgets the first samples.
    pub fn drop_first(&mut self, count: usize) {
        each_sample_type!(self, values => drop(values.drain(..count)));
    }

    /// Gives back memory that was reserved and is not used.
    pub(super) fn shrink(&mut self) {
        each_sample_type!(self, values => values.shrink_to_fit());
    }

    /// Appends a field of each record, which is of this type (or of half precision for `f32`).
    pub(super) fn append(&mut self, records: Records<'_>, field: Field) {
        let more = records.len();
        each_sample_type!(self, values => {
            let old = values.len();
            values.resize(old + more, Default::default());
            decode_component(&mut values[old..], 0, 1, records, field);
        });
    }

    /// Turns the order of the samples from the `from`th on around: `-x` for floating point numbers, `!x` for integers,
    /// which neither leaves their type. Returns slope and intercept of that map.
    pub(super) fn reverse_order(&mut self, from: usize) -> [f64; 2] {
        macro_rules! not {
            ($values:expr, $most:expr) => {{
                $values[from..].iter_mut().for_each(|value| *value = !*value);
                [-1.0, $most]
            }};
        }
        match self {
            Samples::I8(values) => not!(values, -1.0),
            Samples::I16(values) => not!(values, -1.0),
            Samples::I32(values) => not!(values, -1.0),
            Samples::I64(values) => not!(values, -1.0),
            Samples::U8(values) => not!(values, f64::from(u8::MAX)),
            Samples::U16(values) => not!(values, f64::from(u16::MAX)),
            Samples::U32(values) => not!(values, f64::from(u32::MAX)),
            Samples::U64(values) => not!(values, u64::MAX as f64),
            Samples::F32(values) => {
                values[from..].iter_mut().for_each(|value| *value = -*value);
                [-1.0, 0.0]
            }
            Samples::F64(values) => {
                values[from..].iter_mut().for_each(|value| *value = -*value);
                [-1.0, 0.0]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turning_the_order_around_is_the_map_that_it_tells() {
        let kinds = SampleType::NAMES.map(|(kind, _)| kind);
        for kind in kinds.into_iter().filter(|&kind| kind != SampleType::F16) {
            let bytes: Vec<u8> = (0..64u8).map(|i| i.wrapping_mul(37) & 0x3f).collect();
            let mut samples = Samples::with_capacity(kind, 0);
            let scalar = Scalar::from(kind);
            let records = Records { bytes: &bytes, stride: scalar.size(), endian: crate::scalar::Endian::Little };
            samples.append(records, Field { offset: 0, scalar });
            let before: Vec<f64> = (0..samples.len()).map(|i| samples.get_f64(i)).collect();
            let [slope, intercept] = samples.reverse_order(1);
            assert_eq!(samples.get_f64(0), before[0], "{kind:?}");
            for (i, &value) in before.iter().enumerate().skip(1) {
                let mapped = slope * value + intercept;
                assert!((samples.get_f64(i) - mapped).abs() <= 4.0 * f64::EPSILON * mapped.abs(), "{kind:?}");
            }
        }
    }

    #[test]
    fn types_have_names_that_lead_back() {
        for (kind, name) in SampleType::NAMES {
            assert_eq!((SampleType::by_name(name), kind.name()), (Some(kind), name));
        }
        assert_eq!(SampleType::by_name("float"), None);
    }
}
