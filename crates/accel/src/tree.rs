//! The binary tree that every builder gives.

use vastlight_math::Aabb;

/// A node of a [`BinaryTree`]. Every node, not leaves alone, names the run of [`BinaryTree::prims`] below it.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Node {
    /// Contains the boxes of all primitives below.
    pub bounds: Aabb,
    /// Index of the left child, the right one follows it; 0 in a leaf.
    pub left: u32,
    /// First of the node's run in [`BinaryTree::prims`].
    pub first: u32,
    /// Length of the run, at least 1.
    pub count: u32,
}

impl Node {
    /// Whether the node has no children.
    #[inline]
    #[must_use]
    pub fn is_leaf(&self) -> bool {
        self.left == 0
    }
}

/// A binary bounding volume hierarchy. Node 0 is the root; without primitives there are no nodes.
#[derive(Clone, Debug, Default)]
pub struct BinaryTree {
    /// The nodes; children stand in pairs behind their parent. Subtrees of more than 4096 nodes stand together: a pair of
    /// children is followed by all that is below the left one, and this by all that is below the right one.
    pub nodes: Vec<Node>,
    /// Primitive numbers in the order of the leaves.
    pub prims: Vec<u32>,
}

impl BinaryTree {
    /// The box around everything; empty without primitives.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.nodes.first().map_or(Aabb::EMPTY, |root| root.bounds)
    }
}
