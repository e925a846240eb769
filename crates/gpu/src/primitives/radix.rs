//! Radix sort, least significant digit first, eight bits a pass: Zagha, Blelloch 1991, "Radix sort for vector
//! multiprocessors"; the tiles as in Satish, Harris, Garland 2009, "Designing efficient sorting algorithms for manycore
//! GPUs".
//!
//! The counterpart on the CPU is `radix_sort` of `vastlight-accel`: both are stable, so the answer is one and the same.

use super::{check_count, scan, tiles};
use crate::error::GpuError;
use crate::kernel::{device_struct, kernel};
use crate::recording::{Buffer, Groups, Recording};

/// Bits of a digit.
const DIGIT_BITS: u32 = 8;

device_struct! {
    struct Parameters as "Parameters" { count, shift, tiles }
}
kernel!(pub(crate) COUNT = "radix_count", Parameters, 2);
kernel!(pub(crate) KEYS = "radix_keys", Parameters, 3);
kernel!(pub(crate) PAIRS = "radix_pairs", Parameters, 5);

/// Buffers of keys and, where there are any, their payloads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pairs {
    /// The keys.
    pub keys: Buffer,
    /// What goes along with them.
    pub payloads: Option<Buffer>,
}

/// Records a stable sort of the first `count` keys by their lower `key_bits` bits (at most 32), rounded up to whole
/// digits of 8. The input stays as it is.
///
/// # Errors
/// There are too many elements.
pub fn record(recording: &mut Recording, pairs: Pairs, count: u32, key_bits: u32) -> Result<Pairs, GpuError> {
    check_count("radix sort", count)?;
    let passes = key_bits.min(32).div_ceil(DIGIT_BITS);
    let mut rooms: Vec<Pairs> = Vec::new();
    let mut from = pairs;
    for pass in 0..passes {
        // The input is kept; from the second pass on two rooms take turns.
        if rooms.len() < 2 {
            rooms.push(room(recording, pairs, count));
        }
        let to = rooms[pass as usize % 2];
        record_pass(recording, from, to, count, pass * DIGIT_BITS)?;
        from = to;
    }
    Ok(from)
}

fn room(recording: &mut Recording, like: Pairs, count: u32) -> Pairs {
    Pairs {
        keys: recording.buffer("sorted keys", count.into()),
        payloads: like.payloads.map(|_| recording.buffer("sorted payloads", count.into())),
    }
}

fn record_pass(
    recording: &mut Recording,
    from: Pairs,
    to: Pairs,
    count: u32,
    shift: u32,
) -> Result<(), GpuError> {
    let groups = tiles(count).max(1);
    let parameters = Parameters { count, shift, tiles: groups };
    let words = groups << DIGIT_BITS;
    let counts = recording.buffer("digits in tiles", words.into());
    recording.dispatch(&COUNT, &parameters, &[from.keys, counts], Groups::Direct(groups));
    let firsts = scan::record(recording, counts, words)?;
    let groups = Groups::Direct(groups);
    if let (Some(payloads), Some(sorted)) = (from.payloads, to.payloads) {
        let buffers = [from.keys, firsts, to.keys, payloads, sorted];
        recording.dispatch(&PAIRS, &parameters, &buffers, groups);
    } else {
        recording.dispatch(&KEYS, &parameters, &[from.keys, firsts, to.keys], groups);
    }
    Ok(())
}
