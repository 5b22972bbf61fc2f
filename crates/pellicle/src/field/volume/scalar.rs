//! The types a sample may have, and how each is compared with an isovalue without rounding.
//!
//! Source: this project.

use crate::math::simd::{LANES, Simd};

/// Samples of any of the ten types.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub enum Samples<'a> {
    /// 8-bit unsigned.
    U8(&'a [u8]),
    /// 8-bit signed.
    I8(&'a [i8]),
    /// 16-bit unsigned.
    U16(&'a [u16]),
    /// 16-bit signed.
    I16(&'a [i16]),
    /// 32-bit unsigned.
    U32(&'a [u32]),
    /// 32-bit signed.
    I32(&'a [i32]),
    /// 64-bit unsigned.
    U64(&'a [u64]),
    /// 64-bit signed.
    I64(&'a [i64]),
    /// Single precision.
    F32(&'a [f32]),
    /// Double precision.
    F64(&'a [f64]),
}

/// Evaluates an expression with `$name` bound to the slice of whatever type the samples have.
macro_rules! with_samples {
    ($samples:expr, $name:ident => $body:expr) => {
        match $samples {
            $crate::field::volume::Samples::U8($name) => $body,
            $crate::field::volume::Samples::I8($name) => $body,
            $crate::field::volume::Samples::U16($name) => $body,
            $crate::field::volume::Samples::I16($name) => $body,
            $crate::field::volume::Samples::U32($name) => $body,
            $crate::field::volume::Samples::I32($name) => $body,
            $crate::field::volume::Samples::U64($name) => $body,
            $crate::field::volume::Samples::I64($name) => $body,
            $crate::field::volume::Samples::F32($name) => $body,
            $crate::field::volume::Samples::F64($name) => $body,
        }
    };
}
pub(crate) use with_samples;

impl Samples<'_> {
    /// Number of elements.
    pub fn len(&self) -> usize {
        with_samples!(self, s => s.len())
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// One element as a double: exact but for 64-bit integers, which are rounded to the nearest.
    pub fn value(&self, element: usize) -> f64 {
        with_samples!(self, s => s[element].to_f64())
    }
}

/// The samples that are inside, in their own type.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Cut<T> {
    /// Every number is.
    All,
    /// Those greater than this one are.
    Above(T),
}

/// A type of samples.
pub(crate) trait Scalar: Copy + Send + Sync + PartialOrd + 'static {
    const ZERO: Self;

    /// As a double.
    fn to_f64(self) -> f64;

    /// The label that it names: a whole number, none for NaN.
    ///
    /// # Errors
    /// The value, where it is not whole.
    fn to_label(self) -> Result<Option<i128>, f64>;

    /// The cut that is true for exactly the numbers greater than `iso`, which must be finite.
    fn cut(iso: f64) -> Cut<Self>;

    /// Bit set where `v > above`.
    #[inline(always)]
    fn greater<S: Simd>(s: S, v: &[Self; LANES], above: Self) -> u16 {
        // A comparison and a choice between constants: what every compiler turns into vector code, for every type.
        let mut truth = [0.0f32; LANES];
        for i in 0..LANES {
            truth[i] = if v[i] > above { 1.0 } else { 0.0 };
        }
        s.gt(s.load(&truth), s.splat(0.5))
    }
}

macro_rules! integer {
    ($($type:ty),*) => {$(
        impl Scalar for $type {
            const ZERO: Self = 0;

            #[inline(always)]
            fn to_f64(self) -> f64 {
                self as f64
            }

            #[inline(always)]
            fn to_label(self) -> Result<Option<i128>, f64> {
                Ok(Some(self.into()))
            }

            fn cut(iso: f64) -> Cut<Self> {
                // For integers, v > iso is v > floor(iso). The cast saturates, which is right above; MIN as a double is exact.
                if iso < <$type>::MIN as f64 { Cut::All } else { Cut::Above(iso.floor() as $type) }
            }
        }
    )*};
}
integer!(u8, i8, u16, i16, u32, i32, u64, i64);

impl Scalar for f32 {
    const ZERO: Self = 0.0;

    #[inline(always)]
    fn to_f64(self) -> f64 {
        self.into()
    }

    fn to_label(self) -> Result<Option<i128>, f64> {
        f64::from(self).to_label()
    }

    fn cut(iso: f64) -> Cut<Self> {
        // For single precision, v > iso is v > the greatest single that is not above iso.
        let nearest = iso as f32;
        Cut::Above(if f64::from(nearest) > iso { nearest.next_down() } else { nearest })
    }

    #[inline(always)]
    fn greater<S: Simd>(s: S, v: &[f32; LANES], above: f32) -> u16 {
        s.gt(s.load(v), s.splat(above))
    }
}

impl Scalar for f64 {
    const ZERO: Self = 0.0;

    #[inline(always)]
    fn to_f64(self) -> f64 {
        self
    }

    fn to_label(self) -> Result<Option<i128>, f64> {
        // Beyond 64 bits they are no names, infinities among them.
        match self {
            _ if self.is_nan() => Ok(None),
            _ if self.fract() == 0.0 && self.abs() < 1.8e19 => Ok(Some(self as i128)),
            _ => Err(self),
        }
    }

    fn cut(iso: f64) -> Cut<Self> {
        Cut::Above(iso)
    }
}

macro_rules! from_slices {
    ($($variant:ident $type:ty),*) => {$(
        impl<'a> From<&'a [$type]> for Samples<'a> {
            fn from(samples: &'a [$type]) -> Self {
                Self::$variant(samples)
            }
        }
        impl<'a> From<&'a Vec<$type>> for Samples<'a> {
            fn from(samples: &'a Vec<$type>) -> Self {
                Self::$variant(samples)
            }
        }
        impl<'a, const N: usize> From<&'a [$type; N]> for Samples<'a> {
            fn from(samples: &'a [$type; N]) -> Self {
                Self::$variant(samples)
            }
        }
    )*};
}
from_slices!(U8 u8, I8 i8, U16 u16, I16 i16, U32 u32, I32 i32, U64 u64, I64 i64, F32 f32, F64 f64);
