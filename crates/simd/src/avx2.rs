//! AVX2 and FMA, for x86-64 processors since about 2013.
#![expect(
    unsafe_code,
    reason = "intrinsics; each block says why its instructions exist and its memory is valid"
)]

use crate::{Kernel, Simd8, WINDOW, Words};
use std::arch::x86_64::{
    __m256, __m256i, _CMP_LE_OQ, _CMP_NEQ_UQ, _MM_HINT_T0, _mm_cvtsi32_si128, _mm_loadl_epi64, _mm_prefetch,
    _mm256_add_ps, _mm256_and_ps, _mm256_and_si256, _mm256_andnot_ps, _mm256_castps_si256,
    _mm256_castsi256_ps, _mm256_castsi256_si128, _mm256_cmp_ps, _mm256_cvtepi32_ps, _mm256_cvtepu8_epi32,
    _mm256_div_ps, _mm256_extracti128_si256, _mm256_fmsub_ps, _mm256_i32gather_epi64, _mm256_loadu_ps,
    _mm256_max_ps, _mm256_min_ps, _mm256_movemask_ps, _mm256_mul_ps, _mm256_mullo_epi32, _mm256_or_ps,
    _mm256_permute2f128_ps, _mm256_permute4x64_epi64, _mm256_set1_epi32, _mm256_set1_ps, _mm256_shuffle_ps,
    _mm256_sqrt_ps, _mm256_srl_epi64, _mm256_storeu_ps, _mm256_sub_ps,
};

/// Proof that the processor has AVX2, FMA, BMI1, BMI2, LZCNT and POPCNT. Only [`Avx2::detect`] makes one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Avx2(());

impl Avx2 {
    /// The proof, where the processor gives it.
    pub(crate) fn detect() -> Option<Self> {
        let present = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("lzcnt")
            && is_x86_feature_detected!("popcnt");
        present.then_some(Self(()))
    }

    /// Runs `kernel` compiled for this level.
    pub(crate) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        // SAFETY: `self` exists only where `detect` found all features that the function enables.
        unsafe { run_enabled(self, kernel) }
    }
}

#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
fn run_enabled<K: Kernel>(level: Avx2, kernel: K) -> K::Output {
    kernel.run(level)
}

/// A method that is one intrinsic on register operands.
macro_rules! register_op {
    ($name:ident($($arg:ident: $from:ty),+) -> $to:ty, $call:expr) => {
        #[inline(always)]
        fn $name(self, $($arg: $from),+) -> $to {
            // SAFETY: touches registers alone; `self` proves that the processor has the instruction.
            unsafe { $call }
        }
    };
}

impl Simd8 for Avx2 {
    type F = __m256;
    type M = __m256;

    #[inline(always)]
    fn load(self, x: &[f32; 8]) -> __m256 {
        // SAFETY: reads 32 bytes without alignment, all of them inside the array; `self` proves AVX.
        unsafe { _mm256_loadu_ps(x.as_ptr()) }
    }
    #[inline(always)]
    fn to_array(self, a: __m256) -> [f32; 8] {
        let mut out = [0.0; 8];
        // SAFETY: writes 32 bytes without alignment, all of them inside the array; `self` proves AVX.
        unsafe { _mm256_storeu_ps(out.as_mut_ptr(), a) };
        out
    }

