//! A tree over sorted codes from the bottom up, in one pass: Apetrei 2014, "Fast and simple agglomerative LBVH
//! construction".
//!
//! Deviations: boxes come later ([`super::pyramid`]), so that what siblings tell each other is one word; equal codes are halved, and
//! runs that two leaves can hold parted so that two do, as in the tree `morton` of the CPU, which this is.

use super::codes::Sorted;
use crate::kernel::{device_struct, kernel};
use crate::primitives::GROUP;
use crate::recording::{Buffer, Groups, Recording};

device_struct! {
    struct Parameters as "Parameters" { count, leaf }
}
kernel!(pub(crate) MERGE = "build_merge", Parameters, 4);

/// The nodes with children of a tree over `0..count`, each at its split: the last element on its left.
#[derive(Clone, Copy, Debug)]
pub(super) struct Splits {
    /// Start and end of the node's run; zeros where there is no split.
    pub(super) spans: Buffer,
    /// How many of the nodes start at each element.
    pub(super) starting: Buffer,
}

impl Splits {
    /// Records room for the splits over `count` elements, of which there are none yet.
    pub(super) fn none(recording: &mut Recording, count: u32) -> Self {
        let spans = recording.buffer("spans", 2 * u64::from(count));
        let starting = recording.buffer("starting nodes", count.into());
        recording.clear(spans);
        recording.clear(starting);
        Self { spans, starting }
    }
}

/// Records the tree over `count` sorted codes whose leaves hold at most `leaf` (1 at least).
pub(super) fn record(recording: &mut Recording, sorted: Sorted, count: u32, leaf: u32) -> Splits {
    let splits = Splits::none(recording, count);
    let left_behind = recording.buffer("left behind", count.into());
    recording.clear(left_behind);
    let buffers = [sorted.codes, left_behind, splits.spans, splits.starting];
    let groups = Groups::Direct(count.div_ceil(GROUP));
    recording.dispatch(&MERGE, &Parameters { count, leaf: leaf.max(1) }, &buffers, groups);
    splits
}
