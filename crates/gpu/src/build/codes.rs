//! Morton codes of the centres of boxes, sorted: those of the builders on the CPU, to the bit.

use super::check_fits;
use crate::error::GpuError;
use crate::kernel::{device_struct, kernel};
use crate::primitives::radix::{self, Pairs};
use crate::primitives::tiles;
use crate::recording::{Buffer, Groups, Recording};

/// Bits of a code.
pub const CODE_BITS: u32 = 30;

device_struct! {
    struct Parameters as "Parameters" { count }
}
kernel!(pub(crate) EXTENTS = "build_extents", Parameters, 2);
kernel!(pub(crate) CODES = "build_codes", Parameters, 4);

/// Records the codes of `count` boxes with their numbers, in the order of the boxes.
///
/// # Errors
/// There are too many.
pub fn record(recording: &mut Recording, boxes: Buffer, count: u32) -> Result<Pairs, GpuError> {
    check_fits(count)?;
    let extents = recording.upload("extents", &[u32::MAX, u32::MAX, u32::MAX, 0, 0, 0]);
    let (parameters, groups) = (Parameters { count }, Groups::Direct(tiles(count)));
    recording.dispatch(&EXTENTS, &parameters, &[boxes, extents], groups);
    let keys = recording.buffer("codes", count.into());
    let payloads = recording.buffer("numbers", count.into());
    recording.dispatch(&CODES, &parameters, &[boxes, extents, keys, payloads], groups);
    Ok(Pairs { keys, payloads: Some(payloads) })
}

/// Records a sort of codes: in the order of the codes, equal ones as they were.
///
/// # Errors
/// There are too many.
pub fn sort(recording: &mut Recording, codes: Pairs, count: u32) -> Result<Sorted, GpuError> {
    let sorted = radix::record(recording, codes, count, CODE_BITS)?;
    Ok(Sorted { codes: sorted.keys, order: sorted.payloads.unwrap_or(sorted.keys) })
}

/// Codes in their order.
#[derive(Clone, Copy, Debug)]
pub struct Sorted {
    /// The codes.
    pub codes: Buffer,
    /// The numbers of their boxes.
    pub order: Buffer,
}
