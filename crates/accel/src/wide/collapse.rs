//! From a binary tree to the plan of an eight-wide one, of least expected cost.
//!
//! Dynamic programming over the binary tree as in Ylitie, Karras, Laine 2017, "Efficient incoherent ray traversal on GPUs
//! through compressed wide BVHs", section 3.1. For each binary node, from the bottom up: the least cost of holding
//! what is below in at most 1, 2, ... 7 slots of a wide node. Deviation: the cost of a leaf is that of a block, since its
//! triangles are tested at once.

use super::{ChildRef, Node8};
use crate::Node;
use crate::memory::Pages;
use crate::upward::{Upward, upward};
use rayon::prelude::*;
use vastlight_math::Aabb;
use vastlight_simd::Level;

/// Cost of testing a node's eight boxes.
const NODE_COST: f32 = 1.0;
/// Cost of testing a leaf.
const LEAF_COST: f32 = 1.0;
/// Subtrees with fewer primitives are planned by one thread.
const SERIAL: u32 = 1 << 14;

/// What leaves of a binary tree need of a wide one.
pub(crate) trait LeafSlots: Sync {
    /// Whether every leaf needs one slot.
    const SINGLE: bool;
    /// How many slots a leaf needs, from one to eight, and what these cost.
    fn of(&self, leaf: &Node) -> (u8, f32);
}

/// Leaves that are blocks.
pub(super) struct OneBlock;

impl LeafSlots for OneBlock {
    const SINGLE: bool = true;

    #[inline(always)]
    fn of(&self, leaf: &Node) -> (u8, f32) {
        (1, leaf.bounds.half_area() * LEAF_COST)
    }
}

/// The shape of a wide tree: which binary nodes become slots, and which become leaves.
#[derive(Debug, Default)]
pub(crate) struct Plan {
    /// For each wide node, for each slot: the binary node and what it becomes. All slots of a leaf that needs several
    /// stand in a row.
    pub(crate) nodes: Vec<[(u32, ChildRef); 8]>,
    /// For each leaf, the binary node whose primitives it holds.
    pub(crate) leaves: Vec<u32>,
    /// What the root becomes.
    pub(crate) root: Option<ChildRef>,
    /// Wide nodes on the longest way from the root to a leaf.
    pub(crate) levels: usize,
}

/// A slot of a leaf that takes several, until it is numbered.
const IN_LEAF: ChildRef = ChildRef::leaf(0);
/// A slot with nothing in it.
const VACANT: (u32, ChildRef) = (0, ChildRef::NONE);

/// The best ways to hold what is below a binary node.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Ways {
    /// How at most `i + 1` slots are shared.
    shares: [Share; 7],
    /// How eight slots are shared where the node becomes a wide one; [`Share::WHOLE`] where it becomes a leaf.
    of_node: Share,
}

/// How many slots go to the left and to the right child, in four bits each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(transparent)]
struct Share(u8);

impl Share {
    /// The node takes one slot itself.
    const WHOLE: Self = Self(0);

    /// A leaf takes so many slots, more than one.
    #[inline(always)]
    const fn of_leaf(slots: u8) -> Self {
        Self(slots)
    }

    #[inline(always)]
    const fn is_of_leaf(self) -> bool {
        self.right() == 0 && self.left() > 0
    }

    #[inline(always)]
    const fn new(left: u8, right: u8) -> Self {
        Self(left | right << 4)
    }

    #[inline(always)]
    const fn left(self) -> u8 {
        self.0 & 15
    }

    #[inline(always)]
    const fn right(self) -> u8 {
        self.0 >> 4
    }
}

/// How the best ways follow.
struct Cheapest<'a, L> {
    max_leaf: u32,
    slots: &'a L,
}

