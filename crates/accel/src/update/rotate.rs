//! Rotations: Kopta, Ize, Spjut, Brunvand, Davis, Kensler 2012, "Fast, effective BVH updates for animated scenes".
//!
//! Where the boxes of a node's children add up to less area with a child and a grandchild in each other's place, they
//! change places. Deviation: all nodes are looked at in parallel first, from the bottom up as boxes are refitted; those
//! where something is gained are then rotated one after the other, if they still gain.

use super::tree::{DynamicTree, Mark};

/// A child and the grandchild, below the other child, that change places.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rotation {
    child: u32,
    grandchild: u32,
}

/// The rotation at a node that makes boxes smaller by the most; none where none does.
pub(super) fn best(tree: &DynamicTree, node: u32) -> Option<Rotation> {
    let mut best = (0.0, None);
    let [a, b] = tree.link(node).children;
    for (child, other) in [(a, b), (b, a)] {
        if tree.is_leaf(other) {
            continue;
        }
        let (own, area) = (tree.bounds(child), tree.bounds(other).half_area());
        let [c, d] = tree.link(other).children;
        for (grandchild, stays) in [(c, d), (d, c)] {
            let gain = area - tree.bounds(stays).union(own).half_area();
            if gain > best.0 {
                best = (gain, Some(Rotation { child, grandchild }));
            }
        }
    }
    // Rounding is no gain.
    best.1.filter(|_| best.0 > 1e-5 * tree.bounds(node).half_area())
}

/// Rotates at the nodes `listed` where it still pays; gives how often it did.
pub(super) fn rotate(tree: &mut DynamicTree, listed: &[u32]) -> usize {
    let mut made = 0;
    for &node in listed {
        if tree.link(node).mark == Mark::Freed || tree.is_leaf(node) {
            continue;
        }
        if let Some(Rotation { child, grandchild }) = best(tree, node) {
            let other = tree.link(grandchild).parent;
            let stays = tree.sibling(grandchild);
            tree.set_children(other, [stays, child]);
            tree.set_children(node, [other, grandchild]);
            made += 1;
        }
    }
    made
}
