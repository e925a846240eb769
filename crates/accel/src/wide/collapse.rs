//! From a binary tree to the plan of an eight-wide one.
//!
//! A wide node starts with the two children of a binary node and opens the child of the largest area until eight slots
//! are full: Wald, Benthin, Boulos 2008, "Getting rid of packets".

use super::{ChildRef, Node8};
use crate::{BinaryTree, Node};
use rayon::prelude::*;
use vastlight_math::Aabb;

/// The shape of a wide tree: which binary nodes become slots, and which become leaves.
#[derive(Debug, Default)]
pub(super) struct Plan {
    /// For each wide node, for each slot: the binary node and what it becomes.
    pub(super) nodes: Vec<[(u32, ChildRef); 8]>,
    /// For each leaf, the binary node whose primitives it holds.
    pub(super) leaves: Vec<u32>,
    /// What the root becomes.
    pub(super) root: Option<ChildRef>,
}

/// A slot with nothing in it.
const VACANT: (u32, ChildRef) = (0, ChildRef::NONE);

/// Plans the wide tree. Leaves of the binary tree hold at most `max_leaf` primitives, and every binary node that does
/// may become a leaf of the wide one.
pub(super) fn plan(tree: &BinaryTree, max_leaf: u32) -> Plan {
    let mut plan = Plan::default();
    let Some(root) = tree.nodes.first() else { return plan };
    let is_leaf = |node: &Node| node.is_leaf() || node.count <= max_leaf;
    if is_leaf(root) {
        plan.leaves.push(0);
        plan.root = Some(ChildRef::leaf(0));
        return plan;
    }
    plan.root = Some(ChildRef::node(0));
    plan.nodes.push([VACANT; 8]);
    let mut waiting = vec![(0_u32, 0_usize)];
    while let Some((binary, wide)) = waiting.pop() {
        let mut slots = opened(tree, binary, &is_leaf);
        let first_waiting = waiting.len();
        for slot in slots.iter_mut().filter(|slot| slot.0 != 0) {
            if is_leaf(&tree.nodes[slot.0 as usize]) {
                slot.1 = ChildRef::leaf(plan.leaves.len() as u32);
                plan.leaves.push(slot.0);
            } else {
                slot.1 = ChildRef::node(plan.nodes.len() as u32);
                waiting.push((slot.0, plan.nodes.len()));
                plan.nodes.push([VACANT; 8]);
            }
        }
        // The first child's subtree follows first.
        waiting[first_waiting..].reverse();
        plan.nodes[wide] = slots;
    }
    plan
}

/// Up to eight descendants that together hold what is below `binary`.
fn opened(tree: &BinaryTree, binary: u32, is_leaf: &impl Fn(&Node) -> bool) -> [(u32, ChildRef); 8] {
    let mut slots = [VACANT; 8];
    let left = tree.nodes[binary as usize].left;
    (slots[0].0, slots[1].0) = (left, left + 1);
    for used in 2..8 {
        let mut widest: Option<(usize, f32)> = None;
        for (slot, &(child, _)) in slots[..used].iter().enumerate() {
            let node = &tree.nodes[child as usize];
            let area = node.bounds.half_area();
            if !is_leaf(node) && widest.is_none_or(|w| area > w.1) {
                widest = Some((slot, area));
            }
        }
        let Some((slot, _)) = widest else { break };
        let left = tree.nodes[slots[slot].0 as usize].left;
        (slots[slot].0, slots[used].0) = (left, left + 1);
    }
    slots
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
