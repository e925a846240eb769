//! Exclusive prefix sums: Blelloch 1990, "Prefix sums and their applications"; reduce, then scan, in a tree of tiles.

use super::reduce::{Operation, reduce_tiles};
use super::{check_count, tiles};
use crate::error::GpuError;
use crate::kernel::{device_struct, kernel};
use crate::recording::{Buffer, Groups, Recording};

device_struct! {
    struct Parameters as "Parameters" { count, has_sums }
}
kernel!(pub(crate) SCAN = "scan", Parameters, 3);

/// The sum of the elements before each, modulo 2^32, and the sum of all behind.
#[must_use]
pub fn exclusive_scan(values: &[u32]) -> Vec<u32> {
    let mut sums = Vec::with_capacity(values.len() + 1);
    let mut sum = 0_u32;
    for value in values {
        sums.push(sum);
        sum = sum.wrapping_add(*value);
    }
    sums.push(sum);
    sums
}

/// Records [`exclusive_scan`] of the first `count` elements; the answer is `count` + 1 words.
///
/// # Errors
/// There are too many elements.
pub fn record(recording: &mut Recording, values: Buffer, count: u32) -> Result<Buffer, GpuError> {
    check_count("scan", count)?;
    let groups = tiles(count + 1);
    let sums = recording.buffer("prefix sums", u64::from(count) + 1);
    let tile_sums = if groups == 1 {
        values
    } else {
        let totals = reduce_tiles(recording, values, count, Operation::Add);
        // The last tile may hold nothing but the sum of all: its total is not needed.
        record(recording, totals, tiles(count))?
    };
    let parameters = Parameters { count, has_sums: u32::from(groups > 1) };
    recording.dispatch(&SCAN, &parameters, &[values, tile_sums, sums], Groups::Direct(groups));
    Ok(sums)
}
