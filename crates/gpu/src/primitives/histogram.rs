//! How often each value of some bits of the keys occurs.

use super::{check_count, tiles};
use crate::error::GpuError;
use crate::kernel::{device_struct, kernel};
use crate::recording::{Buffer, Groups, Recording};

/// Most bits that are looked at: their counters fit the memory of a workgroup.
pub const MAX_BITS: u32 = 10;

device_struct! {
    struct Parameters as "Parameters" { count, shift, bins }
}
kernel!(pub(crate) HISTOGRAM = "histogram", Parameters, 2);

/// How many keys have each value of the `bits` bits (at most [`MAX_BITS`]) from `shift` (at most 31) on.
#[must_use]
pub fn histogram(keys: &[u32], shift: u32, bits: u32) -> Vec<u32> {
    let bins = 1_usize << bits.min(MAX_BITS);
    let mut counts = vec![0; bins];
    for key in keys {
        counts[(key >> shift.min(31)) as usize & (bins - 1)] += 1;
    }
    counts
}

/// Records [`histogram`] of the first `count` keys; the answer is a word for each value.
///
/// # Errors
/// There are too many elements.
pub fn record(
    recording: &mut Recording,
    keys: Buffer,
    count: u32,
    shift: u32,
    bits: u32,
) -> Result<Buffer, GpuError> {
    check_count("histogram", count)?;
    let bins = 1 << bits.min(MAX_BITS);
    let counts = recording.buffer("histogram", u64::from(bins));
    recording.clear(counts);
    let parameters = Parameters { count, shift: shift.min(31), bins };
    recording.dispatch(&HISTOGRAM, &parameters, &[keys, counts], Groups::Direct(tiles(count).max(1)));
    Ok(counts)
}
