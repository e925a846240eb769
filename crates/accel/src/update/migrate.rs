//! Third stage of the clustered update (chapter 2.4 of the thesis): what moved apart is put where it fits.
//!
//! Four loops over all listed nodes, lower ones first: take each out; shrink the boxes above the gaps; find from each gap
//! upwards the first node whose box contains it; put its children back from there, where their boxes cost least.
//!
//! Deviations: a node whose child was taken out has one child left, which is then taken out for it; of the root's children
//! one stays. A child is only split on its way down if the overlap that it makes is more than [`OVERLAP`] of its own
//! area, and only [`SPLITS`] times. Beyond the thesis, a leaf that fits into another leaf's block becomes part of it.

use super::leaves::Leaves;
use super::tree::{DynamicTree, Mark, NONE};
use crate::wide::Block8;
use vastlight_math::Aabb;

/// Overlap that putting a node below another may add, as a part of its own area.
const OVERLAP: f32 = 0.05;
/// How often what is put back may be split.
const SPLITS: usize = 32;

/// Something that was taken out.
#[derive(Clone, Copy, Debug)]
struct Gap {
    /// What is to be put back; both or one.
    units: [u32; 2],
    /// Around them.
    bounds: Aabb,
    /// The node above the gap; [`NONE`] above the root.
    above: u32,
}

/// Takes the nodes `listed`, children before their parents, out of the tree and puts their children back. Gives how many
/// nodes changed their places.
pub(super) fn migrate(
    tree: &mut DynamicTree,
    leaves: &mut Leaves,
    blocks: &mut [Block8],
    listed: &[u32],
) -> usize {
    listed.iter().for_each(|&node| tree.link_mut(node).mark = Mark::Migrating);
    let mut instead = Vec::new();
    let gaps: Vec<Gap> = listed.iter().filter_map(|&node| detach(tree, node, &mut instead)).collect();
    for gap in &gaps {
        shrink(tree, gap.above);
    }
    let starts: Vec<u32> = gaps.iter().map(|gap| start(tree, gap)).collect();
    for unit in gaps.iter().flat_map(|gap| gap.units).filter(|&unit| unit != NONE) {
        tree.link_mut(unit).parent = NONE;
    }
    let mut moved = 0;
    for (gap, from) in gaps.iter().zip(starts) {
        for unit in gap.units.into_iter().filter(|&unit| unit != NONE) {
            let mut inserter = Inserter { tree, leaves, blocks, splits: SPLITS };
            moved += inserter.insert(unit, from);
        }
    }
    moved
}

/// Takes a listed node out. Where its place was taken by its only child left, which `instead` knows, takes that out.
fn detach(tree: &mut DynamicTree, node: u32, instead: &mut Vec<[u32; 2]>) -> Option<Gap> {
    if tree.link(node).mark != Mark::Freed {
        return Some(take_out(tree, node, instead));
    }
    let left = instead.iter().rev().find(|entry| entry[0] == node).map(|entry| entry[1])?;
    let taken = matches!(tree.link(left).mark, Mark::Freed | Mark::Migrating);
    if taken || tree.link(left).parent == NONE || tree.link(tree.link(left).parent).mark == Mark::Freed {
        return None;
    }
    let above = unlink(tree, left, instead);
    Some(Gap { units: [left, NONE], bounds: tree.bounds(left), above })
}

/// Takes out a node, whose children become what is to be put back.
fn take_out(tree: &mut DynamicTree, node: u32, instead: &mut Vec<[u32; 2]>) -> Gap {
    let [a, b] = tree.link(node).children;
    if node == tree.root {
        let (stays, unit) = if tree.link(a).count < tree.link(b).count { (b, a) } else { (a, b) };
        tree.replace(NONE, node, stays);
        tree.free(node);
        return Gap { units: [unit, NONE], bounds: tree.bounds(unit), above: NONE };
    }
    let bounds = tree.bounds(node);
    let above = unlink(tree, node, instead);
    tree.free(node);
    tree.link_mut(node).parent = above;
    Gap { units: [a, b], bounds, above }
}

/// Takes a subtree out; its sibling takes the place of its parent. Gives the node above.
fn unlink(tree: &mut DynamicTree, node: u32, instead: &mut Vec<[u32; 2]>) -> u32 {
    let (parent, sibling) = (tree.link(node).parent, tree.sibling(node));
    let above = tree.link(parent).parent;
    tree.replace(above, parent, sibling);
    if tree.link(parent).mark == Mark::Migrating {
        instead.push([parent, sibling]);
    }
    tree.free(parent);
    above
}

