//! How good a tree is: the cost of K. V. Garanzha's thesis of 2014 (chapter 4.2), where published tables use it.
//!
//! `C(leaf)` = primitives in it, `C(N) = 2 + C(left) SA(left)/SA(N) + C(right) SA(right)/SA(N)`. And how much siblings
//! overlap, as its formula 2.2 has it: `SA(left and right) / min(SA(left), SA(right))`.

use crate::upward::{Upward, upward};
use crate::{BinaryTree, Node};
use vastlight_math::Aabb;
use vastlight_simd::Level;

/// Cost of a step down, in units of testing a primitive.
pub(crate) const STEP: f64 = 2.0;

/// Figures about a binary tree.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quality {
    /// `C(root)`; zero without primitives.
    pub cost: f64,
    /// Nodes, leaves included.
    pub nodes: usize,
    /// References in leaves.
    pub references: usize,
    /// Nodes on the longest way from the root to a leaf.
    pub depth: usize,
    /// Overlap of siblings, from 0 to 1: the mean over all nodes with children, weighted by their areas.
    pub overlap: f64,
}

/// Measures a tree. A child whose parent has no area counts in full.
#[must_use]
pub fn quality(tree: &BinaryTree) -> Quality {
    quality_with(tree, |_| 1.0)
}

/// Measures a tree whose primitives have costs of their own, such as instances of other trees.
#[must_use]
pub fn quality_with(tree: &BinaryTree, prim_cost: impl Fn(u32) -> f64 + Sync) -> Quality {
    quality_of(&tree.nodes, |node| {
        let run = node.first as usize..(node.first + node.count) as usize;
        tree.prims[run].iter().map(|&prim| prim_cost(prim)).sum()
    })
}

/// Measures a tree of nodes whose leaves have the costs `leaf_cost`.
pub(crate) fn quality_of(nodes: &[Node], leaf_cost: impl Fn(&Node) -> f64 + Sync) -> Quality {
    let kept = &mut vec![(); nodes.len()];
    let root = upward(&Measure { leaf_cost }, nodes, kept, Level::PORTABLE).unwrap_or_default();
    let overlap = if root.area > 0.0 { root.overlap / root.area } else { 0.0 };
    Quality { cost: root.cost, depth: root.depth as usize, overlap, ..counts(nodes) }
}

/// What is known of a tree without measuring: its nodes and references.
pub(crate) fn counts(nodes: &[Node]) -> Quality {
    let references = nodes.first().map_or(0, |root| root.count as usize);
    Quality { nodes: nodes.len(), references, ..Quality::default() }
}

/// Figures about a subtree.
#[derive(Clone, Copy, Debug, Default)]
struct Figures {
    cost: f64,
    depth: u32,
    /// Sum of the areas of nodes with children.
    area: f64,
    /// Sum of their children's overlap times their areas.
    overlap: f64,
}

/// How the figures follow.
struct Measure<F> {
    leaf_cost: F,
}

impl<F: Fn(&Node) -> f64 + Sync> Upward for Measure<F> {
    type Kept = ();
    type Value = Figures;

    #[inline(always)]
    fn leaf(&self, node: &Node, (): &mut ()) -> Figures {
        Figures { cost: (self.leaf_cost)(node), depth: 1, ..Figures::default() }
    }

    #[inline(always)]
    fn inner(&self, node: &Node, children: [&Node; 2], values: [&Figures; 2], (): &mut ()) -> Figures {
        let area = f64::from(node.bounds.half_area());
        let mut cost = STEP;
        for (child, value) in children.into_iter().zip(values) {
            let part = f64::from(child.bounds.half_area()) / area;
            cost += value.cost * if part.is_finite() { part } else { 1.0 };
        }
        let [l, r] = values;
        Figures {
            cost,
            depth: 1 + l.depth.max(r.depth),
            area: l.area + r.area + area,
            overlap: l.overlap + r.overlap + area * overlap(children.map(|c| &c.bounds)),
        }
    }
}

/// The area that two boxes share, over the smaller one's.
fn overlap([a, b]: [&Aabb; 2]) -> f64 {
    let shared = a.intersection(*b);
    let part = f64::from(shared.half_area()) / f64::from(a.half_area().min(b.half_area()));
    if shared.is_empty() || !part.is_finite() { 0.0 } else { part.min(1.0) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Node;
    use vastlight_math::{Aabb, Vec3};

    #[test]
    fn the_cost_of_a_small_tree_is_that_on_paper() {
        let cube = |min: f32, max: f32| Aabb { min: Vec3::splat(min), max: Vec3::splat(max) };
        let node = |bounds, left, first, count| Node { bounds, left, first, count };
        let tree = BinaryTree {
            nodes: vec![
                node(cube(0.0, 2.0), 1, 0, 5),
                node(cube(0.0, 1.0), 0, 0, 2),
                node(cube(0.0, 2.0), 0, 2, 3),
            ],
            prims: vec![0, 1, 2, 3, 4],
        };
        // The left child has a quarter of the root's area, and lies in the right one.
        let cost = 2.0 + 2.0 * 0.25 + 3.0;
        let expected = Quality { cost, nodes: 3, references: 5, depth: 2, overlap: 1.0 };
        assert_eq!(quality(&tree), expected);
        let mut apart = tree;
        apart.nodes[2].bounds.min.x = 0.5;
        // They share a box of 0.5 x 1 x 1, the smaller is 1 x 1 x 1.
        assert_eq!(quality(&apart).overlap, 2.0 / 3.0);
        assert_eq!(quality(&BinaryTree::default()), Quality::default());
    }
}
