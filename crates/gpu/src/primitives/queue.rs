//! Work queues with one atomic operation a workgroup: Garanzha, Pantaleoni, McAllister 2011, "Simpler and faster HLBVH
//! with work queues".
//!
//! How many entries a level has is known on the device only: a small kernel turns it into the workgroups of the next
//! dispatch. Here ranges are cut in the middle, as HLBVH2 does where all codes are equal; builders bring their own cuts.

use crate::error::GpuError;
use crate::kernel::{device_struct, kernel};
use crate::limits::{BINDING_BYTES, WORKGROUPS_PER_AXIS};
use crate::primitives::GROUP;
use crate::recording::{Buffer, Groups, Recording};

/// Most entries of a queue of ranges: what fits a binding and one dispatch.
pub const MAX_ENTRIES: u32 = {
    let (fitting, dispatched) = ((BINDING_BYTES / 8) as u32, WORKGROUPS_PER_AXIS * GROUP);
    if fitting < dispatched { fitting } else { dispatched }
};

device_struct! {
    pub(crate) struct NextParameters as "Parameters" { capacity, full, empty }
}
device_struct! {
    struct SplitParameters as "Parameters" { capacity, leaf, full, next, leaves }
}
kernel!(pub(crate) NEXT = "queue_next", NextParameters, 2);
kernel!(pub(crate) SPLIT_RANGES = "split_ranges", SplitParameters, 4);

/// Buffers of the leaves of a tree of ranges.
#[derive(Clone, Copy, Debug)]
pub struct Leaves {
    /// Starts and ends, in any order: how workgroups follow each other decides it.
    pub ranges: Buffer,
    /// Three words; the last is how many leaves there would be in queues without bounds.
    pub tails: Buffer,
}

/// The leaves, from left to right, that come from cutting 0..`count` in the middle until at most `leaf` (1 at least) are
/// together.
#[must_use]
pub fn split_ranges(count: u32, leaf: u32) -> Vec<[u32; 2]> {
    let mut leaves = Vec::new();
    let mut open = vec![[0, count]];
    while let Some([start, end]) = open.pop() {
        if end - start > leaf.max(1) {
            let middle = start + (end - start) / 2;
            open.extend([[middle, end], [start, middle]]);
        } else {
            leaves.push([start, end]);
        }
    }
    leaves
}

/// Records [`split_ranges`] with queues of `capacity` entries (at most [`MAX_ENTRIES`]); what does not fit is dropped and
/// counted.
///
/// # Errors
/// The queues are too long.
pub fn record(recording: &mut Recording, count: u32, leaf: u32, capacity: u32) -> Result<Leaves, GpuError> {
    if capacity > MAX_ENTRIES {
        let what = "a queue in entries".to_owned();
        return Err(GpuError::Limit { what, wanted: capacity.into(), limit: MAX_ENTRIES.into() });
    }
    let leaf = leaf.max(1);
    let words = 2 * u64::from(capacity.max(1));
    let leaves = recording.buffer("leaves", words);
    let queues =
        [recording.buffer("queue of ranges", words), recording.buffer("other queue of ranges", words)];
    recording.write(queues[0], bytemuck::cast_slice(&[0, count]).to_vec());
    let tails = recording.upload("tails", &[1_u32, 0, 0]);
    let workgroups = recording.buffer("workgroups", 3);
    for level in 0..levels(count, leaf) {
        let (full, empty) = (level % 2, 1 - level % 2);
        let next = NextParameters { capacity, full, empty };
        recording.dispatch(&NEXT, &next, &[tails, workgroups], Groups::Direct(1));
        let split = SplitParameters { capacity, leaf, full, next: empty, leaves: 2 };
        let buffers = [tails, queues[full as usize], queues[empty as usize], leaves];
        recording.dispatch(&SPLIT_RANGES, &split, &buffers, Groups::Indirect(workgroups, 0));
    }
    Ok(Leaves { ranges: leaves, tails })
}

/// How many levels the tree has.
pub(crate) fn levels(count: u32, leaf: u32) -> u32 {
    let (mut longest, mut levels) = (count, 1);
    while longest > leaf {
        longest = longest.div_ceil(2);
        levels += 1;
    }
    levels
}