impl<L: LeafSlots> Upward for Cheapest<'_, L> {
    type Kept = Ways;
    /// Least cost with at most `i + 1` slots.
    type Value = [f32; 7];

    #[inline(always)]
    fn leaf(&self, node: &Node, ways: &mut Ways) -> [f32; 7] {
        let (slots, cost) = self.slots.of(node);
        *ways = Ways { shares: [Share::WHOLE; 7], of_node: Share::WHOLE };
        if L::SINGLE || slots <= 1 {
            return [cost; 7];
        }
        // In one slot it becomes a node, which costs more.
        let share = Share::of_leaf(slots);
        ways.of_node = share;
        let mut least = [cost + node.bounds.half_area() * NODE_COST; 7];
        for i in (usize::from(slots) - 1..7).rev() {
            (least[i], ways.shares[i]) = (cost, share);
        }
        least
    }

    #[inline(always)]
    fn inner(&self, node: &Node, children: [&Node; 2], [l, r]: [&[f32; 7]; 2], ways: &mut Ways) -> [f32; 7] {
        let area = node.bounds.half_area();
        let may_be_leaf = |cost: f32| node.count <= self.max_leaf && area * LEAF_COST <= cost;
        *ways = Ways { shares: [Share::WHOLE; 7], of_node: Share::WHOLE };
        if L::SINGLE && children[0].is_leaf() && children[1].is_leaf() {
            let both = l[0] + r[0];
            let mut cost = both + area * NODE_COST;
            if may_be_leaf(cost) {
                cost = area * LEAF_COST;
            } else {
                ways.of_node = Share::new(1, 7);
            }
            let share = if both < cost { Share::new(1, 1) } else { Share::WHOLE };
            ways.shares[1..].fill(share);
            let both = both.min(cost);
            return [cost, both, both, both, both, both, both];
        }
        let (costs, lefts) = best_shares(l, r);
        let mut cost = costs[7] + area * NODE_COST;
        if may_be_leaf(cost) {
            cost = area * LEAF_COST;
        } else {
            ways.of_node = Share::new(lefts[7] as u8, 8 - lefts[7] as u8);
        }
        let (mut least, mut share) = ([cost; 7], Share::WHOLE);
        for i in 1..7 {
            let better = costs[i] < cost;
            let left = lefts[i] as u8;
            cost = if better { costs[i] } else { cost };
            share = if better { Share::new(left, i as u8 + 1 - left) } else { share };
            (least[i], ways.shares[i]) = (cost, share);
        }
        least
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

/// Plans the wide tree. Leaves of the binary tree become leaves of the wide one, and every other node with at most
/// `max_leaf` primitives may.
pub(crate) fn plan(tree: &[Node], max_leaf: u32, level: Level) -> Plan {
    plan_slots(tree, &Cheapest { max_leaf, slots: &OneBlock }, level)
}

/// The same where leaves need the slots `slots`, and no other node becomes a leaf.
pub(crate) fn plan_over(tree: &[Node], slots: &impl LeafSlots, level: Level) -> Plan {
    plan_slots(tree, &Cheapest { max_leaf: 0, slots }, level)
}

fn plan_slots<L: LeafSlots>(tree: &[Node], cheapest: &Cheapest<'_, L>, level: Level) -> Plan {
    let Some(root) = tree.first() else { return Plan::default() };
    let mut ways = Pages::zeroed(tree.len());
    upward(cheapest, tree, &mut ways, level);
    if ways[0].of_node == Share::WHOLE {
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
    tree: &'a [Node],
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
        let count = |binary: u32| self.tree[binary as usize].count;
        let below = |&binary: &u32| {
            let mut slots = [VACANT; 8];
            let plan = self.below(binary, count(binary), &mut slots);
            (slots, plan)
        };
        let below: Vec<_> = inner.as_slice().par_iter().map(below).collect();
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
        let wait = |inner: Few, first: usize, level: usize, waiting: &mut Vec<_>| {
            // The first child's subtree follows first.
            let inner = inner.as_slice().iter().enumerate().rev();
            waiting.extend(inner.map(|(i, &binary)| (binary, first + i, level)));
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
    fn number_slots(&self, binary: u32, slots: &mut [(u32, ChildRef); 8], plan: &mut Plan) -> Few {
        let used = self.fill_slots(binary, slots);
        let mut inner = Few { nodes: [0; 8], len: 0 };
        for slot in &mut slots[..used] {
            let stays = slot.1 == IN_LEAF || self.ways[slot.0 as usize].of_node == Share::WHOLE;
            if stays {
                slot.1 = ChildRef::leaf(plan.leaves.len() as u32);
                plan.leaves.push(slot.0);
            } else {
                slot.1 = ChildRef::node(plan.nodes.len() as u32 + inner.len as u32);
                inner.nodes[inner.len] = slot.0;
                inner.len += 1;
            }
        }
        plan.nodes.resize(plan.nodes.len() + inner.len, [VACANT; 8]);
        inner
    }

    /// Shares the eight slots of the wide node that `binary` becomes among its descendants; gives how many are used.
    fn fill_slots(&self, binary: u32, slots: &mut [(u32, ChildRef); 8]) -> usize {
        let children = |node: u32, share: Share| {
            let child = self.tree[node as usize].left;
            [(child, share.left()), (child + 1, share.right())]
        };
        let of_node = self.ways[binary as usize].of_node;
        if of_node.is_of_leaf() {
            let used = usize::from(of_node.left());
            slots[..used].fill((binary, IN_LEAF));
            return used;
        }
        let mut open = [(0, 0); 8];
        open[..2].copy_from_slice(&children(binary, of_node));
        let (mut used, mut waiting) = (0, 2);
        while waiting > 0 {
            waiting -= 1;
            let (node, offered) = open[waiting];
            let share = self.ways[node as usize].shares[offered as usize - 1];
            if share == Share::WHOLE {
                slots[used].0 = node;
                used += 1;
            } else if share.is_of_leaf() {
                let all = usize::from(share.left());
                slots[used..used + all].fill((node, IN_LEAF));
                used += all;
            } else {
                open[waiting..waiting + 2].copy_from_slice(&children(node, share));
                waiting += 2;
            }
        }
        used
    }
}

/// Up to eight binary nodes.
#[derive(Clone, Copy)]
struct Few {
    nodes: [u32; 8],
    len: usize,
}

impl Few {
    fn as_slice(&self) -> &[u32] {
        &self.nodes[..self.len]
    }
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
