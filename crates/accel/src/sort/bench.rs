//! What `bench sort` does: make keys, sort them by each algorithm, give the times.

use super::{Pair, compressed_radix_sort, key, pair, radix_sort};
use rayon::prelude::*;
use std::time::Instant;

/// Names of the algorithms, in the order of the benchmark's lines.
pub const ALGORITHMS: [&str; 3] = ["radix", "compressed-radix", "std"];
/// Names of the keys: 32 random bits; the same in runs of eight, as keys of neighbouring rays come.
pub const KEYS: [&str; 2] = ["random", "runs"];
/// Length of the runs.
const RUN: u32 = 8;

/// The figures of a `bench sort` line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SortFigures {
    /// One of [`ALGORITHMS`].
    pub algorithm: &'static str,
    /// One of [`KEYS`].
    pub keys: &'static str,
    /// Pairs sorted.
    pub n: usize,
    /// Best time in milliseconds.
    pub ms: f64,
    /// Millions of pairs a second at best.
    pub mkeys_per_s: f64,
}

/// Sorts `n` pairs of each kind of keys by each algorithm `repeat` times (at least once) with the current pool; none
/// where two algorithms do not give the same order.
#[must_use]
pub fn sort(n: usize, repeat: u32) -> Option<Vec<SortFigures>> {
    let mut figures = Vec::new();
    for keys in KEYS {
        let input = pairs(n, keys);
        let mut spare = vec![0; n];
        let mut expected: Option<Vec<Pair>> = None;
        for algorithm in ALGORITHMS {
            let mut best = f64::INFINITY;
            for _ in 0..repeat.max(1) {
                let mut pairs = input.clone();
                let start = Instant::now();
                let sorted = sort_by(algorithm, &mut pairs, &mut spare);
                best = best.min(start.elapsed().as_secs_f64());
                if expected.get_or_insert_with(|| sorted.to_vec()) != sorted {
                    return None;
                }
            }
            let mkeys_per_s = n as f64 / best.max(1e-9) / 1e6;
            figures.push(SortFigures { algorithm, keys, n, ms: best * 1e3, mkeys_per_s });
        }
    }
    Some(figures)
}

/// `n` pairs to sort, with one of [`KEYS`] and their places as payloads.
#[must_use]
pub fn pairs(n: usize, keys: &str) -> Vec<Pair> {
    let run = if keys == "runs" { RUN } else { 1 };
    (0..n as u32).into_par_iter().map(|i| pair(random(i / run), i)).collect()
}

fn sort_by<'a>(algorithm: &str, pairs: &'a mut [Pair], spare: &'a mut [Pair]) -> &'a mut [Pair] {
    match algorithm {
        "radix" => radix_sort(pairs, spare, 32),
        "compressed-radix" => compressed_radix_sort(pairs, spare, 32),
        _ => {
            pairs.par_sort_by_key(|&pair| key(pair));
            pairs
        }
    }
}

/// 32 bits that look random (Steele, Lea, Flood 2014, "Fast splittable pseudorandom number generators").
fn random(i: u32) -> u32 {
    let mut x = (u64::from(i) + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    (x >> 32) as u32
}
