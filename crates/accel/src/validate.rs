//! Whether a binary tree is what it should be.

use crate::BinaryTree;
use vastlight_math::{Aabb, Vec3};

/// What a sound tree holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Report {
    /// Nodes, leaves included.
    pub nodes: usize,
    /// Leaves.
    pub leaves: usize,
    /// References in leaves; a block names a primitive once, of however many parts.
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
    /// A primitive is in no leaf, or in several that do not cover it.
    #[error("primitive {prim} is not covered by the {times} leaves that name it")]
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
    validate_parts(tree, boxes, max_leaf, |_, _| false)
}

/// As [`validate`], but a primitive may be in several leaves: then `covered` is asked whether their boxes together
/// contain it.
///
/// # Errors
/// The first violation.
pub fn validate_parts(
    tree: &BinaryTree,
    boxes: &[Aabb],
    max_leaf: u32,
    covered: impl Fn(u32, &[Aabb]) -> bool,
) -> Result<Report, Violation> {
    let mut report = Report { nodes: tree.nodes.len(), references: tree.prims.len(), ..Report::default() };
    let mut parents = vec![0_u32; tree.nodes.len()];
    let mut found = Found::new(boxes.len());
    for (index, node) in tree.nodes.iter().enumerate() {
        if node.is_leaf() {
            check_leaf(tree, index, boxes, max_leaf, &mut found)?;
            report.leaves += 1;
            report.largest_leaf = report.largest_leaf.max(node.count as usize);
        } else {
            check_children(tree, index, &mut parents)?;
        }
    }
    if let Some(node) = (1..parents.len()).find(|&i| parents[i] != 1) {
        return Err(Violation::Shape { node, what: "does not have one parent" });
    }
    found.check(|prim| boxes[prim as usize], covered)?;
    Ok(report)
}

fn check_leaf(
    tree: &BinaryTree,
    index: usize,
    boxes: &[Aabb],
    max_leaf: u32,
    found: &mut Found,
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
        if prim as usize >= boxes.len() {
            return shape("names a primitive that does not exist");
        }
        found.add(prim, index, node.bounds);
    }
    Ok(())
}

/// The leaves that name each primitive: index and box.
pub(crate) struct Found {
    leaves: Vec<Vec<(usize, Aabb)>>,
}

impl Found {
    pub(crate) fn new(prims: usize) -> Self {
        Self { leaves: vec![Vec::new(); prims] }
    }

    /// Notes a leaf; false if there is no such primitive.
    pub(crate) fn add(&mut self, prim: u32, leaf: usize, bounds: Aabb) -> bool {
        match self.leaves.get_mut(prim as usize) {
            Some(leaves) => leaves.push((leaf, bounds)),
            None => return false,
        }
        true
    }

    /// Checks that every primitive, whose box `whole` gives, is in one leaf, or covered by its leaves.
    pub(crate) fn check(
        &self,
        whole: impl Fn(u32) -> Aabb,
        covered: impl Fn(u32, &[Aabb]) -> bool,
    ) -> Result<(), Violation> {
        for (prim, leaves) in (0_u32..).zip(&self.leaves) {
            match leaves.as_slice() {
                [(leaf, bounds)] if !bounds.contains(&whole(prim)) => {
                    return Err(Violation::Box { node: *leaf, below: format!("primitive {prim}") });
                }
                [_] => {}
                several => {
                    let boxes: Vec<Aabb> = several.iter().map(|l| l.1).collect();
                    if boxes.is_empty() || !covered(prim, &boxes) {
                        return Err(Violation::Coverage { prim: prim as usize, times: boxes.len() as u32 });
                    }
                }
            }
        }
        Ok(())
    }
}

/// Whether every one of many points of a triangle is in one of `boxes`, up to the rounding of the points.
pub(crate) fn covers_triangle(corners: [Vec3; 3], boxes: &[Aabb]) -> bool {
    const STEPS: usize = 12;
    let [a, b, c] = corners;
    let slack = Vec3::splat(corners.iter().fold(0.0, |m: f32, p| m.max(p.abs().max_element())) * 1e-6);
    let point = |i: usize| {
        let (u, v) = ((i / (STEPS + 1)) as f32 / STEPS as f32, (i % (STEPS + 1)) as f32 / STEPS as f32);
        a + (b - a) * (u * (1.0 - v)) + (c - a) * (u * v)
    };
    (0..(STEPS + 1) * (STEPS + 1)).map(point).all(|p| {
        let near = Aabb { min: p + slack, max: p - slack };
        boxes.iter().any(|b| b.min.cmple(near.min).all() && b.max.cmpge(near.max).all())
    })
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
