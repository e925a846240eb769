//! Builders on a device: boxes in, the tree of the builders on the CPU out.
//!
//! A tree is known by its splits: a node with children, which holds a run of elements, is named after the last element on its left.
//! What finds the splits is a builder; the numbers and boxes of nodes follow for all alike.

pub mod boxes;
pub mod clusters;
pub mod codes;
mod count;
mod grid;
pub mod hlbvh2;
mod merge;
mod nodes;
pub mod parts;
mod pyramid;
pub mod regions;
mod splits;
pub mod wide;

use crate::error::GpuError;
use crate::kernel::Kernel;
use crate::limits::WORKGROUPS_PER_AXIS;
use crate::primitives::{GROUP, queue};
use crate::recording::{Buffer, Recording};
use codes::Rounding;
pub use count::Count;
use vastlight_accel::{BinaryTree, Node};

/// Words of a node: box, left child, first element, number of elements; as [`Node`] lies in memory.
pub const NODE_WORDS: u64 = 9;
/// Most elements of a tree: one invocation for each of its nodes.
pub const MAX_ELEMENTS: u32 = WORKGROUPS_PER_AXIS / 2 * GROUP;

/// Every kernel of this module.
pub(crate) static KERNELS: [&Kernel; 23] = [
    &boxes::BOXES,
    &clusters::CLUSTERS,
    &codes::EXTENTS,
    &codes::CODES,
    &parts::WANTED,
    &parts::GRANT,
    &parts::CUT,
    &merge::MERGE,
    &splits::SPLIT,
    &hlbvh2::COUNT_CELLS,
    &hlbvh2::TOP,
    &hlbvh2::PLACE,
    &hlbvh2::QUEUE,
    &grid::DIVIDE,
    &grid::GATHER,
    &grid::ALIKE,
    &pyramid::GATHER,
    &pyramid::LEVELS_KERNEL,
    &nodes::NODES,
    &nodes::REFIT,
    &wide::BEGIN,
    &wide::OPEN,
    &wide::NODES,
];

/// Builders by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Builder {
    /// From sorted codes in one pass from the bottom up: the tree that the CPU calls `morton`.
    Morton,
    /// The same tree from the top down, level by level, from work queues: `MiddleOnly` of the paper on HLBVH2.
    MortonQueues,
    /// HLBVH2: clusters from work queues, under a tree by the surface-area heuristic over a grid.
    Hlbvh2,
    /// The surface-area heuristic over grids of several levels of detail.
    GridSah,
}

impl Builder {
    /// All, with their names.
    pub const ALL: [(&'static str, Self); 4] = [
        ("morton", Self::Morton),
        ("morton-queues", Self::MortonQueues),
        ("hlbvh2", Self::Hlbvh2),
        ("grid-sah", Self::GridSah),
    ];

    /// The builder of this name.
    #[must_use]
    pub fn of_name(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|(known, _)| *known == name).map(|(_, builder)| *builder)
    }

    const fn rounding(self) -> Rounding {
        match self {
            Self::GridSah => Rounding::Cut,
            _ => Rounding::Nearest,
        }
    }

    /// Most levels of nodes above equal codes.
    const fn levels(self) -> u32 {
        match self {
            Self::Morton | Self::MortonQueues => codes::CODE_BITS,
            Self::Hlbvh2 => hlbvh2::LEVELS,
            Self::GridSah => grid::LEVELS,
        }
    }
}

/// Buffers of a tree.
#[derive(Clone, Copy, Debug)]
pub struct DeviceTree {
    /// Nodes of [`NODE_WORDS`]: as those of [`BinaryTree::nodes`], and anything behind.
    pub nodes: Buffer,
    /// How many pairs of children there are: one word.
    pub pairs: Buffer,
    /// The elements in the order of the leaves.
    pub order: Buffer,
    /// How many elements there are, or may be at most.
    pub count: u32,
    /// Most nodes with children on a way from the root to a leaf.
    pub levels: u32,
}

