//! The wide nodes over a binary tree that changes.
//!
//! Each wide node begins at a binary node. Where binary nodes below it, down to those where other wide nodes begin, have
//! other children than before, it is planned afresh as [`crate::wide`] plans whole trees, together with those next to it
//! that changed too; others keep their children and only get new boxes.

use super::arena::Arena;
use super::leaves::lengthen;
use super::tree::{DynamicTree, Mark, NONE};
use crate::Node;
use crate::memory::Pages;
use crate::wide::{ChildRef, Node8, Plan, plan};
use rayon::prelude::*;
use vastlight_simd::Level;

/// Which binary nodes stand in which slots.
#[derive(Clone, Debug, Default)]
pub(super) struct WideMap {
    /// The binary nodes in the slots of each wide node, [`NONE`] where there is none.
    slots: Vec<[u32; 8]>,
    arena: Arena,
}

/// Binary nodes that are planned afresh.
struct Piece {
    /// The nodes by their numbers in the plan, the first of which is the root.
    binary: Vec<u32>,
    /// Where wide nodes began that are dissolved.
    absorbed: Vec<u32>,
    plan: Plan,
}

impl WideMap {
    /// Plans wide nodes afresh where the tree has changed; gives how many were planned.
    pub(super) fn collapse(
        &mut self,
        tree: &mut DynamicTree,
        nodes: &mut Pages<Node8>,
        level: Level,
    ) -> usize {
        for wide in std::mem::take(&mut tree.released) {
            self.free(nodes, wide);
        }
        let mut touched = std::mem::take(&mut tree.touched);
        if tree.root == NONE || tree.is_leaf(tree.root) {
            return 0;
        }
        if tree.link(tree.root).wide == NONE {
            tree.link_mut(tree.root).wide = self.take(nodes, 0);
            touched.push(tree.root);
        }
        let (dirty, begins) = self.dirty(tree, &touched);
        let is_top = |&begin: &u32| {
            let above = begin_of(tree, tree.link(begin).parent);
            above.is_none_or(|above| !dirty[tree.link(above).wide as usize])
        };
        let tops: Vec<u32> = begins.into_iter().filter(is_top).collect();
        let pieces: Vec<Piece> =
            tops.par_iter().with_min_len(8).map(|&top| piece(tree, top, &dirty, level)).collect();
        for piece in &pieces {
            for &begin in &piece.absorbed {
                self.free(nodes, tree.link(begin).wide);
                tree.link_mut(begin).wide = NONE;
            }
        }
        pieces.iter().map(|piece| self.put(tree, nodes, piece)).sum()
    }

    /// The wide nodes in which binary ones changed, and where they begin.
    fn dirty(&self, tree: &DynamicTree, touched: &[u32]) -> (Vec<bool>, Vec<u32>) {
        let (mut dirty, mut begins) = (vec![false; self.slots.len()], Vec::new());
        for &node in touched.iter().filter(|&&node| tree.link(node).mark != Mark::Freed) {
            if let Some(begin) = begin_of(tree, node) {
                let wide = tree.link(begin).wide as usize;
                if !std::mem::replace(&mut dirty[wide], true) {
                    begins.push(begin);
                }
            }
        }
        (dirty, begins)
    }

    /// Writes the wide nodes of a piece; gives their number.
    fn put(&mut self, tree: &mut DynamicTree, nodes: &mut Pages<Node8>, piece: &Piece) -> usize {
        let mut wides = vec![NONE; piece.plan.nodes.len()];
        wides[0] = tree.link(piece.binary[0]).wide;
        for (number, planned) in piece.plan.nodes.iter().enumerate() {
            let own = wides[number] as usize;
            let (mut slots, mut node) = ([NONE; 8], Node8::EMPTY);
            for (slot, &(local, child)) in planned.iter().enumerate().filter(|(_, s)| s.1 != ChildRef::NONE) {
                let binary = piece.binary[local as usize];
                if !child.is_leaf() {
                    let wide = self.take(nodes, own as u32);
                    tree.link_mut(binary).wide = wide;
                    wides[child.index()] = wide;
                }
                slots[slot] = binary;
                node.children[slot] = if tree.is_leaf(binary) {
                    ChildRef::leaf(tree.block(binary) as u32)
                } else {
                    ChildRef::node(tree.link(binary).wide)
                };
            }
            self.slots[own] = slots;
            nodes[own] = node;
        }
        piece.plan.nodes.len()
    }

