//! Second stage of the clustered update (chapter 2.3 of the thesis): exploded subtrees are built afresh, each over the boxes of
//! its leaves and of the locked nodes below it.
//!
//! A subtree has as many inner nodes after as before, so new ones take the places of the old.
//!
//! Beyond the thesis, a node that meets none of the boxes that children of exploded nodes share is one primitive too, whether
//! it exploded or not ([`super::Region::Overlap`]); and leaves that fit together into a block are joined.

use super::adapt::{Exploded, Found, concerns};
use super::leaves::Leaves;
use super::tree::{DynamicTree, Mark, NONE};
use super::{Region, UpdateConfig};
use crate::build::{CLUSTERED, build, build_some};
use crate::wide::Block8;
use crate::{BinaryTree, BuildConfig, Reference, Scratch};
use rayon::prelude::*;
use vastlight_math::Aabb;

/// A subtree to build afresh.
#[derive(Debug, Default)]
struct Subtree {
    /// The nodes that are its inner ones, its root first.
    inner: Vec<u32>,
    /// What it is built over: leaves and nodes that stay as they are.
    prims: Vec<u32>,
}

/// Rebuilds the locked subtrees among the exploded ones; gives the nodes that this made.
pub(super) fn rebuild(
    tree: &mut DynamicTree,
    leaves: &mut Leaves,
    blocks: &mut [Block8],
    found: &Found,
    config: &UpdateConfig,
) -> Vec<u32> {
    let detail = if config.region == Region::Overlap { config.detail } else { 0.0 };
    let locked = found.locked(detail);
    let mut shared = Shared::default();
    for (exploded, &is_locked) in found.exploded.iter().zip(&locked) {
        tree.link_mut(exploded.node).mark = if is_locked { Mark::Locked } else { Mark::Plain };
        if config.region == Region::Overlap {
            shared.boxes.push((exploded.node, exploded.shared));
        }
    }
    shared.boxes.sort_unstable_by_key(|entry| entry.0);
    let is_locked = |root: &(usize, &Exploded)| locked[root.0];
    let mut roots: Vec<_> = found.exploded.iter().enumerate().filter(is_locked).collect();
    // Large ones start first, so that threads end together.
    roots.sort_by_key(|root| std::cmp::Reverse(tree.link(root.1.node).count));
    let new = |&(place, root): &(usize, &Exploded)| {
        let subtree = collect(tree, root.node, &shared, detail);
        let built = over(tree, &subtree.prims, leaves.config());
        let old: f32 = subtree.inner.iter().map(|&node| tree.bounds(node).half_area()).sum();
        let inner = built.nodes.iter().filter(|node| !node.is_leaf());
        let new: f32 = inner.map(|node| node.bounds.half_area()).sum();
        (place, subtree, (new < old * (1.0 - config.gain)).then_some(built))
    };
    let mut new: Vec<_> = roots.par_iter().with_max_len(1).map(new).collect();
    new.sort_unstable_by_key(|subtree| subtree.0);
    let mut made = Vec::new();
    // Lower ones come first, so that boxes and counts above are right.
    for (_, subtree, built) in new {
        tree.link_mut(subtree.inner[0]).mark = Mark::Plain;
        let Some(built) = built else {
            accept(tree, &subtree);
            continue;
        };
        put(tree, &subtree, &built);
        merge(tree, leaves, blocks, &subtree.inner);
        made.extend(subtree.inner);
    }
    made
}

/// Builds a subtree of any shape afresh over all its leaves.
pub(super) fn rebuild_all(tree: &mut DynamicTree, leaves: &mut Leaves, blocks: &mut [Block8], root: u32) {
    if root != NONE && !tree.is_leaf(root) {
        let subtree = collect(tree, root, &Shared::default(), 0.0);
        let built = over(tree, &subtree.prims, leaves.config());
        put(tree, &subtree, &built);
        merge(tree, leaves, blocks, &subtree.inner);
    }
}

/// The boxes that the children of exploded nodes share, by node.
#[derive(Debug, Default)]
struct Shared {
    boxes: Vec<(u32, Aabb)>,
}

impl Shared {
    fn at(&self, node: u32) -> Option<Aabb> {
        let place = self.boxes.binary_search_by_key(&node, |entry| entry.0).ok()?;
        Some(self.boxes[place].1)
    }
}

