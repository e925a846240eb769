//! A tree over sorted codes from the bottom up, in one pass: Apetrei 2014, "Fast and simple agglomerative LBVH
//! construction".
//!
//! Deviations: boxes come later ([`super::pyramid`]), so that what siblings tell each other is one word; equal codes are halved, and
//! runs that two leaves can hold parted so that two do, as in the tree `morton` of the CPU, which this is.

use super::Count;
use super::codes::Sorted;
use super::splits::Splits;
use crate::kernel::{device_struct, kernel};
use crate::primitives::GROUP;
use crate::recording::{Groups, Recording};

device_struct! {
    struct Parameters as "Parameters" { count, leaf }
}
kernel!(pub(crate) MERGE = "build_merge", Parameters, 4);

/// Records the tree over `count` sorted codes whose leaves hold at most `leaf` (1 at least).
pub(super) fn record(recording: &mut Recording, sorted: Sorted, count: Count, leaf: u32) -> Splits {
    let splits = Splits::none(recording, count.most);
    let left_behind = recording.buffer("left behind", count.most.into());
    recording.clear(left_behind);
    let buffers = [sorted.codes, left_behind, splits.spans, splits.starting];
    let groups = Groups::Direct(count.most.div_ceil(GROUP));
    let parameters = Parameters { count: count.most, leaf: leaf.max(1) };
    count.dispatch(recording, &MERGE, &parameters, &buffers, groups);
    splits
}
