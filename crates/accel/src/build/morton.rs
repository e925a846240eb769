//! Trees from Morton codes: Lauterbach, Garland, Sengupta, Luebke, Manocha 2009, "Fast BVH construction on GPUs", by
//! the binary search and work queues of Garanzha, Pantaleoni, McAllister 2011, "Simpler and faster HLBVH with work
//! queues", where this is called `MiddleOnly`.
//!
//! Deviations: codes count cells of the box around the centres, not around the scene. A thread has a queue of its own
//! for each run of at most [`RUN`] primitives, so that the order of the nodes does not depend on the threads.

use super::pieces::Piece;
use super::{BLANK, BuildConfig, RunBounds, Scratch};
use crate::reference::{EMPTY_LANES, unpack};
use crate::sort::{Pair, key, pair, payload, radix_sort};
use crate::{BinaryTree, Node, Reference};
use rayon::prelude::*;
use vastlight_simd::{Kernel, Level, Simd8};

/// Bits of a code along one axis.
const AXIS_BITS: u32 = 10;
/// Bits of a code.
pub(super) const CODE_BITS: u32 = 3 * AXIS_BITS;
/// Longest run whose nodes one thread makes from one queue.
const RUN: usize = 1 << 11;
/// How many places ahead the caches are asked for references.
const AHEAD: usize = 24;
/// References that one thread looks at at a time.
const CHUNK: usize = 1 << 13;

/// Builds a tree from all bits of the codes.
pub(super) fn build(references: &[Reference], config: &BuildConfig, scratch: &mut Scratch) -> BinaryTree {
    if references.is_empty() {
        return BinaryTree::default();
    }
    let sorted = sorted_codes(references, config.level, scratch);
    let mut prims = bytemuck::zeroed_vec(references.len());
    let nodes = Emitter::new(references, config).piece(sorted, &mut prims).assemble();
    BinaryTree { nodes, prims }
}

/// The references' Morton codes with their places in `references`, sorted.
pub(super) fn sorted_codes<'a>(
    references: &[Reference],
    level: Level,
    scratch: &'a mut Scratch,
) -> &'a [Pair] {
    let bounds = super::top_down::bounds(references, level);
    let grid = Grid::new(&bounds);
    let (pairs, spare) = scratch.pairs(references.len());
    pairs.par_chunks_mut(CHUNK).zip(references.par_chunks(CHUNK)).enumerate().for_each(
        |(i, (pairs, part))| {
            level.dispatch(Codes { grid: &grid, references: part, first: (i * CHUNK) as u32, pairs });
        },
    );
    radix_sort(pairs, spare, CODE_BITS)
}

/// Maps centres to cells.
struct Grid {
    start: [f32; 8],
    scale: [f32; 8],
}

impl Grid {
    fn new(bounds: &RunBounds) -> Self {
        let (mut start, mut scale) = ([0.0; 8], [0.0; 8]);
        for axis in 0..3 {
            let (lower, upper) = (bounds.centers[axis], -bounds.centers[axis + 4]);
            let cells = (1 << AXIS_BITS) as f32 / (upper - lower);
            start[axis] = lower;
            scale[axis] = if cells.is_finite() { cells } else { 0.0 };
        }
        Self { start, scale }
    }
}

/// Writes the codes of some references.
struct Codes<'a> {
    grid: &'a Grid,
    references: &'a [Reference],
    first: u32,
    pairs: &'a mut [Pair],
}

impl Kernel for Codes<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd8>(self, simd: S) {
        let (start, scale) = (simd.load(&self.grid.start), simd.load(&self.grid.scale));
        let last = simd.splat(((1 << AXIS_BITS) - 1) as f32);
        for ((reference, pair_out), index) in self.references.iter().zip(self.pairs).zip(self.first..) {
            let lanes = simd.load(reference.lanes());
            let center = simd.sub(lanes, simd.swap_halves(lanes));
            let cell = simd.min(simd.mul(simd.sub(center, start), scale), last);
            let cell = simd.to_array(cell);
            *pair_out = pair(interleave([cell[0], cell[1], cell[2]]), index);
        }
    }
}

/// The Morton code of a cell, x highest; coordinates are cut down to integers.
#[inline(always)]
fn interleave(cell: [f32; 3]) -> u32 {
    // Adding 2^23 leaves the nearest integer in the low bits of the mantissa; half a cell less makes it the one below.
    let spread = |x: f32| {
        let mut x = (x - 0.499 + 8_388_608.0).max(8_388_608.0).to_bits() & ((1 << AXIS_BITS) - 1);
        x = (x | x << 16) & 0x0300_00ff;
        x = (x | x << 8) & 0x0300_f00f;
        x = (x | x << 4) & 0x030c_30c3;
        (x | x << 2) & 0x0924_9249
    };
    spread(cell[0]) << 2 | spread(cell[1]) << 1 | spread(cell[2])
}

