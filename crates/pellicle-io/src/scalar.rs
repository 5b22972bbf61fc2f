//! The number types that files hold, and their way into memory.
//!
//! Readers hand over *records*: `stride` bytes each, in which a *field* is one number at a fixed offset. Decoding goes
//! column by column, so that the type is looked up once per run of records and the inner loops are plain copies.

/// Order of the bytes of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Endian {
    Little,
    Big,
}

/// How the numbers of a file are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Encoding {
    Ascii,
    Binary(Endian),
}

/// A number type of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F16,
    F32,
    F64,
}

/// A number type in memory: what a [`Scalar`] is widened to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    I32,
    I64,
    F32,
    F64,
}

impl Scalar {
    /// Bytes that one number takes in a file.
    pub(crate) fn size(self) -> usize {
        match self {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 | Scalar::F16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::I64 | Scalar::U64 | Scalar::F64 => 8,
        }
    }

    /// The type in memory that holds every value (`u64` beyond `i64::MAX` excepted: those saturate).
    pub(crate) fn kind(self) -> Kind {
        match self {
            Scalar::I8 | Scalar::U8 | Scalar::I16 | Scalar::U16 | Scalar::I32 => Kind::I32,
            Scalar::U32 | Scalar::I64 | Scalar::U64 => Kind::I64,
            Scalar::F16 | Scalar::F32 => Kind::F32,
            Scalar::F64 => Kind::F64,
        }
    }

    /// Whether an `f32` holds every value of this type.
    pub(crate) fn fits_f32(self) -> bool {
        matches!(self, Scalar::F16 | Scalar::F32 | Scalar::I8 | Scalar::U8 | Scalar::I16 | Scalar::U16)
    }

    /// Reads a number written in decimals and appends its bytes, little-endian. `None` if it is no number, or one
    /// that this type cannot hold.
    pub(crate) fn encode(self, token: &[u8], out: &mut Vec<u8>) -> Option<()> {
        let text = std::str::from_utf8(token).ok()?;
        match self {
            Scalar::F16 => out.extend_from_slice(&half::f16::from_f32(text.parse::<f32>().ok()?).to_le_bytes()),
            Scalar::F32 => out.extend_from_slice(&text.parse::<f32>().ok()?.to_le_bytes()),
            Scalar::F64 => out.extend_from_slice(&text.parse::<f64>().ok()?.to_le_bytes()),
            Scalar::U64 => out.extend_from_slice(&text.parse::<u64>().ok()?.to_le_bytes()),
            _ => self.encode_integer(parse_integer(text)?, out)?,
        }
        Some(())
    }

    fn encode_integer(self, value: i64, out: &mut Vec<u8>) -> Option<()> {
        match self {
            Scalar::I8 => out.extend_from_slice(&i8::try_from(value).ok()?.to_le_bytes()),
            Scalar::U8 => out.extend_from_slice(&u8::try_from(value).ok()?.to_le_bytes()),
            Scalar::I16 => out.extend_from_slice(&i16::try_from(value).ok()?.to_le_bytes()),
            Scalar::U16 => out.extend_from_slice(&u16::try_from(value).ok()?.to_le_bytes()),
            Scalar::I32 => out.extend_from_slice(&i32::try_from(value).ok()?.to_le_bytes()),
            Scalar::U32 => out.extend_from_slice(&u32::try_from(value).ok()?.to_le_bytes()),
            _ => out.extend_from_slice(&value.to_le_bytes()),
        }
        Some(())
    }
}

/// An integer; some programs write the integers of an ASCII file as `3.0`.
fn parse_integer(text: &str) -> Option<i64> {
    if let Ok(value) = text.parse::<i64>() {
        return Some(value);
    }
    let value = text.parse::<f64>().ok()?;
    (value.fract() == 0.0 && value.abs() < 9.0e15).then_some(value as i64)
}

/// A number within a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Field {
    /// Bytes from the start of the record.
    pub(crate) offset: usize,
    pub(crate) scalar: Scalar,
}

/// Records as they lie in a file.
#[derive(Clone, Copy)]
pub(crate) struct Records<'a> {
    pub(crate) bytes: &'a [u8],
    /// Bytes per record, at least 1.
    pub(crate) stride: usize,
    pub(crate) endian: Endian,
}

