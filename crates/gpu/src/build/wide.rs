//! Binary trees collapsed to eight-wide nodes, by opening the largest box until eight slots are taken: Wald, Benthin, Boulos 2008,
//! "Getting rid of packets".
//!
//! Level by level, queues find the binary nodes that become wide ones; their numbers are prefix sums over these, so that they do not depend on
//! the order in queues. The CPU's collapse finds the cheapest shares of slots instead, from the bottom up.

use super::DeviceTree;
use crate::error::GpuError;
use crate::kernel::{device_struct, kernel};
use crate::primitives::{GROUP, queue, scan};
use crate::recording::{Buffer, Download, Groups, Recording};
use crate::run::Results;
use vastlight_accel::wide::{ChildRef, Node8};
use vastlight_accel::{BinaryTree, Node};

/// Words of a wide node, as [`Node8`] lies in memory.
pub const WIDE_WORDS: u64 = (size_of::<Node8>() / 4) as u64;
/// Sides beyond this count as so long: areas stay finite.
const LONGEST_SIDE: f32 = 1e18;

device_struct! {
    struct BeginParameters as "Parameters" { most }
}
device_struct! {
    struct OpenParameters as "Parameters" { capacity, full, next }
}
device_struct! {
    struct NodesParameters as "Parameters" { most, capacity }
}
kernel!(pub(crate) BEGIN = "wide_begin", BeginParameters, 6);
kernel!(pub(crate) OPEN = "wide_open", OpenParameters, 5);
kernel!(pub(crate) NODES = "wide_nodes", NodesParameters, 5);

/// Buffers of a wide tree. Its root is node 0, or leaf 0 where there is no node.
#[derive(Clone, Copy, Debug)]
pub struct DeviceWide {
    /// Nodes of [`WIDE_WORDS`], and anything behind; their leaves count through.
    pub nodes: Buffer,
    /// How many nodes there are, also where they do not fit: one word.
    pub node_count: Buffer,
    /// First element and number of elements of each leaf.
    pub leaves: Buffer,
    /// How many leaves there are: one word.
    pub leaf_count: Buffer,
    /// Room for nodes and for leaves.
    pub rooms: [u32; 2],
}

/// What brings a wide tree back.
#[derive(Clone, Copy, Debug)]
pub struct WideDownload {
    parts: [Download; 4],
    room: u32,
}

impl DeviceWide {
    /// Records that the tree is brought back.
    pub fn download(&self, recording: &mut Recording) -> WideDownload {
        let [nodes, leaves] = self.rooms.map(u64::from);
        let parts = [
            recording.download(self.node_count, 1),
            recording.download(self.leaf_count, 1),
            recording.download(self.nodes, WIDE_WORDS * nodes),
            recording.download(self.leaves, 2 * leaves),
        ];
        WideDownload { parts, room: self.rooms[0] }
    }
}

impl WideDownload {
    /// The tree.
    ///
    /// # Errors
    /// There was not room for all nodes.
    pub fn wide(&self, results: &Results) -> Result<Wide, GpuError> {
        let [node_count, leaf_count, nodes, leaves] = self.parts.map(|part| results.words(part));
        if node_count[0] > self.room {
            let what = "room for wide nodes".to_owned();
            return Err(GpuError::Limit { what, wanted: node_count[0].into(), limit: self.room.into() });
        }
        let mut wide = Wide {
            nodes: bytemuck::pod_collect_to_vec(&nodes),
            leaves: bytemuck::pod_collect_to_vec(&leaves),
        };
        wide.nodes.truncate(node_count[0] as usize);
        wide.leaves.truncate(leaf_count[0] as usize);
        Ok(wide)
    }
}

/// A wide tree.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wide {
    /// The nodes.
    pub nodes: Vec<Node8>,
    /// First element and number of elements of each leaf.
    pub leaves: Vec<[u32; 2]>,
}

impl Wide {
    /// What is at the top.
    #[must_use]
    pub fn root(&self) -> Option<ChildRef> {
        let node = (!self.nodes.is_empty()).then_some(ChildRef::node(0));
        node.or((!self.leaves.is_empty()).then_some(ChildRef::leaf(0)))
    }
}

