//! How good a tree is: the cost of K. V. Garanzha's thesis of 2014 (chapter 4.2), where published tables use it.
//!
//! `C(leaf)` = primitives in it, `C(N) = 2 + C(left) SA(left)/SA(N) + C(right) SA(right)/SA(N)`.

use crate::BinaryTree;

/// Cost of a step down, in units of testing a primitive.
pub(crate) const STEP: f64 = 2.0;

/// Figures about a binary tree.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quality {
    /// `C(root)`; zero without primitives.
    pub cost: f64,
    /// Nodes, leaves included.
    pub nodes: usize,
    /// Leaves.
    pub leaves: usize,
    /// References in leaves.
    pub references: usize,
    /// Nodes on the longest way from the root to a leaf.
    pub depth: usize,
}

/// Measures a tree. A child whose parent has no area counts in full.
#[must_use]
pub fn quality(tree: &BinaryTree) -> Quality {
    quality_with(tree, |_| 1.0)
}

/// Measures a tree whose primitives have costs of their own, such as instances of other trees.
#[must_use]
pub fn quality_with(tree: &BinaryTree, prim_cost: impl Fn(u32) -> f64) -> Quality {
    // Children stand behind their parents, so backwards is bottom-up.
    let mut cost = vec![0.0_f64; tree.nodes.len()];
    let mut depth = vec![1_usize; tree.nodes.len()];
    let mut leaves = 0;
    for (i, node) in tree.nodes.iter().enumerate().rev() {
        if node.is_leaf() {
            let run = node.first as usize..(node.first + node.count) as usize;
            cost[i] = tree.prims[run].iter().map(|&prim| prim_cost(prim)).sum();
            leaves += 1;
            continue;
        }
        let area = f64::from(node.bounds.half_area());
        cost[i] = STEP;
        for child in [node.left as usize, node.left as usize + 1] {
            let part = f64::from(tree.nodes[child].bounds.half_area()) / area;
            cost[i] += cost[child] * if part.is_finite() { part } else { 1.0 };
            depth[i] = depth[i].max(depth[child] + 1);
        }
    }
    Quality {
        cost: cost.first().copied().unwrap_or(0.0),
        nodes: tree.nodes.len(),
        leaves,
        references: tree.prims.len(),
        depth: depth.first().copied().unwrap_or(0),
    }
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
        // The left child has a quarter of the root's area.
        let expected = Quality { cost: 2.0 + 2.0 * 0.25 + 3.0, nodes: 3, leaves: 2, references: 5, depth: 2 };
        assert_eq!(quality(&tree), expected);
        assert_eq!(quality(&BinaryTree::default()), Quality::default());
    }
}
