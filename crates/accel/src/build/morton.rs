//! Trees from Morton codes: Lauterbach, Garland, Sengupta, Luebke, Manocha 2009, "Fast BVH construction on GPUs", by
//! the binary search and work queues of Garanzha, Pantaleoni, McAllister 2011, "Simpler and faster HLBVH with work
//! queues", where this is called `MiddleOnly`.
//!
//! Deviations: codes count cells of the box around the centres, not around the scene. A thread has a queue of its own
//! for each run of at most [`RUN`] primitives, so that the order of the nodes does not depend on the threads; it takes
//! the latest of it first, so that leaves come nearly in the order of the codes. A run that two leaves can hold is parted so
//! that two do, as near as possible to where its codes are: an eighth fewer leaves for the same cost of rays.

use super::codes::Boxes;
use super::pieces::Piece;
use super::{BLANK, BuildConfig};
use crate::reference::{EMPTY_LANES, unpack};
use crate::sort::{Pair, key, parts, payload};
use crate::{Node, Reference};
use rayon::prelude::*;
use std::ops::Range;
use vastlight_simd::{Kernel, Level, Simd8};

/// Longest run whose nodes one thread makes.
const RUN: usize = 1 << 11;

/// What is made of the primitives in a leaf.
pub(crate) trait Leaves: Sync {
    /// Leaves are written to arrays of these.
    type Element: Send;
    /// Elements that the leaves of a subtree take.
    fn room(&self, nodes: &[Node]) -> usize;
    /// Writes a leaf: the primitives `run[node.first..][..node.count]`, to `elements`, which are those of its subtree.
    /// `numbers` are the leaf's among those of the whole tree, and among those of its subtree. Gives the packed box.
    fn fill<S: Simd8>(
        &self,
        simd: S,
        node: &mut Node,
        numbers: [usize; 2],
        run: &[Pair],
        elements: &mut [Self::Element],
    ) -> S::F;
}

/// Leaves as runs of primitive numbers.
pub(super) struct InOrder<'a> {
    pub(super) references: &'a [Reference],
}

impl Leaves for InOrder<'_> {
    type Element = u32;

    fn room(&self, nodes: &[Node]) -> usize {
        nodes.first().map_or(0, |root| root.count as usize)
    }

    #[inline(always)]
    fn fill<S: Simd8>(
        &self,
        simd: S,
        node: &mut Node,
        _: [usize; 2],
        run: &[Pair],
        prims: &mut [u32],
    ) -> S::F {
        let range = node.first as usize..(node.first + node.count) as usize;
        let mut around = simd.load(&EMPTY_LANES);
        for (place, prim) in range.clone().zip(&mut prims[range]) {
            self.references.prefetch(simd, run, place);
            let reference = &self.references[payload(run[place]) as usize];
            around = simd.min(around, simd.load(reference.lanes()));
            *prim = reference.prim();
        }
        around
    }
}

/// The nodes over a run of sorted codes, still without boxes.
pub(super) fn topology(run: &[Pair], config: &BuildConfig) -> Piece {
    let max_leaf = config.max_leaf.max(1) as usize;
    if run.len() <= RUN.max(max_leaf) {
        return Piece::subtree(subtree(run, max_leaf));
    }
    let (left, right) = run.split_at(split(run));
    let (left, right) = rayon::join(|| topology(left, config), || topology(right, config));
    Piece::pair(left, right)
}

/// Where the highest bit that is not the same in all codes of a sorted run becomes 1; the middle where all codes are the
/// same.
#[inline(always)]
pub(super) fn split(run: &[Pair]) -> usize {
    let (first, last) = (key(run[0]), key(run[run.len() - 1]));
    if first == last {
        return run.len() / 2;
    }
    let bit = 1 << (first ^ last).ilog2();
    run.partition_point(|&pair| key(pair) & bit == 0)
}

/// Cuts sorted codes, which start at `first`, into runs of at most `most`, as nodes would be cut.
pub(super) fn runs(sorted: &[Pair], first: usize, most: usize) -> Vec<Range<usize>> {
    if sorted.len() > RUN.max(most) {
        let middle = split(sorted);
        let (left, right) = sorted.split_at(middle);
        let (mut left, mut right) =
            rayon::join(|| runs(left, first, most), || runs(right, first + middle, most));
        left.append(&mut right);
        return left;
    }
    let mut found = Vec::new();
    let mut waiting = vec![(0, sorted.len())];
    while let Some((start, end)) = waiting.pop() {
        if end - start <= most {
            found.push(first + start..first + end);
        } else {
            let middle = start + split(&sorted[start..end]);
            waiting.extend([(middle, end), (start, middle)]);
        }
    }
    found
}

