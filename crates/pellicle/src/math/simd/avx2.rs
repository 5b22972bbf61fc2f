//! Sixteen lanes as two AVX2 registers.

use std::arch::x86_64::*;

use super::{Kernel, LANES, Simd};

/// Proof that the machine has AVX2, BMI1, BMI2 and POPCNT.
#[derive(Clone, Copy, Debug)]
pub struct Avx2(());

impl Avx2 {
    pub(crate) fn new() -> Option<Self> {
        let has = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("popcnt");
        has.then_some(Self(()))
    }
}

#[target_feature(enable = "avx2,bmi1,bmi2,popcnt")]
fn enabled<K: Kernel>(simd: Avx2, kernel: K) -> K::Output {
    kernel.run(simd)
}

/// For each mask of 8 lanes, the lanes that are set, in order: the permutation that moves them to the front. One byte an
/// entry, lane 0 lowest.
const FRONT: [u64; 256] = {
    let mut table = [0u64; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut lane, mut n) = (0, 0);
        while lane < 8 {
            if mask >> lane & 1 != 0 {
                table[mask] |= (lane as u64) << (8 * n);
                n += 1;
            }
            lane += 1;
        }
        mask += 1;
    }
    table
};

#[inline(always)]
fn front(v: __m256, mask: u8) -> __m256 {
    // SAFETY: called only by methods of `Avx2`, a value of which exists only where the instructions do.
    unsafe {
        let lanes = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(FRONT[mask as usize] as i64));
        _mm256_permutevar8x32_ps(v, lanes)
    }
}

/// Sum of eight lanes, 4 apart first, then 2, 1.
#[inline]
#[target_feature(enable = "avx")]
pub(super) fn sum8(v: __m256) -> f32 {
    let four = _mm_add_ps(_mm256_castps256_ps128(v), _mm256_extractf128_ps::<1>(v));
    let two = _mm_add_ps(four, _mm_movehl_ps(four, four));
    _mm_cvtss_f32(_mm_add_ss(two, _mm_movehdup_ps(two)))
}

type F = (__m256, __m256);

impl Simd for Avx2 {
    type F = F;
    type U = [__m256i; 2];
    const IS_WIDE: bool = true;

    #[inline(always)]
    fn splat(self, v: f32) -> F {
        // SAFETY: a value of this type exists only where the instructions do.
        let v = unsafe { _mm256_set1_ps(v) };
        (v, v)
    }

    #[inline(always)]
    fn load(self, from: &[f32]) -> F {
        let from = &from[..LANES];
        // SAFETY: as in `splat`; the slice has 16 values.
        unsafe { (_mm256_loadu_ps(from.as_ptr()), _mm256_loadu_ps(from[8..].as_ptr())) }
    }

    #[inline(always)]
    fn store(self, v: F, to: &mut [f32]) {
        let to = &mut to[..LANES];
        // SAFETY: as in `load`.
        unsafe {
            _mm256_storeu_ps(to.as_mut_ptr(), v.0);
            _mm256_storeu_ps(to[8..].as_mut_ptr(), v.1);
        }
    }

    #[inline(always)]
    fn store_eight(self, v: F, to: &mut [f32]) {
        // SAFETY: as in `load`; the slice has 8 places.
        unsafe { _mm256_storeu_ps(to[..8].as_mut_ptr(), v.0) }
    }

    #[inline(always)]
    fn add(self, a: F, b: F) -> F {
        // SAFETY: as in `splat`.
        unsafe { (_mm256_add_ps(a.0, b.0), _mm256_add_ps(a.1, b.1)) }
    }

    #[inline(always)]
    fn sub(self, a: F, b: F) -> F {
        // SAFETY: as in `splat`.
        unsafe { (_mm256_sub_ps(a.0, b.0), _mm256_sub_ps(a.1, b.1)) }
    }

    #[inline(always)]
    fn mul(self, a: F, b: F) -> F {
        // SAFETY: as in `splat`.
        unsafe { (_mm256_mul_ps(a.0, b.0), _mm256_mul_ps(a.1, b.1)) }
    }

    #[inline(always)]
    fn div(self, a: F, b: F) -> F {
        // SAFETY: as in `splat`.
        unsafe { (_mm256_div_ps(a.0, b.0), _mm256_div_ps(a.1, b.1)) }
    }

    #[inline(always)]
    fn sqrt(self, a: F) -> F {
        // SAFETY: as in `splat`.
        unsafe { (_mm256_sqrt_ps(a.0), _mm256_sqrt_ps(a.1)) }
    }

    #[inline(always)]
    fn max(self, a: F, b: F) -> F {
        // SAFETY: as in `splat`.
        unsafe { (_mm256_max_ps(a.0, b.0), _mm256_max_ps(a.1, b.1)) }
    }

    #[inline(always)]
    fn min(self, a: F, b: F) -> F {
        // SAFETY: as in `splat`.
        unsafe { (_mm256_min_ps(a.0, b.0), _mm256_min_ps(a.1, b.1)) }
    }

