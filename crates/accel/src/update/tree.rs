//! A binary tree that can be changed: nodes know their parents, leaves stand for blocks of triangles.

use super::arena::Arena;
use super::leaves::LeafBox;
use crate::wide::Block8;
use crate::{BinaryTree, Node, Violation};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};
use vastlight_math::{Aabb, Vec3};

/// No node, no block.
pub(super) const NONE: u32 = u32::MAX;
/// Subtrees with fewer triangles are worked on by one thread.
pub(super) const SERIAL: u32 = 1 << 12;

/// What a node knows of others, and the figures of the thesis' chapter 2.1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Link {
    /// [`NONE`] at the root.
    pub(super) parent: u32,
    /// Those of a leaf are [`NONE`] and its block.
    pub(super) children: [u32; 2],
    /// Triangles below.
    pub(super) count: u32,
    /// The cost of the node's split ([`DynamicTree::split_cost`]) when it was made; of a leaf, how much larger its box is
    /// than those of its triangles.
    pub(super) saved: f32,
    /// A node explodes only where its split costs more than this: more than when a rebuild was of no use.
    pub(super) accepted: f32,
    /// Leaves below when a rebuild over triangles was of no use.
    pub(super) grouped: u32,
    /// The wide node that begins here.
    pub(super) wide: u32,
    /// Listed for a stage of the update that runs.
    pub(super) mark: Mark,
}

/// What a stage of an update has to do with a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mark {
    /// Nothing.
    Plain,
    /// Its subtree is rebuilt; for others it is one primitive.
    Locked,
    /// It is taken out, and its children are put elsewhere.
    Migrating,
    /// It was taken out of the tree; its parent is the node below which it was.
    Freed,
}

impl Link {
    const BLANK: Self = Self {
        parent: NONE,
        children: [NONE; 2],
        count: 0,
        saved: 0.0,
        accepted: 0.0,
        grouped: 0,
        wide: NONE,
        mark: Mark::Plain,
    };
}

/// A box that threads write and read.
#[derive(Debug, Default)]
pub(super) struct SharedBox([AtomicU32; 6]);

impl SharedBox {
    pub(super) fn get(&self) -> Aabb {
        let [a, b, c, d, e, f] = self.0.each_ref().map(|x| f32::from_bits(x.load(Relaxed)));
        Aabb { min: Vec3::new(a, b, c), max: Vec3::new(d, e, f) }
    }

    pub(super) fn set(&self, bounds: &Aabb) {
        let values = [bounds.min.to_array(), bounds.max.to_array()];
        self.0.iter().zip(values.as_flattened()).for_each(|(x, value)| x.store(value.to_bits(), Relaxed));
    }
}

impl Clone for SharedBox {
    fn clone(&self) -> Self {
        let copy = Self::default();
        copy.set(&self.get());
        copy
    }
}

/// The tree. Its nodes stand anywhere in an array, near their parents where there was room.
#[derive(Clone, Debug)]
pub(super) struct DynamicTree {
    pub(super) links: Vec<Link>,
    pub(super) boxes: Vec<SharedBox>,
    pub(super) arena: Arena,
    /// [`NONE`] without triangles.
    pub(super) root: u32,
    /// Nodes that are new or have other children than before, and are not below others of these in one wide node.
    pub(super) touched: Vec<u32>,
    /// Nodes that got children since this was last set to zero.
    pub(super) changed: usize,
    /// Wide nodes whose binary nodes are no more.
    pub(super) released: Vec<u32>,
}

impl DynamicTree {
    /// The nodes of `tree` above and with `leaves`, which become blocks in their order.
    pub(super) fn new(tree: &BinaryTree, leaves: &[u32]) -> Self {
        let mut block_of = vec![NONE; tree.nodes.len()];
        leaves.iter().zip(0..).for_each(|(&leaf, block)| block_of[leaf as usize] = block);
        let mut new = Self {
            links: Vec::new(),
            boxes: Vec::new(),
            arena: Arena::full((2 * leaves.len()).saturating_sub(1)),
            root: if leaves.is_empty() { NONE } else { 0 },
            touched: Vec::new(),
            changed: 0,
            released: Vec::new(),
        };
        if leaves.is_empty() {
            return new;
        }
        new.push(&tree.nodes[0], NONE);
        // What is below the left child follows first.
        let mut waiting = vec![(0, 0_u32)];
        while let Some((old, own)) = waiting.pop() {
            let node: &Node = &tree.nodes[old];
            if block_of[old] != NONE {
                new.links[own as usize].children = [NONE, block_of[old]];
                continue;
            }
            let left = new.links.len() as u32;
            new.links[own as usize].children = [left, left + 1];
            let old = node.left as usize;
            new.push(&tree.nodes[old], own);
            new.push(&tree.nodes[old + 1], own);
            waiting.extend([(old + 1, left + 1), (old, left)]);
        }
        new.save_costs();
        new
    }

