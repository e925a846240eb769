//! The level that every machine has: arrays and loops.

use crate::{Simd8, WINDOW, Words};

/// Arrays of eight; the compiler uses whatever vectors its target has.
#[derive(Clone, Copy, Debug)]
pub struct Portable;

#[inline(always)]
fn zip<T>(a: [f32; 8], b: [f32; 8], f: impl Fn(f32, f32) -> T) -> [T; 8] {
    std::array::from_fn(|i| f(a[i], b[i]))
}

impl Simd8 for Portable {
    type F = [f32; 8];
    type M = [bool; 8];

    #[inline(always)]
    fn splat(self, x: f32) -> Self::F {
        [x; 8]
    }
    #[inline(always)]
    fn load(self, x: &[f32; 8]) -> Self::F {
        *x
    }
    #[inline(always)]
    fn to_array(self, a: Self::F) -> [f32; 8] {
        a
    }
    #[inline(always)]
    fn widen(self, x: &[u8; 8]) -> Self::F {
        x.map(f32::from)
    }
    #[inline(always)]
    fn unpack(self, window: &[u8; WINDOW], words: Words, at: &[u8; 8]) -> [Self::F; 3] {
        let [a, b, c] = words.bits.map(|bits| u32::from(bits.min(24)));
        let field = |word: u64, first: u32, bits: u32| (word >> first & ((1 << bits) - 1)) as f32;
        let mut out = [[0.0; 8]; 3];
        for (lane, &at) in at.iter().enumerate() {
            let start = usize::from(at) * usize::from(words.stride.min(9));
            let word = window[start..].first_chunk().map_or(0, |bytes: &[u8; 8]| u64::from_le_bytes(*bytes));
            (out[0][lane], out[1][lane], out[2][lane]) =
                (field(word, 0, a), field(word, a, b), field(word, a + b, c));
        }
        out
    }
    #[inline(always)]
    fn add(self, a: Self::F, b: Self::F) -> Self::F {
        zip(a, b, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, a: Self::F, b: Self::F) -> Self::F {
        zip(a, b, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, a: Self::F, b: Self::F) -> Self::F {
        zip(a, b, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, a: Self::F, b: Self::F) -> Self::F {
        zip(a, b, |a, b| a / b)
    }
    #[inline(always)]
    fn mul_sub(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F {
        std::array::from_fn(|i| a[i] * b[i] - c[i])
    }
    #[inline(always)]
    fn min(self, a: Self::F, b: Self::F) -> Self::F {
        zip(a, b, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, a: Self::F, b: Self::F) -> Self::F {
        zip(a, b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn sqrt(self, a: Self::F) -> Self::F {
        a.map(f32::sqrt)
    }
    #[inline(always)]
    fn abs(self, a: Self::F) -> Self::F {
        a.map(f32::abs)
    }
    #[inline(always)]
    fn copysign(self, a: Self::F, sign: Self::F) -> Self::F {
        zip(a, sign, f32::copysign)
    }
    #[inline(always)]
    fn swap_halves(self, a: Self::F) -> Self::F {
        std::array::from_fn(|i| a[(i + 4) % 8])
    }
    #[inline(always)]
    fn le(self, a: Self::F, b: Self::F) -> Self::M {
        zip(a, b, |a, b| a <= b)
    }
    #[inline(always)]
    fn ne(self, a: Self::F, b: Self::F) -> Self::M {
        zip(a, b, |a, b| a != b)
    }
    #[inline(always)]
    fn and(self, a: Self::M, b: Self::M) -> Self::M {
        std::array::from_fn(|i| a[i] & b[i])
    }
    #[inline(always)]
    fn or(self, a: Self::M, b: Self::M) -> Self::M {
        std::array::from_fn(|i| a[i] | b[i])
    }
    #[inline(always)]
    fn bits(self, a: Self::M) -> u32 {
        (0..8).fold(0, |bits, i| bits | u32::from(a[i]) << i)
    }
    #[inline(always)]
    fn prefetch<const LINES: usize>(self, _start: *const u8) {}
}
