//! Whether a wide tree is what it should be.

use super::{Block8, ChildRef, MeshBvh, MeshView, Node8};
use crate::validate::{Found, covers_triangle};
use crate::{Report, Violation};
use vastlight_math::Aabb;

/// What boxes of children have to do with those of their parents.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Boxes {
    /// They lie inside.
    Nested,
    /// Rounded outward by themselves, they may stand out; what counts is what is inside all boxes on the way.
    Rounded,
}

/// Checks that `nodes` below `root` are a tree of which every node is reached once, but for free ones, which are empty; and
/// that every slot's box contains the boxes below. `leaf` gives the numbers and boxes of a leaf's primitives, or none if there is no such leaf; where
/// several leaves name a primitive, `covered` is asked whether their boxes together contain it.
///
/// # Errors
/// The first violation.
pub fn validate_nodes(
    nodes: &[Node8],
    root: Option<ChildRef>,
    prims: usize,
    boxes: Boxes,
    leaf: impl Fn(usize) -> Option<Vec<(u32, Aabb)>>,
    covered: impl Fn(u32, &[Aabb]) -> bool,
) -> Result<Report, Violation> {
    let mut report = Report::default();
    let mut found = Found::new(prims);
    let mut whole = vec![Aabb::EMPTY; prims];
    let everywhere = Aabb { min: -vastlight_math::Vec3::INFINITY, max: vastlight_math::Vec3::INFINITY };
    let mut waiting: Vec<(usize, ChildRef, Aabb)> =
        root.map(|root| (0, root, everywhere)).into_iter().collect();
    while let Some((parent, child, bounds)) = waiting.pop() {
        if !child.is_leaf() {
            report.nodes += 1;
            if report.nodes > nodes.len() || child.index() >= nodes.len() {
                return Err(Violation::Shape {
                    node: parent,
                    what: "has children that are no nodes of a tree",
                });
            }
            push_children((child.index(), &nodes[child.index()]), (parent, &bounds), boxes, &mut waiting)?;
            continue;
        }
        let Some(named) = leaf(child.index()) else {
            return Err(Violation::Shape { node: parent, what: "has a leaf that does not exist" });
        };
        report.leaves += 1;
        report.references += named.len();
        report.largest_leaf = report.largest_leaf.max(named.len());
        for (prim, own) in named {
            if !found.add(prim, parent, bounds) {
                return Err(Violation::Shape { node: parent, what: "names a primitive that does not exist" });
            }
            whole[prim as usize] = own;
        }
    }
    let free = nodes.iter().filter(|node| **node == Node8::EMPTY).count();
    if report.nodes + free != nodes.len() {
        return Err(Violation::Shape { node: report.nodes, what: "is not reached" });
    }
    found.check(|prim| whole[prim as usize], covered)?;
    Ok(report)
}

fn push_children(
    (index, node): (usize, &Node8),
    (parent, bounds): (usize, &Aabb),
    boxes: Boxes,
    waiting: &mut Vec<(usize, ChildRef, Aabb)>,
) -> Result<(), Violation> {
    for slot in 0..8 {
        let (child, own) = (node.children[slot], node.bounds(slot));
        if child == ChildRef::NONE {
            if !own.is_empty() {
                return Err(Violation::Shape { node: index, what: "has a box without child" });
            }
            continue;
        }
        if boxes == Boxes::Nested && !bounds.contains(&own) {
            return Err(Violation::Box { node: parent, below: format!("node {index}") });
        }
        waiting.push((index, child, Aabb { min: own.min.max(bounds.min), max: own.max.min(bounds.max) }));
    }
    Ok(())
}

/// Checks that the triangles of `blocks` are those of `mesh`, scaled.
pub(crate) fn validate_blocks(blocks: &[Block8], mesh: &MeshView<'_>, scale: f32) -> Result<(), Violation> {
    for (index, block) in blocks.iter().enumerate() {
        for lane in block.used() {
            let prim = block.prims[lane];
            let exists = (prim as usize) < mesh.triangles.len();
            if !exists || block.triangle(lane) != mesh.corners(prim).map(|p| p * scale) {
                return Err(Violation::Shape { node: index, what: "is a block with a wrong triangle" });
            }
        }
    }
    Ok(())
}

impl MeshBvh {
    /// Checks the tree, and that its blocks hold exactly the mesh's triangles, scaled.
    ///
    /// # Errors
    /// The first violation.
    pub fn validate(&self, mesh: &MeshView<'_>) -> Result<Report, Violation> {
        validate_blocks(&self.blocks, mesh, self.scale)?;
        let leaf = |leaf: usize| self.blocks.get(leaf).map(Block8::boxes);
        let corners = |prim: u32| mesh.corners(prim).map(|p| p * self.scale);
        let covered = |prim: u32, boxes: &[Aabb]| covers_triangle(corners(prim), boxes);
        validate_nodes(&self.nodes, self.root, mesh.triangles.len(), Boxes::Nested, leaf, covered)
    }
}
