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

    /// The subtrees in order.
    pub(super) fn subtrees<'a>(&'a mut self, found: &mut Vec<&'a mut [Node]>) {
        match &mut self.kind {
            Kind::Subtree(nodes) => found.push(nodes),
            Kind::Pair(children) => {
                children.0.subtrees(found);
                children.1.subtrees(found);
            }
        }
    }

    /// Finds the boxes of the nodes above subtrees, whose own are known.
    pub(super) fn refit(&mut self) {
        self.bounds = match &mut self.kind {
            Kind::Subtree(nodes) => nodes.first().map_or(Aabb::EMPTY, |root| root.bounds),
            Kind::Pair(children) => {
                children.0.refit();
                children.1.refit();
                children.0.bounds.union(children.1.bounds)
            }
        };
    }

    /// Nodes in the tree.
    pub(super) fn nodes(&self) -> usize {
        self.nodes
    }

    /// Around everything below.
    pub(super) fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Lays the pieces out in one array: pairs of children, depth first, subtrees as they are.
    pub(super) fn assemble(self) -> Vec<Node> {
        let mut nodes: Vec<Node> = bytemuck::zeroed_vec(self.nodes);
        self.assemble_into(&mut nodes, true);
        nodes
    }

    /// Lays the pieces out in `nodes`, as many as they are. Nodes are told where their primitives start (`runs`), or keep
    /// what they were told.
    pub(super) fn assemble_into(self, nodes: &mut [Node], runs: bool) {
        if let Some((root, below)) = nodes.split_first_mut() {
            self.place(root, below, 1, runs.then_some(0));
        }
    }

    /// Writes the piece's root to `root` and what is below to `below`, which starts with node number `next`; its
    /// primitives start at `first`, where that is of interest.
    fn place(self, root: &mut Node, below: &mut [Node], next: u32, first: Option<u32>) {
        match self.kind {
            Kind::Subtree(nodes) => {
                let moved = |n: &Node| Node {
                    left: if n.is_leaf() { 0 } else { n.left + next - 1 },
                    first: n.first + first.unwrap_or(0),
                    ..*n
                };
                let mut nodes = nodes.iter().map(moved);
                *root = nodes.next().unwrap_or(super::BLANK);
                below.iter_mut().zip(nodes).for_each(|(slot, node)| *slot = node);
            }
            Kind::Pair(children) => {
                let count = self.count;
                *root = Node { bounds: self.bounds, left: next, first: first.unwrap_or(0), count };
                let (left, right) = *children;
                let (pair, below) = below.split_at_mut(2);
                let (left_root, right_root) = pair.split_at_mut(1);
                let (below_left, below_right) = below.split_at_mut(left.nodes - 1);
                let next_right = next + 2 + below_left.len() as u32;
                let first_right = first.map(|first| first + left.count);
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