    #[inline(always)]
    fn widen(self, x: &[u8; 8]) -> __m256 {
        // SAFETY: reads the eight bytes of the array; `self` proves AVX2.
        unsafe { _mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(_mm_loadl_epi64(x.as_ptr().cast()))) }
    }
    #[inline(always)]
    fn unpack(self, window: &[u8; WINDOW], words: Words, at: &[u8; 8]) -> [__m256; 3] {
        let [a, b, c] = words.bits.map(|bits| i32::from(bits.min(24)));
        let stride = i32::from(words.stride.min(9));
        // SAFETY: the index is at most 255 and the stride at most 9, so each of the eight bytes read behind their product
        // is one of the 2304 of the window; `self` proves AVX2.
        unsafe {
            let at = _mm256_cvtepu8_epi32(_mm_loadl_epi64(at.as_ptr().cast()));
            // Words 0 1 4 5 and 2 3 6 7 together, which is how the halves of vectors are shuffled.
            let at = _mm256_permute4x64_epi64::<0b11_01_10_00>(at);
            let start = _mm256_mullo_epi32(at, _mm256_set1_epi32(stride));
            let base = window.as_ptr().cast();
            let low = _mm256_i32gather_epi64::<1>(base, _mm256_castsi256_si128(start));
            let high = _mm256_i32gather_epi64::<1>(base, _mm256_extracti128_si256::<1>(start));
            [field(low, high, 0, a), field(low, high, a, b), field(low, high, a + b, c)]
        }
    }

    register_op!(splat(x: f32) -> __m256, _mm256_set1_ps(x));
    register_op!(add(a: __m256, b: __m256) -> __m256, _mm256_add_ps(a, b));
    register_op!(sub(a: __m256, b: __m256) -> __m256, _mm256_sub_ps(a, b));
    register_op!(mul(a: __m256, b: __m256) -> __m256, _mm256_mul_ps(a, b));
    register_op!(div(a: __m256, b: __m256) -> __m256, _mm256_div_ps(a, b));
    register_op!(mul_sub(a: __m256, b: __m256, c: __m256) -> __m256, _mm256_fmsub_ps(a, b, c));
    register_op!(min(a: __m256, b: __m256) -> __m256, _mm256_min_ps(a, b));
    register_op!(max(a: __m256, b: __m256) -> __m256, _mm256_max_ps(a, b));
    register_op!(sqrt(a: __m256) -> __m256, _mm256_sqrt_ps(a));
    register_op!(abs(a: __m256) -> __m256, _mm256_andnot_ps(_mm256_set1_ps(-0.0), a));
    register_op!(copysign(a: __m256, sign: __m256) -> __m256, {
        let bit = _mm256_set1_ps(-0.0);
        _mm256_or_ps(_mm256_and_ps(bit, sign), _mm256_andnot_ps(bit, a))
    });
    register_op!(swap_halves(a: __m256) -> __m256, _mm256_permute2f128_ps::<1>(a, a));
    register_op!(le(a: __m256, b: __m256) -> __m256, _mm256_cmp_ps::<_CMP_LE_OQ>(a, b));
    register_op!(ne(a: __m256, b: __m256) -> __m256, _mm256_cmp_ps::<_CMP_NEQ_UQ>(a, b));
    register_op!(and(a: __m256, b: __m256) -> __m256, _mm256_and_ps(a, b));
    register_op!(or(a: __m256, b: __m256) -> __m256, _mm256_or_ps(a, b));
    register_op!(bits(a: __m256) -> u32, _mm256_movemask_ps(a).cast_unsigned());

    #[inline(always)]
    fn prefetch<const LINES: usize>(self, start: *const u8) {
        for line in 0..LINES {
            // SAFETY: a prefetch may name any address, it neither faults nor reads in the language's sense.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(start.cast::<i8>().wrapping_add(line * 64)) };
        }
    }
}

/// The number of `bits` bits behind the first `first` ones of the words 0 1 4 5 and 2 3 6 7.
#[inline]
#[target_feature(enable = "avx2")]
fn field(low: __m256i, high: __m256i, first: i32, bits: i32) -> __m256 {
    let count = _mm_cvtsi32_si128(first);
    let (low, high) = (_mm256_srl_epi64(low, count), _mm256_srl_epi64(high, count));
    let lower_halves =
        _mm256_shuffle_ps::<0b10_00_10_00>(_mm256_castsi256_ps(low), _mm256_castsi256_ps(high));
    let mask = _mm256_set1_epi32((1 << bits) - 1);
    _mm256_cvtepi32_ps(_mm256_and_si256(_mm256_castps_si256(lower_halves), mask))
}
