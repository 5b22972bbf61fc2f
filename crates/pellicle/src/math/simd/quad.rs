//! Four lanes of `f32`: a point, and what travels with it in the fourth place. Every operation is correctly rounded, as those of
//! sixteen lanes are.
//!
//! Left to itself the compiler drops a fourth lane that nobody reads, and makes scalars of the third.

use std::ops::{Add, Mul, Sub};

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::*;

/// Four values.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy)]
pub(crate) struct Quad(__m128);

#[cfg(target_arch = "x86_64")]
impl Quad {
    #[inline(always)]
    pub(crate) fn load(from: &[f32; 4]) -> Self {
        // SAFETY: every x86-64 has SSE2, here and below; there are four values.
        Self(unsafe { _mm_loadu_ps(from.as_ptr()) })
    }

    /// The same in every lane.
    #[inline(always)]
    pub(crate) fn splat(v: f32) -> Self {
        // SAFETY: as in `load`.
        Self(unsafe { _mm_set1_ps(v) })
    }

    #[inline(always)]
    pub(crate) fn array(self) -> [f32; 4] {
        let mut to = [0.0; 4];
        // SAFETY: as in `load`; there is room for four.
        unsafe { _mm_storeu_ps(to.as_mut_ptr(), self.0) };
        to
    }

    /// The fourth in every lane.
    #[inline(always)]
    pub(crate) fn last(self) -> Self {
        // SAFETY: as in `load`.
        Self(unsafe { _mm_shuffle_ps::<0b11_11_11_11>(self.0, self.0) })
    }

    /// The first three lanes where those of `mask` are not 0, and all else from `other`.
    #[inline(always)]
    pub(crate) fn first_where(self, mask: Self, other: Self) -> Self {
        // SAFETY: as in `load`.
        Self(unsafe {
            let first = _mm_castsi128_ps(_mm_setr_epi32(-1, -1, -1, 0));
            let mask = _mm_and_ps(first, _mm_cmpneq_ps(mask.0, _mm_setzero_ps()));
            _mm_or_ps(_mm_and_ps(mask, self.0), _mm_andnot_ps(mask, other.0))
        })
    }

    /// The dot product of the first three lanes, summed from the first on.
    #[inline(always)]
    pub(crate) fn dot(self, other: Self) -> f32 {
        // SAFETY: as in `load`.
        unsafe {
            let products = _mm_mul_ps(self.0, other.0);
            let second = _mm_shuffle_ps::<0b01>(products, products);
            let third = _mm_shuffle_ps::<0b10>(products, products);
            _mm_cvtss_f32(_mm_add_ss(_mm_add_ss(products, second), third))
        }
    }

    /// The cross product of the first three lanes; what the fourth is means nothing.
    #[inline(always)]
    pub(crate) fn cross(self, other: Self) -> Self {
        // SAFETY: as in `load`.
        unsafe {
            let turned = |v| _mm_shuffle_ps::<0b11_00_10_01>(v, v);
            let (to, from) = (_mm_mul_ps(self.0, turned(other.0)), _mm_mul_ps(turned(self.0), other.0));
            Self(turned(_mm_sub_ps(to, from)))
        }
    }
}

#[cfg(target_arch = "x86_64")]
impl Add for Quad {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        // SAFETY: as in `load`.
        Self(unsafe { _mm_add_ps(self.0, other.0) })
    }
}

#[cfg(target_arch = "x86_64")]
impl Sub for Quad {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        // SAFETY: as in `load`.
        Self(unsafe { _mm_sub_ps(self.0, other.0) })
    }
}

#[cfg(target_arch = "x86_64")]
impl Mul for Quad {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        // SAFETY: as in `load`.
        Self(unsafe { _mm_mul_ps(self.0, other.0) })
    }
}

/// Four values.
#[cfg(not(target_arch = "x86_64"))]
#[derive(Clone, Copy)]
pub(crate) struct Quad([f32; 4]);

#[cfg(not(target_arch = "x86_64"))]
impl Quad {
    #[inline(always)]
    pub(crate) fn load(from: &[f32; 4]) -> Self {
        Self(*from)
    }

    /// The same in every lane.
    #[inline(always)]
    pub(crate) fn splat(v: f32) -> Self {
        Self([v; 4])
    }

    #[inline(always)]
    pub(crate) fn array(self) -> [f32; 4] {
        self.0
    }

    /// The fourth in every lane.
    #[inline(always)]
    pub(crate) fn last(self) -> Self {
        Self([self.0[3]; 4])
    }

    /// The first three lanes where those of `mask` are not 0, and all else from `other`.
    #[inline(always)]
    pub(crate) fn first_where(self, mask: Self, other: Self) -> Self {
        Self(std::array::from_fn(|i| if i < 3 && mask.0[i] != 0.0 { self.0[i] } else { other.0[i] }))
    }

    /// The dot product of the first three lanes, summed from the first on.
    #[inline(always)]
    pub(crate) fn dot(self, other: Self) -> f32 {
        let [x, y, z, _] = (self * other).0;
        x + y + z
    }

    /// The cross product of the first three lanes; what the fourth is means nothing.
    #[inline(always)]
    pub(crate) fn cross(self, other: Self) -> Self {
        let ([a, b, c, _], [x, y, z, _]) = (self.0, other.0);
        Self([b * z - c * y, c * x - a * z, a * y - b * x, 0.0])
    }
}

#[cfg(not(target_arch = "x86_64"))]
impl Add for Quad {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + other.0[i]))
    }
}

#[cfg(not(target_arch = "x86_64"))]
impl Sub for Quad {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] - other.0[i]))
    }
}

#[cfg(not(target_arch = "x86_64"))]
impl Mul for Quad {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] * other.0[i]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lanes_are_what_the_scalars_are() {
        let (a, b) = ([1.1f32, -2.7, 0.3, 9.0], [0.7f32, 5.1, -0.0, 3.3]);
        let (x, y) = (Quad::load(&a), Quad::load(&b));
        let each = |f: fn(f32, f32) -> f32| [0, 1, 2, 3].map(|i| f(a[i], b[i]));
        assert_eq!((x + y).array(), each(|a, b| a + b));
        assert_eq!((x - y).array(), each(|a, b| a - b));
        assert_eq!((x * y).array(), each(|a, b| a * b));
        assert_eq!(Quad::splat(2.5).array(), [2.5; 4]);
        assert_eq!(x.last().array(), [9.0; 4]);
        let mask = Quad::load(&[0.0, f32::NAN, -0.0, 1.0]);
        assert_eq!(x.first_where(mask, y).array(), [0.7, -2.7, -0.0, 3.3]);
        assert_eq!(x.dot(y), a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
        let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
        assert_eq!(x.cross(y).array()[..3], cross);
    }
}
