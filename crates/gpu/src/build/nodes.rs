//! The nodes of a tree whose splits are known: numbers depth first, and boxes.

use super::splits::Splits;
use super::{Count, DeviceTree, NODE_WORDS};
use crate::error::GpuError;
use crate::kernel::{device_struct, kernel};
use crate::primitives::{GROUP, scan};
use crate::recording::{Buffer, Groups, Recording};

device_struct! {
    struct Parameters as "Parameters" { count, most }
}
device_struct! {
    struct RefitParameters as "Parameters" { nodes, count }
}
kernel!(pub(crate) NODES = "build_nodes", Parameters, 4);
kernel!(pub(crate) REFIT = "build_refit", RefitParameters, 3);

/// Records the nodes over `count` elements in their `order`, with a pyramid over their boxes in that order.
///
/// # Errors
/// There are too many.
pub(super) fn record(
    recording: &mut Recording,
    splits: Splits,
    (pyramid, order): (Buffer, Buffer),
    count: Count,
) -> Result<DeviceTree, GpuError> {
    let most = count.most;
    let before = scan::record(recording, splits.starting, most)?;
    let nodes = recording.buffer("nodes", NODE_WORDS * u64::from(most_nodes(most)));
    let buffers = [splits.spans, before, pyramid, nodes];
    let groups = Groups::Direct(most.div_ceil(GROUP));
    count.dispatch(recording, &NODES, &Parameters { count: most, most }, &buffers, groups);
    let pairs = recording.buffer("pairs of children", 1);
    recording.copy(before, most.into(), pairs, 1);
    Ok(DeviceTree { nodes, pairs, order, count: most, levels: most })
}

/// A tree over nothing.
pub(super) fn nothing(recording: &mut Recording) -> DeviceTree {
    let [nodes, pairs, order] =
        ["nodes", "pairs of children", "order"].map(|label| recording.buffer(label, 1));
    recording.clear(pairs);
    DeviceTree { nodes, pairs, order, count: 0, levels: 0 }
}

/// Most nodes of a tree over so many elements.
pub(super) const fn most_nodes(count: u32) -> u32 {
    (2 * count).saturating_sub(1)
}

/// Records new boxes for the nodes of a tree over boxes that moved; `pyramid` is over them in the order of the tree.
pub(super) fn refit(recording: &mut Recording, tree: &DeviceTree, pyramid: Buffer) {
    let nodes = most_nodes(tree.count);
    let parameters = RefitParameters { nodes, count: tree.count };
    let groups = Groups::Direct(nodes.div_ceil(GROUP));
    recording.dispatch(&REFIT, &parameters, &[pyramid, tree.pairs, tree.nodes], groups);
}
