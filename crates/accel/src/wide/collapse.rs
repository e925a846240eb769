//! From a binary tree to the plan of an eight-wide one, of least expected cost.
//!
//! Dynamic programming over the binary tree as in Ylitie, Karras, Laine 2017, "Efficient incoherent ray traversal on GPUs
//! through compressed wide BVHs", section 3.1. For each binary node, from the bottom up: the least cost of holding
//! what is below in at most 1, 2, ... 7 slots of a wide node. Deviation: the cost of a leaf is that of a block, since its
//! triangles are tested at once.

use super::{ChildRef, Node8};
use crate::{BinaryTree, Node};
use rayon::prelude::*;
use vastlight_math::Aabb;

/// Cost of testing a node's eight boxes.
const NODE_COST: f32 = 1.0;
/// Cost of testing a leaf.
const LEAF_COST: f32 = 1.0;
/// Subtrees with fewer nodes are worked on by one thread.
const SERIAL: usize = 1 << 12;

/// The shape of a wide tree: which binary nodes become slots, and which become leaves.
#[derive(Debug, Default)]
pub(super) struct Plan {
    /// For each wide node, for each slot: the binary node and what it becomes.
    pub(super) nodes: Vec<[(u32, ChildRef); 8]>,
    /// For each leaf, the binary node whose primitives it holds.
    pub(super) leaves: Vec<u32>,
    /// What the root becomes.
    pub(super) root: Option<ChildRef>,
    /// Wide nodes on the longest way from the root to a leaf.
    pub(super) levels: usize,
}

/// A slot with nothing in it.
const VACANT: (u32, ChildRef) = (0, ChildRef::NONE);

/// The best ways to hold what is below a binary node.
#[derive(Clone, Copy, Debug)]
struct Ways {
    /// Least cost with at most `i + 1` slots.
    cost: [f32; 7],
    /// How many of `i + 1` slots go to the left child; 0 where the node itself takes one slot.
    left: [u8; 7],
    /// How many of eight slots go to the left child where the node becomes a wide one; 0 where it becomes a leaf.
    left_of_node: u8,
}

impl Ways {
    const NONE: Self = Self { cost: [0.0; 7], left: [0; 7], left_of_node: 0 };

    fn leaf(cost: f32) -> Self {
        Self { cost: [cost; 7], ..Self::NONE }
    }

    /// The best ways of a node whose children have the ways `l` and `r`.
    fn inner(node: &Node, l: &Self, r: &Self, max_leaf: u32) -> Self {
        let area = node.bounds.half_area();
        let mut ways = Self::NONE;
        let (cost, left) = best_shares(l, r, 8);
        (ways.cost[0], ways.left_of_node) = (cost + area * NODE_COST, left);
        if node.count <= max_leaf && area * LEAF_COST <= ways.cost[0] {
            (ways.cost[0], ways.left_of_node) = (area * LEAF_COST, 0);
        }
        for slots in 2..8 {
            let (cost, left) = best_shares(l, r, slots);
            let fewer = ways.cost[slots - 2];
            (ways.cost[slots - 1], ways.left[slots - 1]) =
                if cost < fewer { (cost, left) } else { (fewer, ways.left[slots - 2]) };
        }
        ways
    }
}

/// The cheapest way to share `slots` between two children: its cost, and the slots of the left one.
fn best_shares(l: &Ways, r: &Ways, slots: usize) -> (f32, u8) {
    let mut best = (f32::INFINITY, 1);
    for left in 1..slots {
        let cost = l.cost[left - 1] + r.cost[slots - left - 1];
        if cost < best.0 {
            best = (cost, left as u8);
        }
    }
    best
}

/// The ways of the binary nodes `first..first + ways.len()`, which are whole subtrees.
fn find_ways(nodes: &[Node], first: usize, ways: &mut [Ways], max_leaf: u32) {
    let own = &nodes[first..first + ways.len()];
    if ways.len() <= SERIAL {
        for i in (0..ways.len()).rev() {
            ways[i] = ways_of(&own[i], &ways[..], first, max_leaf);
        }
        return;
    }
    // A pair of children, what is below the left one, what is below the right one.
    let (pair, below) = ways.split_at_mut(2);
    let right = &own[1];
    let left_size = if right.is_leaf() { below.len() } else { right.left as usize - first - 2 };
    let (below_left, below_right) = below.split_at_mut(left_size);
    rayon::join(
        || find_ways(nodes, first + 2, below_left, max_leaf),
        || find_ways(nodes, first + 2 + left_size, below_right, max_leaf),
    );
    pair[0] = ways_of(&own[0], below_left, first + 2, max_leaf);
    pair[1] = ways_of(&own[1], below_right, first + 2 + left_size, max_leaf);
}