impl Records<'_> {
    pub(crate) fn len(&self) -> usize {
        self.bytes.len() / self.stride
    }
}

/// A number type in memory that every type of a file converts to.
pub(crate) trait Target: Copy + Default {
    fn from_sample<S: Sample>(sample: S) -> Self;
}

/// A number type of a file, as Rust has it.
pub(crate) trait Sample: Copy {
    const SIZE: usize;
    fn read(bytes: &[u8], endian: Endian) -> Self;
    fn to_i32(self) -> i32;
    fn to_i64(self) -> i64;
    fn to_u64(self) -> u64;
    fn to_f32(self) -> f32;
    fn to_f64(self) -> f64;
}

impl Sample for half::f16 {
    const SIZE: usize = 2;
    #[inline(always)]
    fn read(bytes: &[u8], endian: Endian) -> Self {
        half::f16::from_bits(u16::read(bytes, endian))
    }
    #[inline(always)]
    fn to_i32(self) -> i32 {
        f32::from(self) as i32
    }
    #[inline(always)]
    fn to_i64(self) -> i64 {
        f32::from(self) as i64
    }
    #[inline(always)]
    fn to_u64(self) -> u64 {
        f32::from(self) as u64
    }
    #[inline(always)]
    fn to_f32(self) -> f32 {
        f32::from(self)
    }
    #[inline(always)]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
}

macro_rules! sample {
    ($to_i64:expr; $($t:ty),*) => {$(
        impl Sample for $t {
            const SIZE: usize = size_of::<$t>();
            #[inline(always)]
            fn read(bytes: &[u8], endian: Endian) -> Self {
                let mut raw = [0; size_of::<$t>()];
                raw.copy_from_slice(&bytes[..size_of::<$t>()]);
                match endian {
                    Endian::Little => <$t>::from_le_bytes(raw),
                    Endian::Big => <$t>::from_be_bytes(raw),
                }
            }
            #[inline(always)]
            fn to_i32(self) -> i32 { self as i32 }
            #[inline(always)]
            fn to_i64(self) -> i64 { $to_i64(self) }
            #[inline(always)]
            fn to_u64(self) -> u64 { self as u64 }
            #[inline(always)]
            fn to_f32(self) -> f32 { self as f32 }
            #[inline(always)]
            fn to_f64(self) -> f64 { self as f64 }
        }
    )*};
}
sample!(i64::from; i8, u8, i16, u16, i32, u32, i64);
sample!(|v| v as i64; f32, f64);
sample!(|v| i64::try_from(v).unwrap_or(i64::MAX); u64);

macro_rules! target {
    ($($t:ty: $convert:ident),*) => {$(
        impl Target for $t {
            #[inline(always)]
            fn from_sample<S: Sample>(sample: S) -> Self { sample.$convert() as $t }
        }
    )*};
}
// The narrow ones are exact for samples of their own type, and are used for no other.
target!(i8: to_i32, u8: to_i32, i16: to_i32, u16: to_i32, u32: to_i64, u64: to_u64);
target!(i32: to_i32, i64: to_i64, f32: to_f32, f64: to_f64);

/// Decodes `fields` of every record into `out`, which holds `fields.len()` numbers per record.
pub(crate) fn decode<D: Target>(out: &mut [D], records: Records<'_>, fields: &[Field]) {
    if let Some(scalar) = packed(records.stride, fields) {
        let numbers = Records { stride: scalar.size(), ..records };
        return decode_component(out, 0, 1, numbers, Field { offset: 0, scalar });
    }
    for (component, &field) in fields.iter().enumerate() {
        decode_component(out, component, fields.len(), records, field);
    }
}

/// The one type of records that consist of nothing but `fields`, in order.
fn packed(stride: usize, fields: &[Field]) -> Option<Scalar> {
    let first = fields.first()?.scalar;
    let size = first.size();
    let dense = fields.iter().enumerate().all(|(i, f)| f.scalar == first && f.offset == i * size);
    (dense && stride == size * fields.len()).then_some(first)
}

