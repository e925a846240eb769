//! Hash functions: counter-based random numbers without state.

/// A well mixed 32-bit number from a 32-bit one; a bijection (C. Wellons, "lowbias32", bias 0.107).
#[inline]
#[must_use]
pub const fn hash_u32(x: u32) -> u32 {
    let x = (x ^ (x >> 16)).wrapping_mul(0x21f0_aaad);
    let x = (x ^ (x >> 15)).wrapping_mul(0xd35a_2d97);
    x ^ (x >> 15)
}

/// A well mixed 64-bit number from a 64-bit one; a bijection (Steele, Lea and Flood 2014, the finalizer of
/// "Fast splittable pseudorandom number generators" with D. Stafford's constants).
#[inline(always)]
#[must_use]
pub const fn hash_u64(x: u64) -> u64 {
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// A hash of several words; their order matters.
#[inline]
#[must_use]
pub fn hash_words(words: &[u32]) -> u64 {
    hash_more(0x9e37_79b9_7f4a_7c15, words)
}

/// The hash of the words that gave `hash` followed by `words`.
#[inline]
#[must_use]
pub fn hash_more(hash: u64, words: &[u32]) -> u64 {
    words.iter().fold(hash, |h, &w| hash_u64(h.rotate_left(23) ^ u64::from(w)))
}

/// The upper 24 bits of `x` as a number in [0, 1).
#[inline(always)]
#[must_use]
pub fn unit_f32(x: u32) -> f32 {
    (x >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// A number in [0, 1) that depends on all `words`: for decisions without a sample dimension, such as stochastic
/// alpha.
#[inline]
#[must_use]
pub fn hash_to_unit(words: &[u32]) -> f32 {
    unit_f32((hash_words(words) >> 32) as u32)
}

/// Independent uniform numbers, keyed by a seed and counted: the n-th number is a pure function of both.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rng {
    key: u64,
    counter: u64,
}

impl Rng {
    /// The sequence number `seed`.
    #[inline]
    #[must_use]
    pub const fn new(seed: u64) -> Self {
        Self { key: hash_u64(seed ^ 0x6a09_e667_f3bc_c908), counter: 0 }
    }

    /// The next 32 bits.
    #[inline]
    pub const fn next_u32(&mut self) -> u32 {
        self.counter = self.counter.wrapping_add(0x9e37_79b9_7f4a_7c15);
        (hash_u64(self.key.wrapping_add(self.counter)) >> 32) as u32
    }

    /// The next number in [0, 1).
    #[inline]
    pub fn next_1d(&mut self) -> f32 {
        unit_f32(self.next_u32())
    }

    /// The next point in [0, 1)^2.
    #[inline]
    pub fn next_2d(&mut self) -> glam::Vec2 {
        glam::Vec2::new(self.next_1d(), self.next_1d())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::chi_square;

    #[test]
    fn every_input_bit_changes_half_of_the_output_bits() {
        for bit in 0..32 {
            let flipped: u32 =
                (0..4000_u32).map(|i| (hash_u32(i) ^ hash_u32(i ^ (1 << bit))).count_ones()).sum();
            let mean = f64::from(flipped) / 4000.0;
            assert!((mean - 16.0).abs() < 0.3, "bit {bit}: {mean}");
        }
    }

    #[test]
    fn words_are_told_apart_by_order_and_number() {
        assert_ne!(hash_words(&[1, 2]), hash_words(&[2, 1]));
        assert_eq!(hash_more(hash_words(&[1, 2]), &[3]), hash_words(&[1, 2, 3]));
        assert_ne!(hash_words(&[0]), hash_words(&[0, 0]));
    }

    #[test]
    fn numbers_are_uniform_and_below_one() {
        let mut rng = Rng::new(1);
        let mut counts = [0.0; 64];
        for _ in 0..64_000 {
            counts[(rng.next_1d() * 64.0) as usize] += 1.0;
        }
        assert!(chi_square(&counts, &[1000.0; 64]).p > 1e-3);
        assert!(unit_f32(u32::MAX) < 1.0);
        assert!(hash_to_unit(&[3, 4]) < 1.0);
    }
}
