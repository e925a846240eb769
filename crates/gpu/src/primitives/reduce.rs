//! Sum, least or greatest of an array: Harris 2007, "Optimizing parallel reduction in CUDA".

use super::{check_count, tiles};
use crate::error::GpuError;
use crate::kernel::{device_struct, kernel};
use crate::recording::{Buffer, Groups, Recording};

/// What is done to two elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operation {
    /// Their sum modulo 2^32.
    Add,
    /// The lesser.
    Min,
    /// The greater.
    Max,
}

device_struct! {
    struct Parameters as "Parameters" { count, operation }
}
kernel!(pub(crate) REDUCE = "reduce", Parameters, 2);

/// The sum (0 of nothing), least (2^32 - 1 of nothing) or greatest (0 of nothing) element.
#[must_use]
pub fn reduce(values: &[u32], operation: Operation) -> u32 {
    let values = values.iter().copied();
    match operation {
        Operation::Add => values.fold(0, u32::wrapping_add),
        Operation::Min => values.min().unwrap_or(u32::MAX),
        Operation::Max => values.max().unwrap_or(0),
    }
}

/// Records [`reduce`] of the first `count` elements; the answer is one word.
///
/// # Errors
/// There are too many elements.
pub fn record(
    recording: &mut Recording,
    values: Buffer,
    count: u32,
    operation: Operation,
) -> Result<Buffer, GpuError> {
    check_count("reduce", count)?;
    let (mut values, mut count) = (values, count);
    loop {
        let results = reduce_tiles(recording, values, count, operation);
        if tiles(count) <= 1 {
            return Ok(results);
        }
        (values, count) = (results, tiles(count));
    }
}

/// One dispatch: a word for each tile, at least one.
pub(super) fn reduce_tiles(
    recording: &mut Recording,
    values: Buffer,
    count: u32,
    operation: Operation,
) -> Buffer {
    let groups = tiles(count).max(1);
    let results = recording.buffer("reduced tiles", groups.into());
    let parameters = Parameters { count, operation: operation as u32 };
    recording.dispatch(&REDUCE, &parameters, &[values, results], Groups::Direct(groups));
    results
}
