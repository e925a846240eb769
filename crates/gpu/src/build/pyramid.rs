//! Boxes of runs: a pyramid of which each level has a box for four of the level below.
//!
//! A node of a tree holds a run of elements, so its box follows from the pyramid. No workgroup needs to see what another wrote in the
//! same dispatch, as it would where boxes go up a tree with a counter a node: WGSL orders accesses of one atomic word, not those
//! of others around it.

use super::boxes::BOX_WORDS;
use super::check_fits;
use crate::error::GpuError;
use crate::kernel::{device_struct, kernel};
use crate::primitives::GROUP;
use crate::recording::{Buffer, Groups, Recording};

/// Levels that a dispatch adds.
const LEVELS: u32 = 4;
/// Levels above one with at most so many boxes may be missing.
const TOP: u32 = 32;

device_struct! {
    struct GatherParameters as "Parameters" { count }
}
device_struct! {
    struct LevelsParameters as "Parameters" { first, length }
}
kernel!(pub(crate) GATHER = "build_gather", GatherParameters, 3);
kernel!(pub(crate) LEVELS_KERNEL = "build_levels", LevelsParameters, 1);

/// Records the pyramid over `count` boxes in an order.
///
/// # Errors
/// There are too many.
pub(super) fn record(
    recording: &mut Recording,
    boxes: Buffer,
    order: Buffer,
    count: u32,
) -> Result<Buffer, GpuError> {
    check_fits(count)?;
    let bases = bases(count);
    let (last, length) = bases[bases.len() - 1];
    let boxes_of_all = after(last, length).0;
    let pyramid = recording.buffer("pyramid of boxes", BOX_WORDS * u64::from(boxes_of_all));
    for (first, length) in bases {
        let groups = Groups::Direct(length.div_ceil(GROUP));
        if first == 0 {
            recording.dispatch(&GATHER, &GatherParameters { count }, &[boxes, order, pyramid], groups);
        } else {
            recording.dispatch(&LEVELS_KERNEL, &LevelsParameters { first, length }, &[pyramid], groups);
        }
    }
    Ok(pyramid)
}

/// First box and number of boxes of each level above which levels are added, the lowest first.
fn bases(count: u32) -> Vec<(u32, u32)> {
    let mut bases = vec![(0, count)];
    loop {
        let (first, length) = bases[bases.len() - 1];
        let (above, length) = after(first, length);
        let top = (above - length, length);
        if length <= TOP {
            return bases;
        }
        bases.push(top);
    }
}

/// Where the levels that one dispatch adds end, and how many boxes the last of them has.
fn after(first: u32, length: u32) -> (u32, u32) {
    (0..LEVELS).fold((first + length, length), |(end, length), _| {
        let above = length.div_ceil(4);
        (end + above, above)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_kernels_know_are_the_same() {
        assert!(GATHER.wgsl().contains(&format!("const LEVELS: u32 = {LEVELS}u;")));
        assert!(super::super::nodes::NODES.wgsl().contains(&format!("const TOP: u32 = {TOP}u;")));
    }

    #[test]
    fn levels_follow_each_other_and_end_with_few_boxes() {
        assert_eq!(bases(0), [(0, 0)]);
        assert_eq!(bases(8192), [(0, 8192)]);
        // 8193, 2049, 513, 129 and 33 boxes.
        assert_eq!(bases(8193), [(0, 8193), (8193 + 2049 + 513 + 129, 33)]);
        assert_eq!(after(8193 + 2049 + 513 + 129, 33), (8193 + 2049 + 513 + 129 + 33 + 9 + 3 + 1 + 1, 1));
        assert_eq!(bases(1 << 24).len(), 3);
    }
}
