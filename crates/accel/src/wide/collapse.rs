//! From a binary tree to the plan of an eight-wide one, of least expected cost.
//!
//! Dynamic programming over the binary tree as in Ylitie, Karras, Laine 2017, "Efficient incoherent ray traversal on GPUs
//! through compressed wide BVHs", section 3.1. For each binary node, from the bottom up: the least cost of holding
//! what is below in at most 1, 2, ... 7 slots of a wide node. Deviation: the cost of a leaf is that of a block, since its
//! triangles are tested at once.

use super::{ChildRef, Node8};
use crate::memory::Pages;
use crate::upward::{Upward, upward};
use crate::{BinaryTree, Node};
use rayon::prelude::*;
use vastlight_math::Aabb;
use vastlight_simd::Level;

/// Cost of testing a node's eight boxes.
const NODE_COST: f32 = 1.0;
/// Cost of testing a leaf.
const LEAF_COST: f32 = 1.0;
/// Subtrees with fewer primitives are planned by one thread.
const SERIAL: u32 = 1 << 14;

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
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
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
}

/// How the best ways follow.
struct Cheapest {
    max_leaf: u32,
}

impl Upward for Cheapest {
    type Value = Ways;

    #[inline(always)]
    fn leaf(&self, node: &Node) -> Ways {
        Ways { cost: [node.bounds.half_area() * LEAF_COST; 7], ..Ways::NONE }
    }

    #[inline(always)]
    fn inner(&self, node: &Node, _: [&Node; 2], [l, r]: [&Ways; 2]) -> Ways {
        let area = node.bounds.half_area();
        let (costs, lefts) = best_shares(&l.cost, &r.cost);
        let mut ways = Ways::NONE;
        (ways.cost[0], ways.left_of_node) = (costs[7] + area * NODE_COST, lefts[7] as u8);
        if node.count <= self.max_leaf && area * LEAF_COST <= ways.cost[0] {
            (ways.cost[0], ways.left_of_node) = (area * LEAF_COST, 0);
        }
        for slots in 2..8 {
            let (cost, left) = (costs[slots - 1], lefts[slots - 1] as u8);
            let fewer = ways.cost[slots - 2];
            (ways.cost[slots - 1], ways.left[slots - 1]) =
                if cost < fewer { (cost, left) } else { (fewer, ways.left[slots - 2]) };
        }
        ways
    }
}

/// The cheapest way to share `i + 1` slots between two children, for each `i` but 0: its cost, and the slots of the left
/// one, the fewest where several are as cheap. All eight at once, one number of left slots after the other.
#[inline(always)]
fn best_shares(l: &[f32; 7], r: &[f32; 7]) -> ([f32; 8], [u32; 8]) {
    // With `left` slots on the left, entry 7 - left + i is the cost of the right one with the rest of i + 1.
    let mut right = [f32::INFINITY; 15];
    right[7..14].copy_from_slice(r);
    let (mut costs, mut lefts) = ([f32::INFINITY; 8], [1; 8]);
    for left in 1..8 {
        for i in 0..8 {
            let cost = l[left - 1] + right[7 - left + i];
            let better = cost < costs[i];
            costs[i] = if better { cost } else { costs[i] };
            lefts[i] = if better { left as u32 } else { lefts[i] };
        }
    }
    (costs, lefts)
}

/// Plans the wide tree. Leaves of the binary tree hold at most `max_leaf` primitives, and every binary node that does
/// may become a leaf of the wide one.
pub(super) fn plan(tree: &BinaryTree, max_leaf: u32, level: Level) -> Plan {
    let Some(root) = tree.nodes.first() else { return Plan::default() };
    let mut ways = Pages::zeroed(tree.nodes.len());
    upward(&Cheapest { max_leaf }, &tree.nodes, &mut ways, level);
    if ways[0].left_of_node == 0 {
        return Plan { leaves: vec![0], root: Some(ChildRef::leaf(0)), ..Plan::default() };
    }
    let planner = Planner { tree, ways: &ways };
    let mut slots = [VACANT; 8];
    let mut plan = planner.below(0, root.count, &mut slots);
    move_slots(&mut slots, 1, 0);
    plan.nodes.iter_mut().for_each(|slots| move_slots(slots, 1, 0));
    plan.nodes.insert(0, slots);
    plan.root = Some(ChildRef::node(0));
    plan
}