    fn free(&mut self, nodes: &mut [Node8], wide: u32) {
        self.slots[wide as usize] = [NONE; 8];
        nodes[wide as usize] = Node8::EMPTY;
        self.arena.release(wide as usize);
    }

    /// A free wide node near another.
    fn take(&mut self, nodes: &mut Pages<Node8>, near: u32) -> u32 {
        if self.arena.free() == 0 {
            let len = self.arena.len() + self.arena.len() / 8 + 16;
            self.arena.grow(len);
            lengthen(nodes, len, Node8::EMPTY);
            self.slots.resize(len, [NONE; 8]);
        }
        self.arena.take(near as usize).map_or(NONE, |place| place as u32)
    }

    /// Gives all slots the boxes of their binary nodes.
    pub(super) fn refit(&self, tree: &DynamicTree, nodes: &mut [Node8]) {
        nodes.par_iter_mut().zip(&self.slots).with_min_len(256).for_each(|(node, slots)| {
            for (slot, &binary) in slots.iter().enumerate().filter(|&(_, &binary)| binary != NONE) {
                node.set(slot, node.children[slot], &tree.bounds(binary));
            }
        });
    }

    /// Nodes in use.
    pub(super) fn used(&self) -> usize {
        self.arena.len() - self.arena.free()
    }

    /// Binary nodes have other numbers.
    pub(super) fn rename(&mut self, new: impl Fn(u32) -> u32) {
        self.slots.as_flattened_mut().iter_mut().for_each(|slot| *slot = new(*slot));
    }

    /// Wide nodes stand in the order `old`, which leaves free ones out.
    pub(super) fn reorder(&mut self, old: &[usize]) {
        self.slots = old.iter().map(|&wide| self.slots[wide]).collect();
        self.arena = Arena::full(old.len());
    }

    /// Free nodes, as a share of all.
    pub(super) fn looseness(&self) -> f64 {
        self.arena.looseness()
    }

    /// Memory of the map.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(self.slots.as_slice())
    }
}

/// The node at or above `node` where a wide node begins.
fn begin_of(tree: &DynamicTree, mut node: u32) -> Option<u32> {
    while node != NONE && tree.link(node).wide == NONE {
        node = tree.link(node).parent;
    }
    (node != NONE).then_some(node)
}

/// Plans what is below `top` down to leaves and to where wide nodes begin that stay.
fn piece(tree: &DynamicTree, top: u32, dirty: &[bool], level: Level) -> Piece {
    let (mut binary, mut absorbed) = (vec![top], Vec::new());
    let node =
        |node: u32| Node { bounds: tree.bounds(node), left: 0, first: 0, count: tree.link(node).count };
    let mut nodes = vec![node(top)];
    // What is below the left child follows first.
    let mut waiting = vec![0_usize];
    while let Some(place) = waiting.pop() {
        let own = binary[place];
        let link = tree.link(own);
        let begins = place > 0 && link.wide != NONE;
        if tree.is_leaf(own) || begins && !dirty[link.wide as usize] {
            continue;
        }
        if begins {
            absorbed.push(own);
        }
        let left = nodes.len();
        nodes[place].left = left as u32;
        binary.extend(link.children);
        nodes.extend(link.children.map(node));
        waiting.extend([left + 1, left]);
    }
    let plan = plan(&nodes, 0, level);
    Piece { binary, absorbed, plan }
}