/// The ways of a node whose children's ways are in `ways`, which starts with those of node `first`.
fn ways_of(node: &Node, ways: &[Ways], first: usize, max_leaf: u32) -> Ways {
    if node.is_leaf() {
        return Ways::leaf(node.bounds.half_area() * LEAF_COST);
    }
    let left = node.left as usize - first;
    Ways::inner(node, &ways[left], &ways[left + 1], max_leaf)
}

/// Plans the wide tree. Leaves of the binary tree hold at most `max_leaf` primitives, and every binary node that does
/// may become a leaf of the wide one.
pub(super) fn plan(tree: &BinaryTree, max_leaf: u32) -> Plan {
    let mut plan = Plan::default();
    let Some(root) = tree.nodes.first() else { return plan };
    let mut ways = vec![Ways::NONE; tree.nodes.len()];
    find_ways(&tree.nodes, 1, &mut ways[1..], max_leaf);
    ways[0] = ways_of(root, &ways, 0, max_leaf);
    if ways[0].left_of_node == 0 {
        plan.leaves.push(0);
        plan.root = Some(ChildRef::leaf(0));
        return plan;
    }
    plan.root = Some(ChildRef::node(0));
    plan.nodes.push([VACANT; 8]);
    let mut waiting = vec![(0_u32, 0_usize, 1_usize)];
    while let Some((binary, wide, level)) = waiting.pop() {
        plan.levels = plan.levels.max(level);
        let mut slots = [VACANT; 8];
        let used = fill_slots(tree, &ways, binary, &mut slots);
        let first_waiting = waiting.len();
        for slot in &mut slots[..used] {
            if ways[slot.0 as usize].left_of_node == 0 {
                slot.1 = ChildRef::leaf(plan.leaves.len() as u32);
                plan.leaves.push(slot.0);
            } else {
                slot.1 = ChildRef::node(plan.nodes.len() as u32);
                waiting.push((slot.0, plan.nodes.len(), level + 1));
                plan.nodes.push([VACANT; 8]);
            }
        }
        // The first child's subtree follows first.
        waiting[first_waiting..].reverse();
        plan.nodes[wide] = slots;
    }
    plan
}

/// Shares the eight slots of the wide node that `binary` becomes among its descendants; gives how many are used.
fn fill_slots(tree: &BinaryTree, ways: &[Ways], binary: u32, slots: &mut [(u32, ChildRef); 8]) -> usize {
    let mut used = 0;
    let share = |node: u32, slots: u8, left: u8| {
        let child = tree.nodes[node as usize].left;
        [(child, left), (child + 1, slots - left)]
    };
    let mut open = [(0, 0); 8];
    let left_of_node = ways[binary as usize].left_of_node;
    open[..2].copy_from_slice(&share(binary, 8, left_of_node));
    let mut waiting = 2;
    while waiting > 0 {
        waiting -= 1;
        let (node, share_of_node) = open[waiting];
        let left = ways[node as usize].left[share_of_node as usize - 1];
        if left == 0 {
            slots[used].0 = node;
            used += 1;
            continue;
        }
        // With fewer slots than offered where those are as good.
        let total = smallest_share(&ways[node as usize], share_of_node);
        open[waiting..waiting + 2].copy_from_slice(&share(node, total, left));
        waiting += 2;
    }
    used
}

/// The fewest slots that are as good as `slots`.
fn smallest_share(ways: &Ways, slots: u8) -> u8 {
    let cost = ways.cost[slots as usize - 1];
    (1..=slots).find(|&s| ways.cost[s as usize - 1] <= cost).unwrap_or(slots)
}

/// Writes the nodes of `plan`: `bounds` gives the box of a binary node, `leaf` what a slot with a leaf points to.
pub(super) fn emit(
    plan: &Plan,
    nodes: &mut Vec<Node8>,
    bounds: impl Fn(u32) -> Aabb + Sync,
    leaf: impl Fn(ChildRef) -> ChildRef + Sync,
) {
    let node = |slots: &[(u32, ChildRef); 8]| {
        let mut node = Node8::EMPTY;
        for (slot, &(binary, child)) in slots.iter().enumerate().filter(|(_, s)| s.1 != ChildRef::NONE) {
            let child = if child.is_leaf() { leaf(child) } else { child };
            node.set(slot, child, &bounds(binary));
        }
        node
    };
    plan.nodes.par_iter().with_min_len(256).map(node).collect_into_vec(nodes);
}
