//! Budgeted splitting of triangles in front of any builder: D. K. Bogolepov's thesis, 2014, chapter 4.3.
//!
//! As `presplit` of `vastlight-accel` with a budget that is given: each box asks for as many cuts as make its parts no longer than 1/128 of the
//! scene; where all ask for more than there is room for, each gets the same portion, rounded down. A second pass with what is
//! left cuts along other axes. How many parts there are stays on the device.
//!
//! Deviations from the CPU's: triangles are clipped in single precision, with a slack of 2^-18 of the largest coordinate where the CPU has
//! 2^-44, so boxes are larger by that; requests and planes are the same numbers. A slab in which nothing is found keeps its whole box,
//! where the CPU drops it.

use super::codes::record_extents;
use super::{Count, check_fits};
use crate::error::GpuError;
use crate::kernel::{device_struct, kernel};
use crate::primitives::reduce::{self, Operation};
use crate::primitives::{GROUP, scan};
use crate::recording::{Buffer, Groups, Recording};

const PASSES: u32 = 2;

device_struct! {
    struct Parameters as "Parameters" { count, most }
}
device_struct! {
    struct CutParameters as "Parameters" { count, most, nothing }
}
kernel!(pub(crate) WANTED = "split_wanted", Parameters, 3);
kernel!(pub(crate) GRANT = "split_grant", Parameters, 2);
kernel!(pub(crate) CUT = "split_cut", CutParameters, 8);

/// Boxes of parts of triangles.
#[derive(Clone, Copy, Debug)]
pub struct Parts {
    /// The boxes, and anything behind.
    pub boxes: Buffer,
    /// The triangle of each.
    pub owners: Buffer,
    /// How many there are.
    pub count: Count,
}

/// Most parts that a budget, a multiple of the triangles, allows.
#[must_use]
pub fn most_parts(triangles: u32, budget: f32) -> u32 {
    // A budget that is no number allows no more than the triangles.
    let most = f64::from(triangles) * f64::from(budget.max(1.0));
    (most as u32).max(triangles)
}

/// Records the parts of triangles, `most` at most (not fewer than triangles), whose `count` boxes are known.
///
/// # Errors
/// There are too many.
pub fn record(
    recording: &mut Recording,
    mesh: [Buffer; 2],
    boxes: Buffer,
    (count, most): (u32, u32),
) -> Result<Parts, GpuError> {
    check_fits(most)?;
    let extents = record_extents(recording, boxes, Count::exactly(count), true);
    let numbers: Vec<u32> = (0..count).collect();
    let owners = recording.upload("owners", &numbers);
    let mut parts = Parts { boxes, owners, count: Count::exactly(count) };
    for _ in 0..if count > 0 { PASSES } else { 0 } {
        parts = record_pass(recording, mesh, &parts, (extents, most))?;
    }
    Ok(parts)
}

fn record_pass(
    recording: &mut Recording,
    [positions, triangles]: [Buffer; 2],
    whole: &Parts,
    (extents, most): (Buffer, u32),
) -> Result<Parts, GpuError> {
    let groups = Groups::Direct(most.div_ceil(GROUP));
    let (count, parameters) = (whole.count, Parameters { count: whole.count.most, most });
    let cuts = recording.buffer("cuts", most.into());
    count.dispatch(recording, &WANTED, &parameters, &[whole.boxes, extents, cuts], groups);
    let total = reduce::record(recording, cuts, most, Operation::Add)?;
    count.dispatch(recording, &GRANT, &parameters, &[total, cuts], groups);
    let before = scan::record(recording, cuts, most)?;
    let boxes = recording.buffer("boxes of parts", super::boxes::BOX_WORDS * u64::from(most));
    let owners = recording.buffer("owners of parts", most.into());
    let known = recording.buffer("count of parts", 1);
    let buffers = [positions, triangles, whole.boxes, whole.owners, before, boxes, owners, known];
    let parameters = CutParameters { count: count.most, most, nothing: 0 };
    count.dispatch(recording, &CUT, &parameters, &buffers, groups);
    Ok(Parts { boxes, owners, count: Count { most, known: Some(known) } })
}
