//! Sixteen lanes as one AVX-512 register.

use std::arch::x86_64::*;

use super::{Kernel, LANES, Simd, avx2::sum8};

/// Proof that the machine has AVX-512 F, BW, DQ and VL, BMI1, BMI2 and POPCNT.
#[derive(Clone, Copy, Debug)]
pub struct Avx512(());

impl Avx512 {
    pub(crate) fn new() -> Option<Self> {
        let has = is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512bw")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512vl")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("popcnt");
        has.then_some(Self(()))
    }
}

#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,bmi1,bmi2,popcnt")]
fn enabled<K: Kernel>(simd: Avx512, kernel: K) -> K::Output {
    kernel.run(simd)
}

impl Simd for Avx512 {
    type F = __m512;
    type U = __m512i;
    const IS_WIDE: bool = false;

    #[inline(always)]
    fn splat(self, v: f32) -> __m512 {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm512_set1_ps(v) }
    }

    #[inline(always)]
    fn load(self, from: &[f32]) -> __m512 {
        // SAFETY: as in `splat`; the slice has 16 values, which the index checks.
        unsafe { _mm512_loadu_ps(from[..LANES].as_ptr()) }
    }

    #[inline(always)]
    fn store(self, v: __m512, to: &mut [f32]) {
        // SAFETY: as in `load`.
        unsafe { _mm512_storeu_ps(to[..LANES].as_mut_ptr(), v) }
    }

    #[inline(always)]
    fn store_eight(self, v: __m512, to: &mut [f32]) {
        // SAFETY: as in `load`; the slice has 8 places.
        unsafe { _mm256_storeu_ps(to[..8].as_mut_ptr(), _mm512_castps512_ps256(v)) }
    }

    #[inline(always)]
    fn add(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: as in `splat`.
        unsafe { _mm512_add_ps(a, b) }
    }

    #[inline(always)]
    fn sub(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: as in `splat`.
        unsafe { _mm512_sub_ps(a, b) }
    }

    #[inline(always)]
    fn mul(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: as in `splat`.
        unsafe { _mm512_mul_ps(a, b) }
    }

    #[inline(always)]
    fn div(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: as in `splat`.
        unsafe { _mm512_div_ps(a, b) }
    }

    #[inline(always)]
    fn sqrt(self, a: __m512) -> __m512 {
        // SAFETY: as in `splat`.
        unsafe { _mm512_sqrt_ps(a) }
    }

    #[inline(always)]
    fn max(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: as in `splat`.
        unsafe { _mm512_max_ps(a, b) }
    }

    #[inline(always)]
    fn min(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: as in `splat`.
        unsafe { _mm512_min_ps(a, b) }
    }

    #[inline(always)]
    fn max_size(self, a: __m512, b: __m512) -> __m512 {
        // The greater size (bits 0 and 1), without its sign (bits 2 and 3).
        // SAFETY: as in `splat`.
        unsafe { _mm512_range_ps::<0b10_11>(a, b) }
    }

    #[inline(always)]
    fn gt(self, a: __m512, b: __m512) -> u16 {
        // SAFETY: as in `splat`.
        unsafe { _mm512_cmp_ps_mask::<_CMP_GT_OQ>(a, b) }
    }

    #[inline(always)]
    fn select(self, mask: u16, a: __m512, b: __m512) -> __m512 {
        // SAFETY: as in `splat`.
        unsafe { _mm512_mask_blend_ps(mask, b, a) }
    }

    #[inline(always)]
    fn compress(self, v: __m512, mask: u16, to: &mut [f32]) {
        // Compressing in the register and storing all of it: the form that writes to memory is microcoded on Zen 4.
        // SAFETY: as in `load`.
        unsafe { _mm512_storeu_ps(to[..LANES].as_mut_ptr(), _mm512_maskz_compress_ps(mask, v)) }
    }

    #[inline(always)]
    fn sum(self, v: __m512) -> f32 {
        // SAFETY: as in `splat`; AVX-512 implies AVX.
        unsafe { sum8(_mm256_add_ps(_mm512_castps512_ps256(v), _mm512_extractf32x8_ps::<1>(v))) }
    }

    #[inline(always)]
    fn bits_at(self, words: &[u64; 8], bit: u32) -> u8 {
        // SAFETY: as in `splat`; the array has the eight words that are loaded.
        unsafe {
            _mm512_test_epi64_mask(_mm512_loadu_epi64(words.as_ptr().cast()), _mm512_set1_epi64((1u64 << bit) as i64))
        }
    }

    #[inline(always)]
    fn ranks(self, words: &[u64; 8], first: &[u32; 8], bit: u32) -> __m512i {
        // Bits of a byte by its two halves: the instruction that counts those of a word is younger than AVX-512.
        // SAFETY: as in `splat`; the arrays have the eight words and numbers that are loaded.
        unsafe {
            let words = _mm512_loadu_epi64(words.as_ptr().cast());
            let below = _mm512_and_si512(words, _mm512_set1_epi64(((1u64 << bit) - 1) as i64));
            let half = _mm512_set1_epi8(15);
            let counts = _mm512_broadcast_i32x4(_mm_setr_epi8(0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4));
            let low = _mm512_shuffle_epi8(counts, _mm512_and_si512(below, half));
            let high = _mm512_shuffle_epi8(counts, _mm512_and_si512(_mm512_srli_epi16::<4>(below), half));
            let below = _mm512_sad_epu8(_mm512_add_epi8(low, high), _mm512_setzero_si512());
            let first = _mm256_loadu_si256(first.as_ptr().cast());
            let ranks = _mm256_add_epi32(first, _mm512_cvtepi64_epi32(below));
            let at = _mm512_test_epi64_mask(words, _mm512_set1_epi64((1u64 << bit) as i64));
            let behind = _mm256_mask_add_epi32(ranks, at, ranks, _mm256_set1_epi32(1));
            _mm512_inserti32x8::<1>(_mm512_castsi256_si512(ranks), behind)
        }
    }

    #[inline(always)]
    fn pick(self, from: __m512i, index: &[u8; LANES]) -> __m512i {
        // SAFETY: as in `splat`; the array has the 16 bytes that are loaded.
        unsafe { _mm512_permutexvar_epi32(_mm512_cvtepu8_epi32(_mm_loadu_si128(index.as_ptr().cast())), from) }
    }

    #[inline(always)]
    fn store_u(self, v: __m512i, to: &mut [u32]) {
        // SAFETY: as in `load`.
        unsafe { _mm512_storeu_epi32(to[..LANES].as_mut_ptr().cast(), v) }
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