    fn push(&mut self, node: &Node, parent: u32) {
        self.links.push(Link { parent, count: node.count, ..Link::BLANK });
        let bounds = SharedBox::default();
        bounds.set(&node.bounds);
        self.boxes.push(bounds);
    }

    fn save_costs(&mut self) {
        for node in 0..self.links.len() as u32 {
            if !self.is_leaf(node) {
                self.save_cost(node);
            }
        }
        self.touched.push(self.root);
    }

    #[inline]
    pub(super) fn link(&self, node: u32) -> &Link {
        &self.links[node as usize]
    }

    #[inline]
    pub(super) fn link_mut(&mut self, node: u32) -> &mut Link {
        &mut self.links[node as usize]
    }

    #[inline]
    pub(super) fn is_leaf(&self, node: u32) -> bool {
        self.link(node).children[0] == NONE
    }

    /// The block of a leaf.
    #[inline]
    pub(super) fn block(&self, leaf: u32) -> usize {
        self.link(leaf).children[1] as usize
    }

    #[inline]
    pub(super) fn bounds(&self, node: u32) -> Aabb {
        self.boxes[node as usize].get()
    }

    #[inline]
    pub(super) fn set_bounds(&self, node: u32, bounds: &Aabb) {
        self.boxes[node as usize].set(bounds);
    }

    pub(super) fn sibling(&self, node: u32) -> u32 {
        let [a, b] = self.link(self.link(node).parent).children;
        if a == node { b } else { a }
    }

    /// The cost of a node's split (formula 1.3): `SA(NL)/SA(N) Count(NL) + SA(NR)/SA(N) Count(NR)`.
    #[inline]
    pub(super) fn split_cost(&self, node: u32) -> f32 {
        let parts = self.link(node).children.map(|c| (self.bounds(c).half_area(), self.link(c).count));
        split_cost(self.bounds(node).half_area(), parts)
    }

    /// A new node near `near`.
    pub(super) fn take(&mut self, near: u32) -> u32 {
        let place = self.arena.take(near as usize).unwrap_or_else(|| {
            let len = self.arena.len();
            self.arena.grow(len + len / 8 + 64);
            self.arena.take(near as usize).unwrap_or(len)
        });
        if self.arena.len() > self.links.len() {
            self.links.resize(self.arena.len(), Link { mark: Mark::Freed, ..Link::BLANK });
            self.boxes.resize_with(self.arena.len(), SharedBox::default);
        }
        self.links[place] = Link::BLANK;
        place as u32
    }

    /// Gives a node other children; its box, count and saved cost follow.
    pub(super) fn set_children(&mut self, node: u32, children: [u32; 2]) {
        self.set_children_below(node, children);
        self.touched.push(node);
    }

    /// The same for a node below one that is touched, with no wide node beginning on the way.
    pub(super) fn set_children_below(&mut self, node: u32, children: [u32; 2]) {
        self.link_mut(node).children = children;
        children.into_iter().for_each(|child| self.link_mut(child).parent = node);
        self.adopt(node);
        self.save_cost(node);
        self.changed += 1;
    }

    /// Notes the cost of a node's split.
    pub(super) fn save_cost(&mut self, node: u32) {
        let cost = self.split_cost(node);
        let link = self.link_mut(node);
        (link.saved, link.accepted) = (cost, 0.0);
    }

    /// Takes box and count from the children.
    pub(super) fn adopt(&mut self, node: u32) {
        let [a, b] = self.link(node).children;
        let bounds = self.bounds(a).union(self.bounds(b));
        self.link_mut(node).count = self.link(a).count + self.link(b).count;
        self.set_bounds(node, &bounds);
    }

    /// Nodes in use.
    pub(super) fn used(&self) -> usize {
        self.arena.len() - self.arena.free()
    }

    /// Puts `new` in the place of `old` below `parent`, or at the root.
    pub(super) fn replace(&mut self, parent: u32, old: u32, new: u32) {
        self.link_mut(new).parent = parent;
        if parent == NONE {
            self.root = new;
            return;
        }
        let children = &mut self.link_mut(parent).children;
        let place = usize::from(children[0] != old);
        children[place] = new;
        self.touched.push(parent);
    }

