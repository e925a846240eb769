//! Whether a binary tree is what it should be.

use crate::BinaryTree;
use vastlight_math::Aabb;

/// What a sound tree holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Report {
    /// Nodes, leaves included.
    pub nodes: usize,
    /// Leaves.
    pub leaves: usize,
    /// References in leaves.
    pub references: usize,
    /// Largest leaf.
    pub largest_leaf: usize,
}

/// What is wrong with a tree.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Violation {
    /// A node's children, leaf or primitive does not exist, or stands where it must not.
    #[error("node {node}: {what}")]
    Shape {
        /// The node.
        node: usize,
        /// What is wrong.
        what: &'static str,
    },
    /// A box does not contain what is below.
    #[error("node {node}: its box does not contain that of {below}")]
    Box {
        /// The node.
        node: usize,
        /// A child, or a primitive.
        below: String,
    },
    /// A primitive is in no leaf, or in more than one.
    #[error("primitive {prim} is in {times} leaves")]
    Coverage {
        /// The primitive.
        prim: usize,
        /// In how many leaves it is.
        times: u32,
    },
}

/// Checks that `tree` is a tree, that every box contains what is below, that no leaf is larger than `max_leaf`, and that each
/// of the primitives, whose boxes are `boxes`, is in exactly one leaf.
///
/// # Errors
/// The first violation.
pub fn validate(tree: &BinaryTree, boxes: &[Aabb], max_leaf: u32) -> Result<Report, Violation> {
    let mut report = Report { nodes: tree.nodes.len(), references: tree.prims.len(), ..Report::default() };
    let mut parents = vec![0_u32; tree.nodes.len()];
    let mut times = vec![0_u32; boxes.len()];
    for (index, node) in tree.nodes.iter().enumerate() {
        if node.is_leaf() {
            check_leaf(tree, index, boxes, max_leaf, &mut times)?;
            report.leaves += 1;
            report.largest_leaf = report.largest_leaf.max(node.count as usize);
        } else {
            check_children(tree, index, &mut parents)?;
        }
    }
    if let Some(node) = (1..parents.len()).find(|&i| parents[i] != 1) {
        return Err(Violation::Shape { node, what: "does not have one parent" });
    }
    match times.iter().position(|&t| t != 1) {
        Some(prim) => Err(Violation::Coverage { prim, times: times[prim] }),
        None => Ok(report),
    }
}

fn check_leaf(
    tree: &BinaryTree,
    index: usize,
    boxes: &[Aabb],
    max_leaf: u32,
    times: &mut [u32],
) -> Result<(), Violation> {
    let node = &tree.nodes[index];
    let shape = |what| Err(Violation::Shape { node: index, what });
    if node.count == 0 || node.count > max_leaf {
        return shape("is an empty or too large leaf");
    }
    let Some(prims) = tree.prims.get(node.first as usize..(node.first + node.count) as usize) else {
        return shape("names primitives that do not exist");
    };
    for &prim in prims {
        let Some(bounds) = boxes.get(prim as usize) else {
            return shape("names a primitive that does not exist");
        };
        if !node.bounds.contains(bounds) {
            return Err(Violation::Box { node: index, below: format!("primitive {prim}") });
        }
        times[prim as usize] += 1;
    }
    Ok(())
}

fn check_children(tree: &BinaryTree, index: usize, parents: &mut [u32]) -> Result<(), Violation> {
    let node = &tree.nodes[index];
    let shape = |what| Err(Violation::Shape { node: index, what });
    let left = node.left as usize;
    let Some([a, b]) = tree.nodes.get(left..left + 2) else {
        return shape("has children that do not exist");
    };
    if left <= index {
        return shape("has children in front of it");
    }
    if a.first != node.first || b.first != a.first + a.count || a.count + b.count != node.count {
        return shape("does not have the primitives of its children");
    }
    for (child, bounds) in [(left, a.bounds), (left + 1, b.bounds)] {
        parents[child] += 1;
        if !node.bounds.contains(&bounds) {
            return Err(Violation::Box { node: index, below: format!("node {child}") });
        }
    }
    Ok(())
}
