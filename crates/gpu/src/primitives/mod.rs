//! Primitives over arrays of u32: each records its dispatches and has a counterpart on the CPU with the same answer.
//!
//! Counts that only the device knows stay there, in buffers; nothing is read back between dispatches. Elements are at
//! most [`MAX_ELEMENTS`], what a binding holds.

pub mod bitonic;
pub mod compact;
pub mod histogram;
pub mod queue;
pub mod radix;
pub mod reduce;
pub mod runs;
pub mod scan;

use crate::error::GpuError;
use crate::kernel::Kernel;
use crate::limits::BINDING_BYTES;

/// Elements that a workgroup takes.
pub const TILE: u32 = 2048;
/// Invocations of a workgroup.
pub const GROUP: u32 = 256;
/// Most elements of an array: what fits a binding on any device, with one word to spare.
pub const MAX_ELEMENTS: u32 = (BINDING_BYTES / 4) as u32 - 1;

/// Every kernel of this module.
pub(crate) static KERNELS: [&Kernel; 13] = [
    &reduce::REDUCE,
    &scan::SCAN,
    &compact::COUNT,
    &compact::EMIT,
    &runs::COUNT,
    &runs::EMIT,
    &histogram::HISTOGRAM,
    &radix::COUNT,
    &radix::KEYS,
    &radix::PAIRS,
    &bitonic::BITONIC,
    &queue::NEXT,
    &queue::SPLIT_RANGES,
];

/// Workgroups for so many elements.
pub(crate) const fn tiles(count: u32) -> u32 {
    count.div_ceil(TILE)
}

/// An error where there are more elements than an array may have.
pub(crate) fn check_count(what: &str, count: u32) -> Result<(), GpuError> {
    if count <= MAX_ELEMENTS {
        return Ok(());
    }
    Err(GpuError::Limit {
        what: format!("{what} in elements"),
        wanted: count.into(),
        limit: MAX_ELEMENTS.into(),
    })
}
