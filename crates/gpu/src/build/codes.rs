//! Morton codes of the centres of boxes, sorted: those of the builders on the CPU, to the bit.

use super::{Count, check_fits};
use crate::error::GpuError;
use crate::kernel::{device_struct, kernel};
use crate::primitives::radix::{self, Pairs};
use crate::primitives::tiles;
use crate::recording::{Buffer, Groups, Recording};
use vastlight_accel::Reference;
use vastlight_math::{Aabb, Vec3};

/// Bits of a code.
pub const CODE_BITS: u32 = 30;

device_struct! {
    struct ExtentsParameters as "Parameters" { count, corners }
}
device_struct! {
    struct Parameters as "Parameters" { count, cut }
}
kernel!(pub(crate) EXTENTS = "build_extents", ExtentsParameters, 2);
kernel!(pub(crate) CODES = "build_codes", Parameters, 4);

/// How a centre's place, in cells, becomes that of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rounding {
    /// To the nearest of 0.499 less, as builders from codes on the CPU have it.
    Nearest,
    /// Cut off, as `grid-sah` on the CPU has it.
    Cut,
}

/// Codes in the order of the boxes.
#[derive(Clone, Copy, Debug)]
pub struct Codes {
    /// The box around twice the centres, a box as all.
    pub extents: Buffer,
    /// The codes with the numbers of the boxes.
    pub pairs: Pairs,
}

/// Twice the centres' least and greatest coordinates, and the codes of boxes.
#[must_use]
pub fn codes(boxes: &[Aabb], rounding: Rounding) -> ([Vec3; 2], Vec<u32>) {
    let doubled = |b: &Aabb| {
        let Aabb { min, max } = Reference::new(b, 0).bounds();
        min + max
    };
    let Aabb { min, max } = Aabb::from_points(boxes.iter().map(doubled));
    let scale = (1024.0 / (max - min)).to_array().map(|scale| if scale.is_finite() { scale } else { 0.0 });
    let code = |b: &Aabb| {
        let cells = ((doubled(b) - min) * Vec3::from(scale)).min(Vec3::splat(1023.0));
        let cells = cells.to_array().map(|x| match rounding {
            Rounding::Nearest => (x - 0.499).round_ties_even().max(0.0) as u32,
            Rounding::Cut => x as u32,
        });
        (0..CODE_BITS).fold(0, |code, bit| code | (cells[2 - bit as usize % 3] >> (bit / 3) & 1) << bit)
    };
    ([min, max], boxes.iter().map(code).collect())
}

/// Records [`codes`] of `count` boxes; behind them come numbers larger than any code.
///
/// # Errors
/// There are too many.
pub fn record(
    recording: &mut Recording,
    boxes: Buffer,
    count: Count,
    rounding: Rounding,
) -> Result<Codes, GpuError> {
    check_fits(count.most)?;
    let extents = record_extents(recording, boxes, count, false);
    let groups = Groups::Direct(tiles(count.most));
    let keys = recording.buffer("codes", count.most.into());
    let payloads = recording.buffer("numbers", count.most.into());
    let parameters = Parameters { count: count.most, cut: u32::from(rounding == Rounding::Cut) };
    count.dispatch(recording, &CODES, &parameters, &[boxes, extents, keys, payloads], groups);
    Ok(Codes { extents, pairs: Pairs { keys, payloads: Some(payloads) } })
}

/// Records the box around twice the centres of boxes, or around their corners.
pub(super) fn record_extents(
    recording: &mut Recording,
    boxes: Buffer,
    count: Count,
    corners: bool,
) -> Buffer {
    let extents = recording.upload("extents", &[u32::MAX, u32::MAX, u32::MAX, 0, 0, 0]);
    let parameters = ExtentsParameters { count: count.most, corners: u32::from(corners) };
    let groups = Groups::Direct(tiles(count.most));
    count.dispatch(recording, &EXTENTS, &parameters, &[boxes, extents], groups);
    extents
}

/// Records a sort of codes: in the order of the codes, equal ones as they were.
///
/// # Errors
/// There are too many.
pub fn sort(recording: &mut Recording, codes: Codes, count: Count) -> Result<Sorted, GpuError> {
    // All bits: what is behind the elements that there are has the largest.
    let sorted = radix::record(recording, codes.pairs, count.most, u32::BITS)?;
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