/// The nodes from `root` down to leaves and locked nodes; where there are boxes `shared`, to nodes that none concerns of
/// those shared at nodes above.
fn collect(tree: &DynamicTree, root: u32, shared: &Shared, detail: f32) -> Subtree {
    let mut subtree = Subtree { inner: vec![root], prims: Vec::new() };
    let by_overlap = !shared.boxes.is_empty();
    // Boxes that concern the nodes on the way, and how many of them were there where a node was put aside.
    let mut boxes: Vec<Aabb> = shared.at(root).into_iter().collect();
    let run = (0, boxes.len());
    let mut waiting: Vec<(u32, usize, usize)> =
        tree.link(root).children.map(|child| (child, run.0, run.1)).into();
    while let Some((node, first, end)) = waiting.pop() {
        boxes.truncate(end);
        let stays = tree.is_leaf(node) || tree.link(node).mark == Mark::Locked;
        if by_overlap && !stays {
            let own = tree.bounds(node);
            for place in first..end {
                if concerns(&boxes[place], &own, detail) {
                    boxes.push(boxes[place]);
                }
            }
        }
        if stays || by_overlap && boxes.len() == end {
            subtree.prims.push(node);
            continue;
        }
        if by_overlap {
            boxes.extend(shared.at(node));
        }
        subtree.inner.push(node);
        let run = (end, boxes.len());
        waiting.extend(tree.link(node).children.map(|child| (child, run.0, run.1)));
    }
    subtree.inner[1..].sort_unstable();
    subtree
}

/// The tree over the boxes of `prims`, one in each leaf.
fn over(tree: &DynamicTree, prims: &[u32], config: &BuildConfig) -> BinaryTree {
    let most = config.max_leaf.max(1);
    let reference = |(&prim, number): (&u32, u32)| {
        let plain = Reference::new(&tree.bounds(prim), number);
        Reference::to_cluster(*plain.lanes(), number, tree.link(prim).count.div_ceil(most).max(1))
    };
    let mut references: Vec<Reference> = prims.iter().zip(0..).map(reference).collect();
    let config = BuildConfig { max_leaf: 1, optimize: 0, ..*config };
    if references.len() < CLUSTERED {
        return build_some(&mut references, &config);
    }
    build("", &mut references, None, &config, &mut Scratch::default()).unwrap_or_default()
}

/// How much dearer splits must become after a rebuild was of no use before there is another.
const PATIENCE: f32 = 1.3;

/// Notes that a subtree is as good as a rebuild would make it.
fn accept(tree: &mut DynamicTree, subtree: &Subtree) {
    for &node in &subtree.inner {
        tree.link_mut(node).accepted = PATIENCE * tree.split_cost(node);
    }
}

/// Gives the nodes of a subtree the shape of `built`.
fn put(tree: &mut DynamicTree, subtree: &Subtree, built: &BinaryTree) {
    let mut free = subtree.inner.iter();
    let mut place = |node: &crate::Node| {
        let prim = || subtree.prims[built.prims[node.first as usize] as usize];
        if node.is_leaf() { prim() } else { free.next().copied().unwrap_or(NONE) }
    };
    let own: Vec<u32> = built.nodes.iter().map(&mut place).collect();
    subtree.inner[1..].iter().for_each(|&node| tree.release_wide(node));
    for (node, &own_place) in built.nodes.iter().zip(&own).rev().filter(|(node, _)| !node.is_leaf()) {
        let left = node.left as usize;
        tree.set_children_below(own_place, [own[left], own[left + 1]]);
    }
    tree.touched.push(subtree.inner[0]);
}

/// Joins leaves that are siblings below `inner`, and fit into one block.
fn merge(tree: &mut DynamicTree, leaves: &mut Leaves, blocks: &mut [Block8], inner: &[u32]) {
    for &node in inner.iter().rev() {
        if tree.is_leaf(node) || tree.link(node).mark == Mark::Freed {
            continue;
        }
        let [a, b] = tree.link(node).children;
        if leaves.may_merge(tree, a, b) {
            leaves.merge_children(tree, blocks, node);
        }
    }
}