/// Makes nodes over runs of sorted codes.
pub(super) struct Emitter<'a> {
    references: &'a [Reference],
    level: Level,
    max_leaf: usize,
}

impl<'a> Emitter<'a> {
    pub(super) fn new(references: &'a [Reference], config: &BuildConfig) -> Self {
        Self { references, level: config.level, max_leaf: config.max_leaf.max(1) as usize }
    }

    /// The tree over a run, and its primitives.
    pub(super) fn piece(&self, run: &[Pair], prims: &mut [u32]) -> Piece {
        if run.len() <= RUN.max(self.max_leaf) {
            return Piece::subtree(self.level.dispatch(Subtree { emitter: self, run, prims }));
        }
        let middle = split(run);
        let (left, right) = run.split_at(middle);
        let (left_prims, right_prims) = prims.split_at_mut(middle);
        let (left, right) = rayon::join(|| self.piece(left, left_prims), || self.piece(right, right_prims));
        Piece::pair(left, right)
    }
}

/// Where the highest bit that is not the same in all codes of a sorted run becomes 1; the middle where all codes are the
/// same.
#[inline(always)]
fn split(run: &[Pair]) -> usize {
    let (first, last) = (key(run[0]), key(run[run.len() - 1]));
    if first == last {
        return run.len() / 2;
    }
    let bit = 1 << (first ^ last).ilog2();
    run.partition_point(|&pair| key(pair) & bit == 0)
}

/// Makes the nodes of a run, level by level.
struct Subtree<'a, 'b> {
    emitter: &'a Emitter<'b>,
    run: &'a [Pair],
    prims: &'a mut [u32],
}

impl Kernel for Subtree<'_, '_> {
    type Output = Vec<Node>;

    #[inline(always)]
    fn run<S: Simd8>(self, simd: S) -> Vec<Node> {
        let Self { emitter, run, prims } = self;
        // The nodes are the queue of their own splits.
        let mut nodes = Vec::with_capacity(run.len() / 2 + 1);
        nodes.push(Node { count: run.len() as u32, ..BLANK });
        let mut next = 0;
        while let Some(&Node { first, count, .. }) = nodes.get(next) {
            let range = first as usize..(first + count) as usize;
            if range.len() > emitter.max_leaf {
                let left = split(&run[range]) as u32;
                nodes[next].left = nodes.len() as u32;
                nodes.push(Node { first, count: left, ..BLANK });
                nodes.push(Node { first: first + left, count: count - left, ..BLANK });
            } else {
                let mut around = simd.load(&EMPTY_LANES);
                // The next leaves come soon, and what they refer to stands anywhere.
                let ahead = (range.end + AHEAD).min(run.len());
                for &pair in &run[ahead..(ahead + range.len()).min(run.len())] {
                    if let Some(reference) = emitter.references.get(payload(pair) as usize) {
                        simd.prefetch::<1>(std::ptr::from_ref(reference).cast());
                    }
                }
                for (prim, &pair) in prims[range.clone()].iter_mut().zip(&run[range]) {
                    let reference = &emitter.references[payload(pair) as usize];
                    around = simd.min(around, simd.load(reference.lanes()));
                    *prim = reference.prim();
                }
                nodes[next].bounds = unpack(&simd.to_array(around));
            }
            next += 1;
        }
        for node in (0..nodes.len()).rev() {
            if !nodes[node].is_leaf() {
                let left = nodes[node].left as usize;
                nodes[node].bounds = nodes[left].bounds.union(nodes[left + 1].bounds);
            }
        }
        nodes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_interleave_bits_x_first() {
        assert_eq!(interleave([0.0; 3]), 0);
        assert_eq!(interleave([1023.0; 3]), (1 << 30) - 1);
        assert_eq!(interleave([0.9, 0.0, 0.99]), 0);
        for bit in 0..AXIS_BITS {
            let x = (1 << bit) as f32;
            assert_eq!(interleave([x, 0.0, 0.0]), 4 << (3 * bit));
            assert_eq!(interleave([0.0, x, 0.0]), 2 << (3 * bit));
            assert_eq!(interleave([0.0, 0.0, x]), 1 << (3 * bit));
        }
        assert_eq!(interleave([f32::NAN, -1.0, 0.0]) & 0x4924_9249, 0);
    }

    #[test]
    fn runs_are_split_at_the_highest_bit_that_differs() {
        let run: Vec<Pair> = [0b1000, 0b1001, 0b1001, 0b1010, 0b1111].iter().map(|&k| pair(k, 9)).collect();
        assert_eq!(split(&run), 4);
        assert_eq!(split(&run[..4]), 3);
        assert_eq!(split(&run[..3]), 1);
        assert_eq!(split(&run[1..3]), 1, "equal codes are halved");
        assert_eq!(split(&[pair(5, 0); 9]), 4);
    }
}
