//! Values of a tree's nodes that follow from their children's, by all threads.

use crate::Node;
use vastlight_simd::{Kernel, Level, Simd8};

/// Subtrees with fewer nodes are worked on by one thread.
const SERIAL: usize = 1 << 12;

/// How a node's value follows. What the parent needs to know is handed up; what is to be kept of each node is written to
/// an array, so that it can be much smaller.
pub(crate) trait Upward: Sync {
    /// What is kept of a node.
    type Kept: Send + Sync;
    /// What its parent needs to know.
    type Value: Copy + Default + Send;
    /// The value of a leaf.
    fn leaf(&self, node: &Node, kept: &mut Self::Kept) -> Self::Value;
    /// The value of a node whose children have the values `values`.
    fn inner(
        &self,
        node: &Node,
        children: [&Node; 2],
        values: [&Self::Value; 2],
        kept: &mut Self::Kept,
    ) -> Self::Value;
}

/// Finds what is kept of each node; gives the value of the root, none of a tree without nodes. Subtrees of more than
/// [`SERIAL`] nodes stand together, what is below a left child in front of what is below the right one.
pub(crate) fn upward<U: Upward>(
    rule: &U,
    nodes: &[Node],
    kept: &mut [U::Kept],
    level: Level,
) -> Option<U::Value> {
    let (root, below_root) = kept.split_first_mut()?;
    let below = Below { rule, nodes, level };
    let values = if below_root.is_empty() { Default::default() } else { below.find(1, below_root) };
    Some(below.value(nodes.first()?, values, root))
}

struct Below<'a, U> {
    rule: &'a U,
    nodes: &'a [Node],
    level: Level,
}

impl<U: Upward> Below<'_, U> {
    /// The values of the siblings `first` and `first + 1`; the nodes `first..first + kept.len()` are their subtrees.
    fn find(&self, first: usize, kept: &mut [U::Kept]) -> [U::Value; 2] {
        if kept.len() <= SERIAL {
            return self.level.dispatch(Serial { below: self, first, kept });
        }
        // A pair of children, what is below the left one, what is below the right one.
        let own = &self.nodes[first..first + 2];
        let (pair, below) = kept.split_at_mut(2);
        let (left, right) = (first + 2, own[1].left as usize);
        let left_size = if own[1].is_leaf() { below.len() } else { right - left };
        let (below_left, below_right) = below.split_at_mut(left_size);
        let (left, right) =
            rayon::join(|| self.find_any(left, below_left), || self.find_any(left + left_size, below_right));
        let (kept_left, kept_right) = pair.split_at_mut(1);
        [self.value(&own[0], left, &mut kept_left[0]), self.value(&own[1], right, &mut kept_right[0])]
    }

    /// As [`Below::find`], anything where there are no nodes.
    fn find_any(&self, first: usize, kept: &mut [U::Kept]) -> [U::Value; 2] {
        if kept.is_empty() { Default::default() } else { self.find(first, kept) }
    }

    /// The value of a node whose children, if it has any, have the values `values`.
    #[inline(always)]
    fn value(&self, node: &Node, values: [U::Value; 2], kept: &mut U::Kept) -> U::Value {
        if node.is_leaf() {
            return self.rule.leaf(node, kept);
        }
        let left = node.left as usize;
        let children = [&self.nodes[left], &self.nodes[left + 1]];
        self.rule.inner(node, children, [&values[0], &values[1]], kept)
    }
}

struct Serial<'a, 'b, U: Upward> {
    below: &'a Below<'b, U>,
    first: usize,
    kept: &'a mut [U::Kept],
}

impl<U: Upward> Kernel for Serial<'_, '_, U> {
    type Output = [U::Value; 2];

    #[inline(always)]
    fn run<S: Simd8>(self, _simd: S) -> Self::Output {
        let Self { below, first, kept } = self;
        let mut values = vec![U::Value::default(); kept.len()];
        for (i, kept) in kept.iter_mut().enumerate().rev() {
            let node = &below.nodes[first + i];
            let children = if node.is_leaf() {
                [i, i]
            } else {
                [node.left as usize - first, node.left as usize + 1 - first]
            };
            values[i] = below.value(node, children.map(|c| values[c]), kept);
        }
        [values[0], values[1]]
    }
}
