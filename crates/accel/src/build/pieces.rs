//! Trees in pieces: subtrees that single threads built, and the nodes above them, put together by all threads.

use crate::Node;
use vastlight_math::Aabb;

/// Pieces with fewer nodes are copied by one thread.
const SERIAL: usize = 1 << 13;

/// A part of a tree. Node and primitive numbers within count from its own start.
#[derive(Debug)]
pub(super) struct Piece {
    bounds: Aabb,
    /// Primitives below.
    count: u32,
    /// Nodes, its own root included.
    nodes: usize,
    kind: Kind,
}

#[derive(Debug)]
enum Kind {
    Subtree(Vec<Node>),
    Pair(Box<(Piece, Piece)>),
}

impl Piece {
    /// A subtree, whose first node is its root.
    pub(super) fn subtree(nodes: Vec<Node>) -> Self {
        let root = nodes.first().copied().unwrap_or(super::BLANK);
        Self { bounds: root.bounds, count: root.count, nodes: nodes.len(), kind: Kind::Subtree(nodes) }
    }

    /// A node with two children.
    pub(super) fn pair(left: Self, right: Self) -> Self {
        Self {
            bounds: left.bounds.union(right.bounds),
            count: left.count + right.count,
            nodes: 1 + left.nodes + right.nodes,
            kind: Kind::Pair(Box::new((left, right))),
        }
    }

    /// Around everything below.
    pub(super) fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Lays the pieces out in one array: pairs of children, depth first, subtrees as they are.
    pub(super) fn assemble(self) -> Vec<Node> {
        let mut nodes: Vec<Node> = bytemuck::zeroed_vec(self.nodes);
        if let Some((root, below)) = nodes.split_first_mut() {
            self.place(root, below, 1, 0);
        }
        nodes
    }

    /// Writes the piece's root to `root` and what is below to `below`, which starts with node number `next`; its
    /// primitives start at `first`.
    fn place(self, root: &mut Node, below: &mut [Node], next: u32, first: u32) {
        match self.kind {
            Kind::Subtree(nodes) => {
                let moved = |n: &Node| Node {
                    left: if n.is_leaf() { 0 } else { n.left + next - 1 },
                    first: n.first + first,
                    ..*n
                };
                let mut nodes = nodes.iter().map(moved);
                *root = nodes.next().unwrap_or(super::BLANK);
                below.iter_mut().zip(nodes).for_each(|(slot, node)| *slot = node);
            }
            Kind::Pair(children) => {
                *root = Node { bounds: self.bounds, left: next, first, count: self.count };
                let (left, right) = *children;
                let (pair, below) = below.split_at_mut(2);
                let (left_root, right_root) = pair.split_at_mut(1);
                let (below_left, below_right) = below.split_at_mut(left.nodes - 1);
                let next_right = next + 2 + below_left.len() as u32;
                let first_right = first + left.count;
                let place_left = || left.place(&mut left_root[0], below_left, next + 2, first);
                let place_right = || right.place(&mut right_root[0], below_right, next_right, first_right);
                if self.nodes > SERIAL {
                    rayon::join(place_left, place_right);
                } else {
                    place_left();
                    place_right();
                }
            }
        }
    }
}

impl Default for Piece {
    fn default() -> Self {
        Self::subtree(vec![super::BLANK])
    }
}