/// The nodes over a run by one thread: pairs of children, then what is below the left one, what is below the right one.
fn subtree(run: &[Pair], max_leaf: usize) -> Vec<Node> {
    let mut nodes = Vec::with_capacity(run.len() / 2 + 1);
    nodes.push(Node { count: run.len() as u32, ..BLANK });
    let mut waiting = vec![0];
    while let Some(slot) = waiting.pop() {
        let Node { first, count, .. } = nodes[slot];
        let length = count as usize;
        if length <= max_leaf {
            continue;
        }
        let run = &run[first as usize..first as usize + length];
        let mut left = split(run);
        if length <= 2 * max_leaf {
            left = left.clamp(length - max_leaf, max_leaf);
        }
        let (next, left) = (nodes.len(), left as u32);
        nodes[slot].left = next as u32;
        nodes.push(Node { first, count: left, ..BLANK });
        nodes.push(Node { first: first + left, count: count - left, ..BLANK });
        waiting.extend([next + 1, next]);
    }
    nodes
}

/// Fills the leaves of `pieces`, which stand over `sorted` one after the other, and finds all boxes.
pub(super) fn fill_leaves<L: Leaves>(
    pieces: &mut [Piece],
    sorted: &[Pair],
    leaves: &L,
    elements: &mut [L::Element],
    level: Level,
) {
    let mut subtrees = Vec::new();
    pieces.iter_mut().for_each(|piece| piece.subtrees(&mut subtrees));
    let rooms = parts(elements, subtrees.iter().map(|nodes| leaves.room(nodes)));
    let (mut rest, mut first_leaf) = (sorted, 0);
    let mut jobs = Vec::with_capacity(subtrees.len());
    for (nodes, elements) in subtrees.into_iter().zip(rooms) {
        let (run, behind) = rest.split_at(nodes[0].count as usize);
        let of_subtree = nodes.len() / 2 + 1;
        jobs.push(Fill { leaves, first_leaf, run, nodes, elements });
        (rest, first_leaf) = (behind, first_leaf + of_subtree);
    }
    jobs.into_par_iter().for_each(|job| level.dispatch(job));
    pieces.par_iter_mut().for_each(Piece::refit);
}

/// Fills the leaves of a subtree, and finds its boxes.
struct Fill<'a, L: Leaves> {
    leaves: &'a L,
    first_leaf: usize,
    run: &'a [Pair],
    nodes: &'a mut [Node],
    elements: &'a mut [L::Element],
}

impl<L: Leaves> Kernel for Fill<'_, L> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd8>(self, simd: S) {
        let Self { leaves, first_leaf, run, nodes, elements } = self;
        for (leaf, node) in nodes.iter_mut().filter(|node| node.is_leaf()).enumerate() {
            let around = leaves.fill(simd, node, [first_leaf + leaf, leaf], run, elements);
            node.bounds = unpack(&simd.to_array(around));
        }
        for node in (0..nodes.len()).rev() {
            if !nodes[node].is_leaf() {
                let left = nodes[node].left as usize;
                nodes[node].bounds = nodes[left].bounds.union(nodes[left + 1].bounds);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sort::pair;

    #[test]
    fn runs_are_split_at_the_highest_bit_that_differs() {
        let run: Vec<Pair> = [0b1000, 0b1001, 0b1001, 0b1010, 0b1111].iter().map(|&k| pair(k, 9)).collect();
        assert_eq!(split(&run), 4);
        assert_eq!(split(&run[..4]), 3);
        assert_eq!(split(&run[..3]), 1);
        assert_eq!(split(&run[1..3]), 1, "equal codes are halved");
        assert_eq!(split(&[pair(5, 0); 9]), 4);
    }

    #[test]
    fn every_primitive_is_in_one_leaf_and_two_leaves_hold_what_two_can() {
        let run: Vec<Pair> = (0..999_u32).map(|i| pair(i * i % 1009 * 1000, i)).collect();
        let mut sorted = run.clone();
        sorted.sort_unstable();
        let nodes = subtree(&sorted, 8);
        let mut leaves: Vec<&Node> = nodes.iter().filter(|n| n.is_leaf()).collect();
        leaves.sort_by_key(|n| n.first);
        assert!(leaves.windows(2).all(|w| w[0].first + w[0].count == w[1].first));
        assert_eq!(
            (leaves[0].first, leaves[leaves.len() - 1].first + leaves[leaves.len() - 1].count),
            (0, 999)
        );
        assert!(leaves.iter().all(|n| (1..=8).contains(&n.count)) && leaves.len() * 2 == nodes.len() + 1);
        let parents = nodes.iter().filter(|n| !n.is_leaf() && n.count <= 16);
        parents
            .for_each(|n| assert!(nodes[n.left as usize].is_leaf() && nodes[n.left as usize + 1].is_leaf()));
    }
}