    /// Frees a node; its wide node too.
    pub(super) fn free(&mut self, node: u32) {
        self.release_wide(node);
        let link = self.link_mut(node);
        link.mark = Mark::Freed;
        link.children = [NONE; 2];
        self.arena.release(node as usize);
    }

    pub(super) fn release_wide(&mut self, node: u32) {
        let wide = std::mem::replace(&mut self.link_mut(node).wide, NONE);
        if wide != NONE {
            self.released.push(wide);
        }
    }

    /// `C(root)` as [`crate::quality`] has it, and the nodes on the longest way down.
    pub(super) fn cost(&self) -> (f64, usize) {
        if self.root == NONE { (0.0, 0) } else { self.cost_below(self.root) }
    }

    fn cost_below(&self, node: u32) -> (f64, usize) {
        let link = self.link(node);
        if self.is_leaf(node) {
            return (f64::from(link.count), 1);
        }
        let [a, b] = link.children;
        let (left, right) = self.join_below(link.count, || self.cost_below(a), || self.cost_below(b));
        let area = f64::from(self.bounds(node).half_area());
        let part = |child: u32| {
            let part = f64::from(self.bounds(child).half_area()) / area;
            if part.is_finite() { part } else { 1.0 }
        };
        (crate::quality::STEP + left.0 * part(a) + right.0 * part(b), 1 + left.1.max(right.1))
    }

    /// Does two things, by two threads where there is enough to do.
    pub(super) fn join_below<T: Send>(
        &self,
        count: u32,
        left: impl FnOnce() -> T + Send,
        right: impl FnOnce() -> T + Send,
    ) -> (T, T) {
        if count > SERIAL { rayon::join(left, right) } else { (left(), right()) }
    }

    /// Memory of the nodes.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(self.links.as_slice()) + size_of_val(self.boxes.as_slice())
    }

    /// Share of nodes that stand within 64 places of their parents.
    pub(super) fn locality(&self) -> f64 {
        let (near, all) = (0..self.links.len())
            .into_par_iter()
            .filter(|&node| self.links[node].mark != Mark::Freed && self.links[node].parent != NONE)
            .map(|node| (usize::from(node.abs_diff(self.links[node].parent as usize) <= 64), 1))
            .reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
        if all == 0 { 1.0 } else { near as f64 / f64::from(all) }
    }

    /// Checks that this is a tree whose nodes fill the arena, whose boxes are those of what is below, and whose leaves are
    /// those of `blocks` that hold triangles.
    pub(super) fn validate(&self, blocks: &[Block8]) -> Result<(), Violation> {
        let shape = |node: u32, what| Err(Violation::Shape { node: node as usize, what });
        let mut waiting = vec![self.root];
        let (mut reached, mut named) = (0, vec![false; blocks.len()]);
        waiting.retain(|&root| root != NONE);
        if waiting.iter().any(|&root| self.link(root).parent != NONE) {
            return shape(self.root, "is a root with a parent");
        }
        while let Some(node) = waiting.pop() {
            reached += 1;
            let link = self.link(node);
            if reached > self.links.len() || self.arena.is_free(node as usize) || link.mark != Mark::Plain {
                return shape(node, "is not one of the tree");
            }
            let bounds = if self.is_leaf(node) {
                let block = &blocks[self.block(node)];
                if std::mem::replace(&mut named[self.block(node)], true)
                    || block.used().count() != link.count as usize
                {
                    return shape(node, "is a leaf of another's block, or of another count");
                }
                LeafBox::of(block).bounds
            } else {
                let [a, b] = link.children;
                if [a, b].iter().any(|&c| self.link(c).parent != node) {
                    return shape(node, "has a child of another");
                }
                if self.link(a).count + self.link(b).count != link.count {
                    return shape(node, "has another count than its children");
                }
                waiting.extend([a, b]);
                self.bounds(a).union(self.bounds(b))
            };
            if bounds != self.bounds(node) {
                return Err(Violation::Box { node: node as usize, below: "what is below".into() });
            }
        }
        let unnamed = blocks.iter().zip(named).any(|(block, named)| !named && block.used().next().is_some());
        if unnamed || reached + self.arena.free() != self.links.len() {
            return shape(self.root, "does not reach all nodes and blocks");
        }
        Ok(())
    }
}

/// `SA(NL)/SA(N) Count(NL) + SA(NR)/SA(N) Count(NR)`, from the areas and counts; parts of nothing count in full.
#[inline]
pub(super) fn split_cost(whole: f32, parts: [(f32, u32); 2]) -> f32 {
    let [(a, m), (b, n)] = parts;
    let cost = (a * m as f32 + b * n as f32) / whole;
    if cost.is_finite() { cost } else { (m + n) as f32 }
}