/// Numbers of nodes and leaves in `slots` become larger.
fn move_slots(slots: &mut [(u32, ChildRef); 8], nodes: u32, leaves: u32) {
    for (_, child) in slots.iter_mut().filter(|slot| slot.1 != ChildRef::NONE) {
        let index = child.index() as u32;
        *child = if child.is_leaf() { ChildRef::leaf(index + leaves) } else { ChildRef::node(index + nodes) };
    }
}

struct Planner<'a> {
    tree: &'a BinaryTree,
    ways: &'a [Ways],
}

impl Planner<'_> {
    /// Plans what is below the wide node that `binary` becomes, and its slots: its children in a row, then what is below
    /// the first, and so on.
    fn below(&self, binary: u32, count: u32, slots: &mut [(u32, ChildRef); 8]) -> Plan {
        if count <= SERIAL {
            return self.below_serially(binary, slots);
        }
        let mut plan = Plan { levels: 1, ..Plan::default() };
        let inner = self.number_slots(binary, slots, &mut plan);
        let count = |binary: u32| self.tree.nodes[binary as usize].count;
        let below = |&binary: &u32| {
            let mut slots = [VACANT; 8];
            let plan = self.below(binary, count(binary), &mut slots);
            (slots, plan)
        };
        let below: Vec<_> = inner.par_iter().map(below).collect();
        for (i, (mut slots, mut part)) in below.into_iter().enumerate() {
            let (nodes, leaves) = (plan.nodes.len() as u32, plan.leaves.len() as u32);
            move_slots(&mut slots, nodes, leaves);
            part.nodes.iter_mut().for_each(|slots| move_slots(slots, nodes, leaves));
            plan.nodes[i] = slots;
            plan.nodes.append(&mut part.nodes);
            plan.leaves.append(&mut part.leaves);
            plan.levels = plan.levels.max(1 + part.levels);
        }
        plan
    }

    fn below_serially(&self, binary: u32, slots: &mut [(u32, ChildRef); 8]) -> Plan {
        let mut plan = Plan { levels: 1, ..Plan::default() };
        let mut waiting = Vec::new();
        let wait = |inner: Vec<u32>, first: usize, level: usize, waiting: &mut Vec<_>| {
            // The first child's subtree follows first.
            waiting.extend(inner.into_iter().enumerate().rev().map(|(i, binary)| (binary, first + i, level)));
        };
        let inner = self.number_slots(binary, slots, &mut plan);
        wait(inner, 0, 2, &mut waiting);
        while let Some((binary, wide, level)) = waiting.pop() {
            plan.levels = plan.levels.max(level);
            let (first, mut slots) = (plan.nodes.len(), [VACANT; 8]);
            let inner = self.number_slots(binary, &mut slots, &mut plan);
            wait(inner, first, level + 1, &mut waiting);
            plan.nodes[wide] = slots;
        }
        plan
    }

    /// Fills the slots of the wide node that `binary` becomes, with new nodes and leaves at the end of `plan`; gives the
    /// binary nodes that become nodes.
    fn number_slots(&self, binary: u32, slots: &mut [(u32, ChildRef); 8], plan: &mut Plan) -> Vec<u32> {
        let used = fill_slots(self.tree, self.ways, binary, slots);
        let mut inner = Vec::with_capacity(8);
        for slot in &mut slots[..used] {
            if self.ways[slot.0 as usize].left_of_node == 0 {
                slot.1 = ChildRef::leaf(plan.leaves.len() as u32);
                plan.leaves.push(slot.0);
            } else {
                slot.1 = ChildRef::node(plan.nodes.len() as u32);
                inner.push(slot.0);
                plan.nodes.push([VACANT; 8]);
            }
        }
        inner
    }
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
    nodes: &mut [Node8],
    bounds: impl Fn(u32) -> Aabb + Sync,
    leaf: impl Fn(ChildRef) -> ChildRef + Sync,
) {
    nodes.par_iter_mut().zip(&plan.nodes).with_min_len(256).for_each(|(node, slots)| {
        *node = Node8::EMPTY;
        for (slot, &(binary, child)) in slots.iter().enumerate().filter(|(_, s)| s.1 != ChildRef::NONE) {
            let child = if child.is_leaf() { leaf(child) } else { child };
            node.set(slot, child, &bounds(binary));
        }
    });
}
