//! The first two dimensions of Sobol's sequence and Owen scrambling by hashing.
//!
//! B. Burley 2020, "Practical hash-based Owen scrambling"; A. Ahmed 2024, "An implementation algorithm of 2D Sobol
//! sequence fast, elegant, and compact" for the second dimension without a table; the hash is the improved
//! Laine-Karras permutation of N. Vegdahl 2021, "Building a better LK hash".
//!
//! Fractions are kept with their bits *reversed* (the most significant digit in bit 0), in which form the first
//! Sobol dimension is the index itself and scrambling is one hash: see [`to_unit`].

use crate::rng::unit_f32;

/// A permutation of the 32-bit numbers in which each bit depends on lower bits only: an Owen scramble of a fraction
/// with reversed bits.
#[inline(always)]
#[must_use]
pub const fn owen_reversed(x: u32, seed: u32) -> u32 {
    let x = x ^ x.wrapping_mul(0x3d20_adea);
    let x = x.wrapping_add(seed).wrapping_mul((seed >> 16) | 1);
    let x = x ^ x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// The second Sobol dimension of `index`, bits reversed: Pascal's triangle modulo 2 as a matrix, which is a Kronecker
/// product of five 2x2 matrices and so takes five steps.
#[inline(always)]
#[must_use]
pub const fn second_dimension_reversed(index: u32) -> u32 {
    let x = index ^ ((index & 0xaaaa_aaaa) >> 1);
    let x = x ^ ((x & 0xcccc_cccc) >> 2);
    let x = x ^ ((x & 0xf0f0_f0f0) >> 4);
    let x = x ^ ((x & 0xff00_ff00) >> 8);
    x ^ (x >> 16)
}

/// The number in [0, 1) whose binary digits are the bits of `reversed`, bit 0 first.
#[inline(always)]
#[must_use]
pub fn to_unit(reversed: u32) -> f32 {
    unit_f32(reversed.reverse_bits())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The second dimension from its recurrence: direction numbers of the primitive polynomial x + 1.
    fn by_direction_numbers(index: u32) -> u32 {
        let mut v = 1_u32 << 31;
        let mut x = 0;
        for bit in 0..32 {
            if index >> bit & 1 == 1 {
                x ^= v;
            }
            v ^= v >> 1;
        }
        x
    }

    #[test]
    fn second_dimension_equals_its_recurrence() {
        for i in (0..1_000_000_u32).step_by(97).chain([u32::MAX, 1 << 31]) {
            assert_eq!(second_dimension_reversed(i).reverse_bits(), by_direction_numbers(i), "{i}");
        }
    }

    #[test]
    fn scrambling_lets_each_digit_depend_on_earlier_digits_only() {
        for seed in [0, 1, 0xdead_beef, u32::MAX] {
            for i in 0..10_000_u32 {
                let (a, b) = (crate::rng::hash_u32(i), crate::rng::hash_u32(i + 77_777));
                let common = (a ^ b).trailing_zeros();
                let scrambled = (owen_reversed(a, seed) ^ owen_reversed(b, seed)).trailing_zeros();
                assert_eq!(common, scrambled);
            }
        }
    }
}
