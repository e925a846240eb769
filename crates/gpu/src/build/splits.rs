//! Trees as splits, and splits of sorted codes from the top down: Garanzha, Pantaleoni, McAllister 2011, "Simpler and
//! faster HLBVH with work queues".
//!
//! The order of entries in queues is not one and the same each time; that of the splits is, since each stands at its own place.

use super::Count;
use crate::kernel::{device_struct, kernel};
use crate::primitives::queue;
use crate::recording::{Buffer, Groups, Recording};

device_struct! {
    struct Parameters as "Parameters" { count, capacity, leaf, full, next }
}
kernel!(pub(crate) SPLIT = "build_split", Parameters, 6);

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

/// Most entries of a queue of runs that are longer than a leaf.
pub(super) const fn capacity(count: u32, leaf: u32) -> u32 {
    count / (leaf + 1) + 1
}

/// Records the tree over `count` sorted codes whose leaves hold at most `leaf` (1 at least).
pub(super) fn record(recording: &mut Recording, codes: Buffer, count: Count, leaf: u32) -> Splits {
    let (leaf, most) = (leaf.max(1), count.most);
    let splits = Splits::none(recording, most);
    let queue = recording.buffer("runs", 2 * u64::from(capacity(most, leaf)));
    recording.write(queue, bytemuck::cast_slice(&[0, most]).to_vec());
    let tails = recording.upload("tails", &[u32::from(most > leaf), 0]);
    record_below(recording, (codes, super::codes::CODE_BITS), (queue, tails), &splits, (count, leaf));
    splits
}

/// Records the splits of runs of codes that differ in their lower bits alone. The runs that are longer than a leaf are in a queue,
/// whose tail comes first of two.
pub(super) fn record_below(
    recording: &mut Recording,
    (codes, bits): (Buffer, u32),
    (queue, tails): (Buffer, Buffer),
    splits: &Splits,
    (count, leaf): (Count, u32),
) {
    let capacity = capacity(count.most, leaf);
    let queues = [queue, recording.buffer("other runs", 2 * u64::from(capacity))];
    let workgroups = recording.buffer("workgroups", 3);
    // A level takes a bit, or halves.
    for level in 0..bits + queue::levels(count.most, leaf) - 1 {
        let (full, empty) = (level % 2, 1 - level % 2);
        let next = queue::NextParameters { capacity, full, empty };
        recording.dispatch(&queue::NEXT, &next, &[tails, workgroups], Groups::Direct(1));
        let parameters = Parameters { count: count.most, capacity, leaf, full, next: empty };
        let [full, empty] = [queues[full as usize], queues[empty as usize]];
        let buffers = [codes, tails, full, empty, splits.spans, splits.starting];
        count.dispatch(recording, &SPLIT, &parameters, &buffers, Groups::Indirect(workgroups, 0));
    }
}
