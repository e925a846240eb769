//! Sorting 32-bit keys that carry 32-bit payloads.
//!
//! Key and payload travel in one u64, the key above: a [`Pair`]. Every sort here is stable, so its answer is one and
//! the same whatever the algorithm and the number of threads.

pub mod bench;
mod compressed;
mod radix;

pub use compressed::compressed_radix_sort;
pub use radix::radix_sort;

/// A key in the upper half, its payload in the lower.
pub type Pair = u64;

/// The pair of a key and a payload.
#[inline(always)]
#[must_use]
pub const fn pair(key: u32, payload: u32) -> Pair {
    (key as u64) << 32 | payload as u64
}

/// The key of a pair.
#[inline(always)]
#[must_use]
pub const fn key(pair: Pair) -> u32 {
    (pair >> 32) as u32
}

/// The payload of a pair.
#[inline(always)]
#[must_use]
pub const fn payload(pair: Pair) -> u32 {
    pair as u32
}

/// Cuts `slice` into consecutive parts of the given lengths, whose sum is at most its own.
///
/// # Panics
/// The sum is more.
#[must_use]
pub fn parts<T>(mut slice: &mut [T], lengths: impl Iterator<Item = usize>) -> Vec<&mut [T]> {
    let mut parts = Vec::with_capacity(lengths.size_hint().0);
    for length in lengths {
        let (part, rest) = slice.split_at_mut(length);
        parts.push(part);
        slice = rest;
    }
    parts
}