/// Takes boxes and counts of the nodes from `node` upwards from their children. What was taken out counts as being where it was.
fn shrink(tree: &mut DynamicTree, mut node: u32) {
    while node != NONE {
        if tree.link(node).mark != Mark::Freed {
            tree.adopt(node);
        }
        node = tree.link(node).parent;
    }
}

/// The first node above a gap whose box contains what was taken out; [`NONE`] stands for the root.
fn start(tree: &DynamicTree, gap: &Gap) -> u32 {
    let mut node = gap.above;
    while node != NONE && (tree.link(node).mark == Mark::Freed || !tree.bounds(node).contains(&gap.bounds)) {
        node = tree.link(node).parent;
    }
    node
}

/// Puts subtrees into the tree.
struct Inserter<'a> {
    tree: &'a mut DynamicTree,
    leaves: &'a mut Leaves,
    blocks: &'a mut [Block8],
    /// How many more nodes may be split.
    splits: usize,
}

impl Inserter<'_> {
    /// Puts `unit` below `from`; gives how many subtrees it became.
    fn insert(&mut self, unit: u32, from: u32) -> usize {
        let mut waiting = vec![(unit, from)];
        let mut put = 0;
        while let Some((unit, from)) = waiting.pop() {
            let from = if from == NONE { self.tree.root } else { from };
            match self.place(unit, from) {
                Place::Beside(node) => {
                    self.put(unit, node, from);
                    put += 1;
                }
                Place::Split(node) => {
                    self.splits -= 1;
                    let children = self.tree.link(unit).children;
                    self.tree.free(unit);
                    children.into_iter().for_each(|child| self.tree.link_mut(child).parent = NONE);
                    waiting.extend(children.map(|child| (child, node)));
                }
            }
        }
        put
    }

    /// Descends from `from` to where `unit` goes.
    fn place(&self, unit: u32, from: u32) -> Place {
        let tree = &*self.tree;
        let (own, count) = (tree.bounds(unit), tree.link(unit).count);
        let may_split = self.splits > 0 && !tree.is_leaf(unit);
        let mut node = from;
        loop {
            if tree.is_leaf(node) {
                return Place::Beside(node);
            }
            let step = Step::new(tree, node, &own, count);
            // What was taken out and still waits keeps its root.
            let waits = tree.link(node).parent == NONE && node != tree.root;
            if !waits && step.join <= step.below[0].min(step.below[1]) {
                return Place::Beside(node);
            }
            if may_split && step.overlap > OVERLAP * own.half_area() {
                return Place::Split(node);
            }
            node = step.child;
        }
    }

    /// Makes `unit` the sibling of `node`, or part of it where both are leaves that fit into a block.
    fn put(&mut self, unit: u32, node: u32, from: u32) {
        let parent = self.tree.link(node).parent;
        if self.leaves.may_merge(self.tree, node, unit) {
            self.leaves.merge(self.tree, self.blocks, node, unit);
        } else {
            let joint = self.tree.take(node);
            self.tree.replace(parent, node, joint);
            self.tree.set_children(joint, [node, unit]);
        }
        // Costs are saved afresh as far as the search went.
        let (mut above, mut searched) = (parent, node != from);
        while above != NONE {
            self.tree.adopt(above);
            if searched {
                self.tree.save_cost(above);
                searched = above != from;
            }
            above = self.tree.link(above).parent;
        }
    }
}

/// Where a subtree goes.
enum Place {
    /// Beside a node.
    Beside(u32),
    /// Its children go somewhere below a node.
    Split(u32),
}

/// What it costs to put a box beside a node, or below its children.
struct Step {
    /// Beside it.
    join: f32,
    /// Below either child.
    below: [f32; 2],
    /// The cheaper child; of equal ones that with fewer triangles.
    child: u32,
    /// How much more area the children share with the box in the cheaper one.
    overlap: f32,
}

impl Step {
    fn new(tree: &DynamicTree, node: u32, own: &Aabb, count: u32) -> Self {
        let link = tree.link(node);
        let boxes = link.children.map(|child| tree.bounds(child));
        let counts = link.children.map(|child| tree.link(child).count);
        let grown = boxes.map(|b| b.union(*own));
        let cost = |bounds: &Aabb, count: u32| bounds.half_area() * count as f32;
        let join = cost(&tree.bounds(node), link.count) + cost(own, count);
        let below = [0, 1]
            .map(|side| cost(&grown[side], counts[side] + count) + cost(&boxes[1 - side], counts[1 - side]));
        let side = usize::from((below[1], counts[1]) < (below[0], counts[0]));
        let shared = |a: &Aabb, b: &Aabb| a.intersection(*b).half_area();
        let overlap = shared(&grown[side], &boxes[1 - side]) - shared(&boxes[0], &boxes[1]);
        Self { join, below, child: link.children[side], overlap }
    }
}
