//! Compress, sort, decompress: Garanzha, Loop 2010, "Fast ray sorting and breadth-first packet traversal for GPU ray
//! tracing", section 4.
//!
//! Neighbours with the same key become one run, runs are sorted, and each is written out in full where it belongs.
//! Worth its two extra passes where keys come in runs, as those of rays of a picture do.

use super::{Pair, key, pair, parts, payload, radix_sort};
use rayon::prelude::*;

/// Pairs that one thread looks at at a time.
const CHUNK: usize = 1 << 15;

/// Sorts as [`radix_sort`] does, runs of equal keys as one.
///
/// # Panics
/// The lengths differ.
pub fn compressed_radix_sort<'a>(
    pairs: &'a mut [Pair],
    spare: &'a mut [Pair],
    key_bits: u32,
) -> &'a mut [Pair] {
    assert_eq!(pairs.len(), spare.len(), "rooms of one length");
    let starts = run_starts(pairs);
    let start = |run: u32| starts[run as usize] as usize;
    let length = |run: u32| starts.get(run as usize + 1).map_or(pairs.len(), |&s| s as usize) - start(run);
    let mut runs: Vec<Pair> =
        (0..starts.len() as u32).into_par_iter().map(|run| pair(key(pairs[start(run)]), run)).collect();
    let mut spare_runs = vec![0; runs.len()];
    let runs = radix_sort(&mut runs, &mut spare_runs, key_bits);

    let groups: Vec<&[Pair]> = runs.chunks(CHUNK).collect();
    let lengths = groups.par_iter().map(|group| group.iter().map(|&run| length(payload(run))).sum());
    let lengths: Vec<usize> = lengths.collect();
    let places = parts(spare, lengths.into_iter());
    groups.into_par_iter().zip(places).for_each(|(group, mut place)| {
        for &run in group {
            let (start, length) = (start(payload(run)), length(payload(run)));
            let (own, rest) = std::mem::take(&mut place).split_at_mut(length);
            own.copy_from_slice(&pairs[start..start + length]);
            place = rest;
        }
    });
    spare
}

/// Where each run of equal keys starts.
fn run_starts(pairs: &[Pair]) -> Vec<u32> {
    let starts_run = |i: usize| i == 0 || key(pairs[i]) != key(pairs[i - 1]);
    let chunk = |first: usize| {
        let range = first..(first + CHUNK).min(pairs.len());
        range.filter(|&i| starts_run(i)).map(|i| i as u32).collect::<Vec<u32>>()
    };
    let found: Vec<Vec<u32>> =
        (0..pairs.len().div_ceil(CHUNK)).into_par_iter().map(|c| chunk(c * CHUNK)).collect();
    found.concat()
}
