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

    /// The fourth lane replaced by that of another.
    #[inline(always)]
    pub(crate) fn with_last_of(self, other: Self) -> Self {
        // SAFETY: as in `load`.
        Self(unsafe {
            let ends = _mm_shuffle_ps::<0b11_11_10_10>(self.0, other.0);
            _mm_shuffle_ps::<0b10_00_01_00>(self.0, ends)
        })
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

    /// The fourth lane replaced by that of another.
    #[inline(always)]
    pub(crate) fn with_last_of(self, other: Self) -> Self {
        let [x, y, z, _] = self.0;
        Self([x, y, z, other.0[3]])
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
        assert_eq!(x.with_last_of(y).array(), [1.1, -2.7, 0.3, 3.3]);
    }
}
