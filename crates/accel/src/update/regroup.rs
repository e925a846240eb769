//! Beyond the thesis: small subtrees are built afresh over their triangles where their leaves have become small.
//!
//! Leaves that burst leave small ones behind, each a block of its own with few triangles. Nodes with at most [`FEW`]
//! triangles whose leaves hold fewer than [`FILL`] on average are built afresh as a builder would build them, if that
//! makes boxes smaller.

use super::leaves::Leaves;
use super::tree::{DynamicTree, Mark, NONE};
use crate::BinaryTree;
use crate::memory::Pages;
use crate::wide::Block8;
use rayon::prelude::*;

/// Most triangles of a subtree that is built afresh.
pub(super) const FEW: u32 = 64;
/// Leaves of subtrees that are not hold as many triangles on average.
const FILL: u32 = 4;

/// Whether the leaves of a node, of `count` triangles, are small.
pub(super) fn is_scattered(count: u32, leaves: u32) -> bool {
    count <= FEW && leaves > 1 && count < leaves * FILL
}

/// Rebuilds the subtrees `listed`, where they still are what they were when they were listed; gives how many were.
pub(super) fn regroup(
    tree: &mut DynamicTree,
    leaves: &mut Leaves,
    blocks: &mut Pages<Block8>,
    listed: &[u32],
) -> usize {
    let new = |&node: &u32| {
        let (inner, own_leaves) = nodes_below(tree, node);
        let areas: f32 = inner.iter().chain(&own_leaves).map(|&n| tree.bounds(n).half_area()).sum();
        let own_blocks: Vec<usize> = own_leaves.iter().map(|&leaf| tree.block(leaf)).collect();
        let built = leaves.grouped(&own_blocks, blocks);
        let better = |built: &BinaryTree| {
            built.nodes.iter().map(|node| node.bounds.half_area()).sum::<f32>() < areas * 0.99
        };
        let built = better(&built).then_some(built);
        (inner, own_leaves, built)
    };
    let listed = &still_scattered(tree, listed)[..];
    let new: Vec<_> = listed.par_iter().with_min_len(16).map(new).collect();
    let mut made = 0;
    for (&node, (inner, own_leaves, built)) in listed.iter().zip(new) {
        let Some(built) = built else {
            tree.link_mut(node).grouped = own_leaves.len() as u32;
            continue;
        };
        let triangles = leaves.take_apart(tree, blocks, &own_leaves);
        inner.iter().filter(|&&n| n != node).for_each(|&n| tree.free(n));
        leaves.plant(tree, blocks, node, &built, &triangles);
        made += 1;
    }
    made
}

/// The nodes among `listed` that have children, few triangles, and none of the others above them.
fn still_scattered(tree: &DynamicTree, listed: &[u32]) -> Vec<u32> {
    let mut is_listed = vec![false; tree.links.len()];
    listed.iter().for_each(|&node| is_listed[node as usize] = true);
    let is_small = |node: u32| tree.link(node).count <= FEW;
    let stays = |node: u32| {
        let above = |node: &u32| Some(tree.link(*node).parent).filter(|&n| n != NONE && is_small(n));
        let mut all_above = std::iter::successors(above(&node), above);
        let lives = tree.link(node).mark == Mark::Plain && !tree.is_leaf(node) && is_small(node);
        lives && !all_above.any(|n| is_listed[n as usize])
    };
    listed.iter().copied().filter(|&node| stays(node)).collect()
}

/// Inner nodes and leaves at and below a node.
fn nodes_below(tree: &DynamicTree, node: u32) -> (Vec<u32>, Vec<u32>) {
    let (mut inner, mut leaves, mut waiting) = (Vec::new(), Vec::new(), vec![node]);
    while let Some(node) = waiting.pop() {
        if tree.is_leaf(node) {
            leaves.push(node);
        } else {
            inner.push(node);
            waiting.extend(tree.link(node).children.into_iter().filter(|&child| child != NONE));
        }
    }
    (inner, leaves)
}
