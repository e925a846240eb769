//! Values of a tree's nodes that follow from their children's, by all threads.

use crate::Node;
use vastlight_simd::{Kernel, Level, Simd8};

/// Subtrees with fewer nodes are worked on by one thread.
const SERIAL: usize = 1 << 12;

/// How a node's value follows.
pub(crate) trait Upward: Sync {
    /// The value of a node.
    type Value: Send + Sync;
    /// The value of a leaf.
    fn leaf(&self, node: &Node) -> Self::Value;
    /// The value of a node whose children have the values `left` and `right`.
    fn inner(&self, node: &Node, children: [&Node; 2], values: [&Self::Value; 2]) -> Self::Value;
}

/// Finds the values of all nodes. Subtrees of more than [`SERIAL`] nodes stand together, what is below a left child in
/// front of what is below the right one.
pub(crate) fn upward<U: Upward>(rule: &U, nodes: &[Node], values: &mut [U::Value], level: Level) {
    if nodes.is_empty() {
        return;
    }
    let below = Below { rule, nodes, level };
    below.find(1, &mut values[1..]);
    values[0] = below.value(&nodes[0], values, 0);
}

struct Below<'a, U> {
    rule: &'a U,
    nodes: &'a [Node],
    level: Level,
}

impl<U: Upward> Below<'_, U> {
    /// The values of the nodes `first..first + values.len()`, which are whole subtrees.
    fn find(&self, first: usize, values: &mut [U::Value]) {
        if values.len() <= SERIAL {
            self.level.dispatch(Serial { below: self, first, values });
            return;
        }
        // A pair of children, what is below the left one, what is below the right one.
        let own = &self.nodes[first..first + 2];
        let (pair, below) = values.split_at_mut(2);
        let (left, right) = (first + 2, own[1].left as usize);
        let left_size = if own[1].is_leaf() { below.len() } else { right - left };
        let (below_left, below_right) = below.split_at_mut(left_size);
        rayon::join(|| self.find(left, below_left), || self.find(left + left_size, below_right));
        pair[0] = self.value(&own[0], below_left, left);
        pair[1] = self.value(&own[1], below_right, left + left_size);
    }

    /// The value of a node whose children's values are in `values`, which starts with that of node `first`.
    #[inline(always)]
    fn value(&self, node: &Node, values: &[U::Value], first: usize) -> U::Value {
        if node.is_leaf() {
            return self.rule.leaf(node);
        }
        let left = node.left as usize;
        let children = [&self.nodes[left], &self.nodes[left + 1]];
        self.rule.inner(node, children, [&values[left - first], &values[left + 1 - first]])
    }
}

struct Serial<'a, 'b, U: Upward> {
    below: &'a Below<'b, U>,
    first: usize,
    values: &'a mut [U::Value],
}

impl<U: Upward> Kernel for Serial<'_, '_, U> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd8>(self, _simd: S) {
        for i in (0..self.values.len()).rev() {
            self.values[i] = self.below.value(&self.below.nodes[self.first + i], self.values, self.first);
        }
    }
}