/// The wide tree of a binary one.
#[must_use]
pub fn collapse(tree: &BinaryTree) -> Wide {
    let mut is_wide = vec![false; tree.nodes.len()];
    if let Some(root) = tree.nodes.first() {
        is_wide[0] = !root.is_leaf();
    }
    // Children stand behind their parents.
    for node in 0..tree.nodes.len() {
        if is_wide[node] {
            let inner = slots(tree, node).into_iter().filter(|&slot| !tree.nodes[slot].is_leaf());
            inner.for_each(|slot| is_wide[slot] = true);
        }
    }
    let count = |of: &dyn Fn(usize) -> bool| {
        scan::exclusive_scan(&(0..tree.nodes.len()).map(|i| u32::from(of(i))).collect::<Vec<_>>())
    };
    let (wide, leaf) = (count(&|i| is_wide[i]), count(&|i| tree.nodes[i].is_leaf()));
    let child = |slot: usize| {
        if is_wide[slot] { ChildRef::node(wide[slot]) } else { ChildRef::leaf(leaf[slot]) }
    };
    let node = |i: usize| {
        let mut node = Node8::EMPTY;
        let slots = slots(tree, i).into_iter().enumerate();
        slots.for_each(|(at, slot)| node.set(at, child(slot), &tree.nodes[slot].bounds));
        node
    };
    let nodes = (0..tree.nodes.len()).filter(|&i| is_wide[i]).map(node).collect();
    let leaves = tree.nodes.iter().filter(|node| node.is_leaf());
    Wide { nodes, leaves: leaves.map(|node| [node.first, node.count]).collect() }
}

/// The binary nodes in the slots of the wide node that a binary one becomes.
fn slots(tree: &BinaryTree, node: usize) -> Vec<usize> {
    let left = tree.nodes[node].left as usize;
    let mut slots = vec![left, left + 1];
    while slots.len() < 8 {
        let inner = (0..slots.len()).filter(|&slot| !tree.nodes[slots[slot]].is_leaf());
        let area = |&slot: &usize| area(&tree.nodes[slots[slot]]);
        // The first of several.
        let Some(largest) = inner.reduce(|a, b| if area(&b) > area(&a) { b } else { a }) else { break };
        let left = tree.nodes[slots[largest]].left as usize;
        slots[largest] = left;
        slots.push(left + 1);
    }
    slots
}

fn area(node: &Node) -> f32 {
    let d = (node.bounds.max - node.bounds.min).min(vastlight_math::Vec3::splat(LONGEST_SIDE));
    d.x * d.y + d.y * d.z + d.z * d.x
}

/// Records the wide tree of a binary one, with room for `capacity` nodes: what is beyond is left out, and counted. Drivers may
/// round areas differently: boxes of nearly the same area may be opened in another order than on the CPU.
///
/// # Errors
/// There are too many.
pub fn record(recording: &mut Recording, tree: &DeviceTree, capacity: u32) -> Result<DeviceWide, GpuError> {
    let most = tree.most_nodes();
    let nodes = recording.buffer("wide nodes", WIDE_WORDS * u64::from(capacity.max(1)));
    let leaves = recording.buffer("leaves", 2 * u64::from(tree.count));
    let [node_count, leaf_count] = ["wide nodes", "leaves"].map(|label| recording.buffer(label, 1));
    let rooms = [capacity, tree.count];
    let wide = DeviceWide { nodes, node_count, leaves, leaf_count, rooms };
    if most == 0 {
        recording.clear(node_count);
        recording.clear(leaf_count);
        return Ok(wide);
    }
    let [is_wide, is_leaf] = record_levels(recording, tree);
    let wide_numbers = scan::record(recording, is_wide, most)?;
    let leaf_numbers = scan::record(recording, is_leaf, most)?;
    let buffers = [tree.nodes, wide_numbers, leaf_numbers, nodes, leaves];
    let groups = Groups::Direct(most.div_ceil(GROUP));
    recording.dispatch(&NODES, &NodesParameters { most, capacity }, &buffers, groups);
    recording.copy(wide_numbers, most.into(), node_count, 1);
    recording.copy(leaf_numbers, most.into(), leaf_count, 1);
    Ok(wide)
}

/// Records which nodes become wide ones, and which are leaves.
fn record_levels(recording: &mut Recording, tree: &DeviceTree) -> [Buffer; 2] {
    let most = tree.most_nodes();
    let [is_wide, is_leaf] = ["become wide", "are leaves"].map(|label| recording.buffer(label, most.into()));
    let capacity = most / 2 + 1;
    let queues = ["queue of nodes", "other nodes"].map(|label| recording.buffer(label, capacity.into()));
    let (tails, workgroups) = (recording.upload("tails", &[0_u32; 2]), recording.buffer("workgroups", 3));
    let buffers = [tree.nodes, tree.pairs, is_leaf, is_wide, queues[0], tails];
    let groups = Groups::Direct(most.div_ceil(GROUP));
    recording.dispatch(&BEGIN, &BeginParameters { most }, &buffers, groups);
    for level in 0..tree.levels {
        let (full, empty) = (level % 2, 1 - level % 2);
        let next = queue::NextParameters { capacity, full, empty };
        recording.dispatch(&queue::NEXT, &next, &[tails, workgroups], Groups::Direct(1));
        let buffers = [tree.nodes, tails, queues[full as usize], queues[empty as usize], is_wide];
        let parameters = OpenParameters { capacity, full, next: empty };
        recording.dispatch(&OPEN, &parameters, &buffers, Groups::Indirect(workgroups, 0));
    }
    [is_wide, is_leaf]
}
