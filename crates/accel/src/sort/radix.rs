//! Parallel radix sort, least significant digit first: Zagha, Blelloch 1991, "Radix sort for vector multiprocessors".
//!
//! Each pass counts the digits of every chunk, gives each (digit, chunk) its place in the output, digit by digit and
//! chunk by chunk within a digit, and moves the pairs there. Pairs of equal keys keep their order, so the result depends
//! neither on the chunks nor on the threads. A pass whose digit is the same everywhere is left out.

use super::{Pair, key, parts};
use rayon::prelude::*;
use std::slice::IterMut;

/// Most bits of a digit: with more, the places of a chunk's digits no longer fit the nearest cache.
const MAX_DIGIT_BITS: u32 = 10;
/// A digit's values, at most.
const MAX_VALUES: usize = 1 << MAX_DIGIT_BITS;
/// Shorter inputs are sorted by one thread.
const MIN_CHUNK: usize = 1 << 14;
/// Inputs up to this long are sorted by comparing.
const FEW: usize = 192;

/// Sorts `pairs` by the lower `key_bits` bits of their keys, stably; higher bits must be zero. The answer is in `pairs` or
/// in `spare`, of the same length, and the other holds anything.
///
/// # Panics
/// The lengths differ.
pub fn radix_sort<'a>(pairs: &'a mut [Pair], spare: &'a mut [Pair], key_bits: u32) -> &'a mut [Pair] {
    assert_eq!(pairs.len(), spare.len(), "rooms of one length");
    if pairs.len() <= FEW {
        pairs.sort_by_key(|&pair| key(pair));
        return pairs;
    }
    let passes = key_bits.min(32).div_ceil(MAX_DIGIT_BITS).max(1);
    let digit_bits = key_bits.min(32).div_ceil(passes);
    let chunk = pairs.len().div_ceil(4 * rayon::current_num_threads()).max(MIN_CHUNK);
    let (mut from, mut to) = (pairs, spare);
    for pass in 0..passes {
        let digit = Digit { shift: 32 + pass * digit_bits, mask: (1 << digit_bits) - 1 };
        if move_by_digit(from, to, chunk, digit) {
            (from, to) = (to, from);
        }
    }
    from
}

/// Some bits of a key.
#[derive(Clone, Copy)]
struct Digit {
    shift: u32,
    mask: usize,
}

impl Digit {
    #[inline(always)]
    fn of(self, pair: Pair) -> usize {
        // The second operand tells the compiler what the mask ensures.
        (pair >> self.shift) as usize & self.mask & (MAX_VALUES - 1)
    }
}

/// Copies `from` to `to` in the order of the digit; false, and nothing is copied, where all have the same.
fn move_by_digit(from: &[Pair], to: &mut [Pair], chunk: usize, digit: Digit) -> bool {
    let counts: Vec<Vec<u32>> = from.par_chunks(chunk).map(|chunk| count(chunk, digit)).collect();
    let first = digit.of(from[0]);
    if counts.iter().map(|c| c[first] as usize).sum::<usize>() == from.len() {
        return false;
    }
    let lengths = (0..=digit.mask).flat_map(|value| counts.iter().map(move |c| c[value] as usize));
    let mut places: Vec<Vec<IterMut<'_, Pair>>> =
        counts.iter().map(|_| Vec::with_capacity(MAX_VALUES)).collect();
    for (i, part) in parts(to, lengths).into_iter().enumerate() {
        places[i % counts.len()].push(part.iter_mut());
    }
    from.par_chunks(chunk).zip(places).for_each(|(chunk, mut places)| {
        places.resize_with(MAX_VALUES, || [].iter_mut());
        scatter(chunk, &mut places, digit);
    });
    true
}

fn count(chunk: &[Pair], digit: Digit) -> Vec<u32> {
    let mut counts = vec![0_u32; MAX_VALUES];
    for &pair in chunk {
        counts[digit.of(pair)] += 1;
    }
    counts
}

/// Moves each pair to the next place of its digit.
fn scatter(chunk: &[Pair], places: &mut [IterMut<'_, Pair>], digit: Digit) {
    let Ok(places) = <&mut [IterMut<'_, Pair>; MAX_VALUES]>::try_from(places) else { return };
    for &pair in chunk {
        if let Some(place) = places[digit.of(pair)].next() {
            *place = pair;
        }
    }
}