    #[inline(always)]
    fn max_size(self, a: F, b: F) -> F {
        // SAFETY: as in `splat`.
        unsafe {
            let sign = _mm256_set1_ps(-0.0);
            let size = |v| _mm256_andnot_ps(sign, v);
            (_mm256_max_ps(size(a.0), b.0), _mm256_max_ps(size(a.1), b.1))
        }
    }

    #[inline(always)]
    fn gt(self, a: F, b: F) -> u16 {
        // SAFETY: as in `splat`.
        let (lo, hi) = unsafe {
            (
                _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_GT_OQ>(a.0, b.0)),
                _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_GT_OQ>(a.1, b.1)),
            )
        };
        (lo | hi << 8) as u16
    }

    #[inline(always)]
    fn select(self, mask: u16, a: F, b: F) -> F {
        // Written twice: a closure need not be inlined, and then runs without these instructions.
        // SAFETY: as in `splat`.
        unsafe {
            let bit = _mm256_set_epi32(128, 64, 32, 16, 8, 4, 2, 1);
            let (low, high) = (_mm256_set1_epi32((mask & 0xff).into()), _mm256_set1_epi32((mask >> 8).into()));
            let low = _mm256_castsi256_ps(_mm256_cmpeq_epi32(_mm256_and_si256(low, bit), bit));
            let high = _mm256_castsi256_ps(_mm256_cmpeq_epi32(_mm256_and_si256(high, bit), bit));
            (_mm256_blendv_ps(b.0, a.0, low), _mm256_blendv_ps(b.1, a.1, high))
        }
    }

    #[inline(always)]
    fn compress(self, v: F, mask: u16, to: &mut [f32]) {
        let to = &mut to[..LANES];
        let (lo, hi) = (mask as u8, (mask >> 8) as u8);
        let n = lo.count_ones() as usize;
        // SAFETY: as in `load`; the second store starts at most at place 8 and writes 8.
        unsafe {
            _mm256_storeu_ps(to.as_mut_ptr(), front(v.0, lo));
            _mm256_storeu_ps(to[n..n + 8].as_mut_ptr(), front(v.1, hi));
        }
    }

    #[inline(always)]
    fn sum(self, v: F) -> f32 {
        // SAFETY: as in `splat`.
        unsafe { sum8(_mm256_add_ps(v.0, v.1)) }
    }

    #[inline(always)]
    fn bits_at(self, words: &[u64; 8], bit: u32) -> u8 {
        // SAFETY: as in `splat`; the array has eight words, four for each load.
        let (lo, hi) = unsafe {
            // The bit becomes the sign.
            let shift = _mm_cvtsi32_si128(63 - bit as i32);
            let lo = _mm256_sll_epi64(_mm256_loadu_si256(words.as_ptr().cast()), shift);
            let hi = _mm256_sll_epi64(_mm256_loadu_si256(words[4..].as_ptr().cast()), shift);
            (_mm256_movemask_pd(_mm256_castsi256_pd(lo)), _mm256_movemask_pd(_mm256_castsi256_pd(hi)))
        };
        (lo | hi << 4) as u8
    }

    #[inline(always)]
    fn ranks(self, words: &[u64; 8], first: &[u32; 8], bit: u32) -> [__m256i; 2] {
        let (mut ranks, mut behind) = ([0; 8], [0; 8]);
        for l in 0..8 {
            ranks[l] = first[l].wrapping_add((words[l] & ((1 << bit) - 1)).count_ones());
            behind[l] = ranks[l].wrapping_add((words[l] >> bit & 1) as u32);
        }
        // SAFETY: as in `splat`; the arrays have the eight numbers that are loaded.
        unsafe { [_mm256_loadu_si256(ranks.as_ptr().cast()), _mm256_loadu_si256(behind.as_ptr().cast())] }
    }

    #[inline(always)]
    fn pick(self, [lo, hi]: [__m256i; 2], index: &[u8; LANES]) -> [__m256i; 2] {
        let mut picked = [lo; 2];
        for half in 0..2 {
            // SAFETY: as in `splat`; of the 16 bytes eight are loaded, from byte 0 or 8 on.
            picked[half] = unsafe {
                let index = _mm256_cvtepu8_epi32(_mm_loadl_epi64(index[8 * half..].as_ptr().cast()));
                let from = [_mm256_permutevar8x32_epi32(lo, index), _mm256_permutevar8x32_epi32(hi, index)];
                _mm256_blendv_epi8(from[0], from[1], _mm256_cmpgt_epi32(index, _mm256_set1_epi32(7)))
            };
        }
        picked
    }

    #[inline(always)]
    fn store_u(self, v: [__m256i; 2], to: &mut [u32]) {
        let to = to[..LANES].as_mut_ptr();
        // SAFETY: as in `splat`; the slice has 16 places, eight for each store.
        unsafe {
            _mm256_storeu_si256(to.cast(), v[0]);
            _mm256_storeu_si256(to.add(8).cast(), v[1]);
        }
    }

    #[inline(always)]
    fn prefetch<T>(self, value: &T) {
        // SAFETY: as in `splat`; nothing is read that the program sees, and the place may be read.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(value).cast()) }
    }

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> K::Output {
        // SAFETY: as in `splat`.
        unsafe { enabled(self, kernel) }
    }
}