/// Decodes one field of every record into every `components`th number of `out`, from `component` on.
pub(crate) fn decode_component<D: Target>(
    out: &mut [D],
    component: usize,
    components: usize,
    records: Records<'_>,
    field: Field,
) {
    // Without records there is no component to begin at.
    let Some(out) = out.get_mut(component..) else { return };
    let go = match field.scalar {
        Scalar::I8 => copy::<D, i8>,
        Scalar::U8 => copy::<D, u8>,
        Scalar::I16 => copy::<D, i16>,
        Scalar::U16 => copy::<D, u16>,
        Scalar::I32 => copy::<D, i32>,
        Scalar::U32 => copy::<D, u32>,
        Scalar::I64 => copy::<D, i64>,
        Scalar::U64 => copy::<D, u64>,
        Scalar::F16 => copy::<D, half::f16>,
        Scalar::F32 => copy::<D, f32>,
        Scalar::F64 => copy::<D, f64>,
    };
    go(out, components, records, field.offset);
}

fn copy<D: Target, S: Sample>(out: &mut [D], step: usize, records: Records<'_>, offset: usize) {
    match records.endian {
        Endian::Little => copy_ordered::<D, S>(out, step, records, offset, Endian::Little),
        Endian::Big => copy_ordered::<D, S>(out, step, records, offset, Endian::Big),
    }
}

/// Inlined once per byte order, so that the order is a constant in the loop.
#[inline(always)]
fn copy_ordered<D: Target, S: Sample>(out: &mut [D], step: usize, records: Records<'_>, offset: usize, endian: Endian) {
    if step == 1 && records.stride == S::SIZE {
        for (to, from) in out.iter_mut().zip(records.bytes.chunks_exact(S::SIZE)) {
            *to = D::from_sample(S::read(from, endian));
        }
        return;
    }
    for (to, from) in out.iter_mut().step_by(step).zip(records.bytes.chunks_exact(records.stride)) {
        *to = D::from_sample(S::read(&from[offset..offset + S::SIZE], endian));
    }
}

/// Reads one number as an integer: an index or the length of a list. Floating point numbers are cut.
pub(crate) fn integer(bytes: &[u8], scalar: Scalar, endian: Endian) -> i64 {
    let mut out = [0i64];
    let records = Records { bytes, stride: scalar.size(), endian };
    decode_component(&mut out, 0, 1, records, Field { offset: 0, scalar });
    out[0]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_of_mixed_types_land_in_their_components_in_both_byte_orders() {
        let (mut little, mut big) = (Vec::new(), Vec::new());
        for i in 0..3u16 {
            little.extend_from_slice(&i.to_le_bytes());
            little.extend_from_slice(&(f64::from(i) + 0.5).to_le_bytes());
            big.extend_from_slice(&i.to_be_bytes());
            big.extend_from_slice(&(f64::from(i) + 0.5).to_be_bytes());
        }
        let fields = [Field { offset: 2, scalar: Scalar::F64 }, Field { offset: 0, scalar: Scalar::U16 }];
        for (bytes, endian) in [(little, Endian::Little), (big, Endian::Big)] {
            let mut out = [0f32; 6];
            decode(&mut out, Records { bytes: &bytes, stride: 10, endian }, &fields);
            assert_eq!(out, [0.5, 0.0, 1.5, 1.0, 2.5, 2.0]);
        }
    }

    #[test]
    fn no_records_are_no_work() {
        let fields = [Field { offset: 0, scalar: Scalar::F32 }, Field { offset: 8, scalar: Scalar::F32 }];
        decode(&mut [0f32; 0], Records { bytes: &[], stride: 12, endian: Endian::Little }, &fields);
    }

    #[test]
    fn decimals_that_a_type_cannot_hold_are_refused() {
        let mut out = Vec::new();
        assert!(Scalar::U8.encode(b"256", &mut out).is_none());
        assert!(Scalar::U32.encode(b"-1", &mut out).is_none());
        assert!(Scalar::I32.encode(b"1.5", &mut out).is_none());
        assert!(Scalar::F32.encode(b"1.5x", &mut out).is_none());
        assert!(Scalar::F32.encode(b"", &mut out).is_none());
        assert!(out.is_empty());
        assert!(Scalar::I32.encode(b"3.0", &mut out).is_some());
        assert_eq!(out, 3i32.to_le_bytes());
    }

    #[test]
    fn unsigned_values_beyond_i64_saturate() {
        assert_eq!(integer(&u64::MAX.to_be_bytes(), Scalar::U64, Endian::Big), i64::MAX);
    }
}
