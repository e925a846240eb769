//! From parts to an array of nodes, and threads through it.

use super::build::{Inside, Part};
use super::{KdNode, KdTree};

/// Lays the parts out: children in pairs, the lower subtree before the upper one, and threads them.
pub(super) fn lay_out(root: Part) -> KdTree {
    let mut tree = KdTree { nodes: vec![KdNode::leaf(root.bounds, 0, 0)], ..KdTree::default() };
    let mut waiting = vec![(0, 1, root)];
    while let Some((index, level, part)) = waiting.pop() {
        tree.levels = tree.levels.max(level);
        match part.inside {
            Inside::Boxes(numbers) => {
                let first = tree.items.len() as u32;
                tree.nodes[index] = KdNode::leaf(part.bounds, first, numbers.len() as u32);
                tree.items.extend(numbers);
            }
            Inside::Cut(plane, children) => {
                let lower = tree.nodes.len();
                tree.nodes[index] = KdNode::fork(part.bounds, plane.axis, plane.cut, lower as u32);
                let [below, above] = *children;
                tree.nodes.extend([&below, &above].map(|child| KdNode::leaf(child.bounds, 0, 0)));
                waiting.push((lower + 1, level + 1, above));
                waiting.push((lower, level + 1, below));
            }
        }
    }
    thread(&mut tree.nodes);
    tree
}

/// Sets the threads of all nodes. Children stand behind their parents, so one way forward suffices: the near child's
/// thread leads to the far child, the far child's where the parent's leads.
pub(super) fn thread(nodes: &mut [KdNode]) {
    for index in 0..nodes.len() {
        let node = nodes[index];
        if node.is_leaf() {
            continue;
        }
        let lower = node.lower();
        for octant in 0..8 {
            let (near, far) = near_and_far(lower, node.axis(), octant);
            nodes[near].next[octant] = far as u32;
            nodes[far].next[octant] = node.next[octant];
        }
    }
}

/// The children of a fork across `axis` in the order in which a ray of the octant meets them.
#[inline(always)]
pub(super) fn near_and_far(lower: usize, axis: usize, octant: usize) -> (usize, usize) {
    let side = octant >> axis & 1;
    (lower + side, lower + (side ^ 1))
}