impl DeviceTree {
    /// Most nodes that there may be.
    #[must_use]
    pub const fn most_nodes(&self) -> u32 {
        nodes::most_nodes(self.count)
    }
}

/// Where stages of a build end: their names, and how many commands there were.
pub type Stages = Vec<(&'static str, usize)>;

/// Records a build over `count` boxes of [`boxes::BOX_WORDS`], with at most `leaf` (1 at least) of them in a leaf. Nothing is read
/// back in between. The tree is the same to the bit each time, on each device, and on the CPU; but coordinates below 2^-126
/// may count as 0.
///
/// # Errors
/// There are too many.
pub fn record(
    recording: &mut Recording,
    builder: Builder,
    boxes: Buffer,
    (count, leaf): (u32, u32),
    stages: &mut Stages,
) -> Result<DeviceTree, GpuError> {
    record_counted(recording, builder, boxes, (Count::exactly(count), leaf), stages)
}

/// As [`record`], over as many boxes as the device may alone know. What is behind in the tree's order is anything.
///
/// # Errors
/// There may be too many.
pub fn record_counted(
    recording: &mut Recording,
    builder: Builder,
    boxes: Buffer,
    (count, leaf): (Count, u32),
    stages: &mut Stages,
) -> Result<DeviceTree, GpuError> {
    if count.most == 0 {
        return Ok(nodes::nothing(recording));
    }
    let mut mark = |name, recording: &Recording| stages.push((name, recording.commands().len()));
    let codes = codes::record(recording, boxes, count, builder.rounding())?;
    mark("codes", recording);
    let sorted = codes::sort(recording, codes, count)?;
    mark("sort", recording);
    let (splits, order) = match builder {
        Builder::Morton => (merge::record(recording, sorted, count, leaf), sorted.order),
        Builder::MortonQueues => (splits::record(recording, sorted.codes, count, leaf), sorted.order),
        Builder::Hlbvh2 => {
            let clusters = hlbvh2::record_top(recording, codes.extents, sorted, count);
            mark("top", recording);
            (hlbvh2::record(recording, &clusters, count, leaf), clusters.placed.order)
        }
        Builder::GridSah => {
            let cells = grid::record_cells(recording, codes.extents, sorted, count);
            mark("top", recording);
            grid::record(recording, &cells, count, leaf)
        }
    };
    mark("hierarchy", recording);
    let pyramid = pyramid::record(recording, boxes, order, count.most)?;
    mark("boxes", recording);
    let tree = nodes::record(recording, splits, (pyramid, order), count)?;
    mark("nodes", recording);
    Ok(DeviceTree { levels: builder.levels() + queue::levels(count.most, leaf.max(1)), ..tree })
}

/// Records new boxes for all nodes of a tree whose elements have the boxes `boxes` now.
///
/// # Errors
/// There are too many.
pub fn record_refit(recording: &mut Recording, tree: &DeviceTree, boxes: Buffer) -> Result<(), GpuError> {
    if tree.count == 0 {
        return Ok(());
    }
    let pyramid = pyramid::record(recording, boxes, tree.order, tree.count)?;
    nodes::refit(recording, tree, pyramid);
    Ok(())
}

/// The tree of the words of a [`DeviceTree`]: nodes, how many pairs, order.
#[must_use]
pub fn tree_of_words(nodes: &[u32], pairs: u32, mut order: Vec<u32>) -> BinaryTree {
    let count = if order.is_empty() { 0 } else { 1 + 2 * pairs as usize };
    let words = &nodes[..nodes.len().min(count * NODE_WORDS as usize)];
    let nodes = bytemuck::pod_collect_to_vec::<u32, Node>(words);
    order.truncate(nodes.first().map_or(0, |root| root.count as usize));
    BinaryTree { nodes, prims: order }
}

/// An error where there are more elements than a tree may have.
fn check_fits(count: u32) -> Result<(), GpuError> {
    if count <= MAX_ELEMENTS {
        return Ok(());
    }
    let what = "a tree in elements".to_owned();
    Err(GpuError::Limit { what, wanted: count.into(), limit: MAX_ELEMENTS.into() })
}
