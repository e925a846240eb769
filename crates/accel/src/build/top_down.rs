//! The loop of top-down builders: bounds, try to split, partition, go on with both parts.
//!
//! Large runs are worked on by all threads, small ones are whole tasks of one thread. References move between two
//! buffers, so that partitioning needs no branches: each is written to the next free slot of both sides, and one of
//! them moves on. Chunks have a fixed size and merging is exact, so the tree does not depend on the threads.

use super::pieces::Piece;
use super::{BLANK, BuildConfig, FEW, Heuristic, RunBounds, Scratch};
use crate::reference::{EMPTY_LANES, packed_half_area, unpack};
use crate::{BinaryTree, Node, Reference};
use rayon::prelude::*;
use vastlight_simd::{Kernel, Level, Simd8};

/// Runs up to this long are built by one thread.
const SERIAL: usize = 1 << 13;
/// References that one thread looks at at a time in longer runs.
const CHUNK: usize = 1 << 13;
/// Runs deeper than this are halved without looking, which bounds the depth of the tree.
pub(super) const MAX_HEURISTIC_DEPTH: u32 = 64;

/// Boxes are small beside the box around them if their areas add up to less than so much of its area.
const SPARSE: f32 = 0.5;

/// Builds a tree with `heuristic`.
pub(super) fn build<H: Heuristic>(
    heuristic: &H,
    references: &mut [Reference],
    config: &BuildConfig,
    scratch: &mut Scratch,
) -> BinaryTree {
    if references.is_empty() {
        return BinaryTree::default();
    }
    let mut prims = vec![0; references.len()];
    let other = &mut scratch.other;
    if other.len() < references.len() {
        other.clear();
        other.par_extend(references.par_iter());
    }
    let run = Run { here: references, there: &mut other[..prims.len()], prims: &mut prims, depth: 0 };
    let piece = piece(heuristic, config, run);
    BinaryTree { nodes: piece.assemble(), prims }
}

/// Builds the tree over a run.
pub(super) fn piece<H: Heuristic>(heuristic: &H, config: &BuildConfig, run: Run<'_>) -> Piece {
    Builder { heuristic, level: config.level, max_leaf: config.max_leaf.max(1) as usize }.piece(run)
}

/// Boxes around many references, by all threads.
pub(super) fn bounds(references: &[Reference], level: Level) -> RunBounds {
    let empty = RunBounds { boxes: EMPTY_LANES, centers: EMPTY_LANES };
    references
        .par_chunks(CHUNK)
        .map(|chunk| level.dispatch(Bounds(chunk)))
        .reduce(|| empty, |a, b| level.dispatch(Unite(a, b)))
}

struct Builder<'a, H> {
    heuristic: &'a H,
    level: Level,
    max_leaf: usize,
}

/// A run of references, room of the same size, and the place of its numbers in the finished order.
pub(super) struct Run<'a> {
    pub(super) here: &'a mut [Reference],
    pub(super) there: &'a mut [Reference],
    pub(super) prims: &'a mut [u32],
    pub(super) depth: u32,
}

impl<H: Heuristic> Builder<'_, H> {
    fn piece(&self, run: Run<'_>) -> Piece {
        if run.here.len() <= SERIAL {
            return Piece::subtree(self.level.dispatch(Subtree { builder: self, run }));
        }
        let bounds = bounds(run.here, self.level);
        let count = run.here.len();
        let split = if run.depth < MAX_HEURISTIC_DEPTH { self.split(run.here, &bounds) } else { None };
        let left = split.map_or(0, |split| self.partition(&split, run.here, run.there));
        // Where nothing moved the run is halved in place.
        let (here, there, left) = match left {
            0 => (run.here, run.there, count / 2),
            left => (run.there, run.here, left),
        };
        let (here, there) = (here.split_at_mut(left), there.split_at_mut(left));
        let (prims, depth) = (run.prims.split_at_mut(left), run.depth + 1);
        let (left, right) = rayon::join(
            || self.piece(Run { here: here.0, there: there.0, prims: prims.0, depth }),
            || self.piece(Run { here: here.1, there: there.1, prims: prims.1, depth }),
        );
        Piece::pair(left, right)
    }

    fn split(&self, references: &[Reference], run: &RunBounds) -> Option<H::Split> {
        let count = references.len();
        let gather = |part| Gather { heuristic: self.heuristic, part, run, count };
        let figures = references
            .par_chunks(CHUNK)
            .map(|chunk| self.level.dispatch(gather(chunk)))
            .reduce_with(|a, b| self.level.dispatch(Merge { heuristic: self.heuristic, a, b }))?;
        self.level.dispatch(TrySplit { heuristic: self.heuristic, figures, run, count })
    }

    /// Copies `from` to `to` in two groups, each in its old order; gives the size of the left one. Copies nothing where
    /// one side would be empty, and gives 0.
    fn partition(&self, split: &H::Split, from: &[Reference], to: &mut [Reference]) -> usize {
        let left = |r: &Reference| self.heuristic.goes_left(split, r);
        let lefts: Vec<usize> =
            from.par_chunks(CHUNK).map(|c| c.iter().filter(|r| left(r)).count()).collect();
        let total: usize = lefts.iter().sum();
        if total == 0 || total == from.len() {
            return 0;
        }
        let (mut to_left, mut to_right) = to.split_at_mut(total);
        let mut jobs = Vec::with_capacity(lefts.len());
        for (chunk, &count) in from.chunks(CHUNK).zip(&lefts) {
            let (own_left, rest_left) = to_left.split_at_mut(count);
            let (own_right, rest_right) = to_right.split_at_mut(chunk.len() - count);
            jobs.push((chunk, own_left, own_right));
            (to_left, to_right) = (rest_left, rest_right);
        }
        jobs.into_par_iter().for_each(|(chunk, own_left, own_right)| {
            let (mut next_left, mut next_right) = (own_left.iter_mut(), own_right.iter_mut());
            for reference in chunk {
                let next = if left(reference) { next_left.next() } else { next_right.next() };
                if let Some(slot) = next {
                    *slot = *reference;
                }
            }
        });
        total
    }
}

#[inline(always)]
pub(super) fn bounds_of<S: Simd8>(simd: S, references: &[Reference]) -> RunBounds {
    let mut boxes = simd.load(&EMPTY_LANES);
    let mut centers = boxes;
    for reference in references {
        let lanes = simd.load(reference.lanes());
        boxes = simd.min(boxes, lanes);
        centers = simd.min(centers, simd.sub(lanes, simd.swap_halves(lanes)));
    }
    RunBounds { boxes: simd.to_array(boxes), centers: simd.to_array(centers) }
}

struct Bounds<'a>(&'a [Reference]);

impl Kernel for Bounds<'_> {
    type Output = RunBounds;

    #[inline(always)]
    fn run<S: Simd8>(self, simd: S) -> RunBounds {
        bounds_of(simd, self.0)
    }
}

struct Unite(RunBounds, RunBounds);

impl Kernel for Unite {
    type Output = RunBounds;

    #[inline(always)]
    fn run<S: Simd8>(self, simd: S) -> RunBounds {
        RunBounds {
            boxes: unite(simd, &self.0.boxes, &self.1.boxes),
            centers: unite(simd, &self.0.centers, &self.1.centers),
        }
    }
}

#[inline(always)]
pub(super) fn unite<S: Simd8>(simd: S, a: &[f32; 8], b: &[f32; 8]) -> [f32; 8] {
    simd.to_array(simd.min(simd.load(a), simd.load(b)))
}

struct Gather<'a, H> {
    heuristic: &'a H,
    part: &'a [Reference],
    run: &'a RunBounds,
    count: usize,
}

impl<H: Heuristic> Kernel for Gather<'_, H> {
    type Output = H::Figures;

    #[inline(always)]
    fn run<S: Simd8>(self, simd: S) -> H::Figures {
        self.heuristic.gather(simd, self.part, self.run, self.count)
    }
}

struct Merge<'a, H: Heuristic> {
    heuristic: &'a H,
    a: H::Figures,
    b: H::Figures,
}

impl<H: Heuristic> Kernel for Merge<'_, H> {
    type Output = H::Figures;

    #[inline(always)]
    fn run<S: Simd8>(self, simd: S) -> H::Figures {
        self.heuristic.merge(simd, self.a, &self.b)
    }
}

struct TrySplit<'a, H: Heuristic> {
    heuristic: &'a H,
    figures: H::Figures,
    run: &'a RunBounds,
    count: usize,
}

impl<H: Heuristic> Kernel for TrySplit<'_, H> {
    type Output = Option<H::Split>;

    #[inline(always)]
    fn run<S: Simd8>(self, simd: S) -> Option<H::Split> {
        self.heuristic.try_split(simd, &self.figures, self.run, self.count).map(|(split, _)| split)
    }
}

/// Builds a whole subtree on one thread.
struct Subtree<'a, 'b, H> {
    builder: &'a Builder<'b, H>,
    run: Run<'a>,
}

/// A node of a subtree that is not split yet; its references stand in the first buffer or in the second.
struct Task {
    slot: usize,
    first: usize,
    count: usize,
    depth: u32,
    swapped: bool,
}

impl<H: Heuristic> Kernel for Subtree<'_, '_, H> {
    type Output = Vec<Node>;

    #[inline(always)]
    fn run<S: Simd8>(self, simd: S) -> Vec<Node> {
        let Self { builder, run } = self;
        let mut nodes = Vec::with_capacity(run.here.len());
        nodes.push(BLANK);
        let mut tasks =
            vec![Task { slot: 0, first: 0, count: run.here.len(), depth: run.depth, swapped: false }];
        while let Some(task) = tasks.pop() {
            let range = task.first..task.first + task.count;
            let (here, there) = (&mut run.here[range.clone()], &mut run.there[range.clone()]);
            let (here, there) = if task.swapped { (there, here) } else { (here, there) };
            let bounds = bounds_of(simd, here);
            let left = builder.divide(simd, here, there, &bounds, task.depth);
            let node = &mut nodes[task.slot];
            *node = Node {
                bounds: unpack(&bounds.boxes),
                left: 0,
                first: task.first as u32,
                count: task.count as u32,
            };
            let Division::Parts { left, moved } = left else {
                for (prim, reference) in run.prims[range].iter_mut().zip(here) {
                    *prim = reference.prim();
                }
                continue;
            };
            let slot = nodes.len();
            nodes[task.slot].left = slot as u32;
            nodes.extend([BLANK; 2]);
            let (depth, swapped) = (task.depth + 1, task.swapped != moved);
            let right =
                Task { slot: slot + 1, first: task.first + left, count: task.count - left, depth, swapped };
            tasks.push(right);
            tasks.push(Task { slot, first: task.first, count: left, depth, swapped });
        }
        nodes
    }
}

/// Whether the boxes of a run are small beside the box around them, so that it may pay to part them where one leaf can hold
/// them all.
#[inline(always)]
fn is_sparse(references: &[Reference], bounds: &RunBounds) -> bool {
    let areas: f32 = references.iter().map(|r| packed_half_area(r.lanes())).sum();
    areas < SPARSE * packed_half_area(&bounds.boxes)
}

/// What becomes of a run.
enum Division {
    Leaf,
    /// The first `left` references are the left part; `moved` to the other buffer or halved in place.
    Parts {
        left: usize,
        moved: bool,
    },
}

impl<H: Heuristic> Builder<'_, H> {
    #[inline(always)]
    fn divide<S: Simd8>(
        &self,
        simd: S,
        here: &[Reference],
        there: &mut [Reference],
        bounds: &RunBounds,
        depth: u32,
    ) -> Division {
        let count = here.len();
        if count == 1 {
            return Division::Leaf;
        }
        let may_be_leaf = count <= self.max_leaf;
        if depth >= MAX_HEURISTIC_DEPTH {
            return if may_be_leaf {
                Division::Leaf
            } else {
                Division::Parts { left: count / 2, moved: false }
            };
        }
        if may_be_leaf && !is_sparse(here, bounds) {
            return Division::Leaf;
        }
        let found = if count <= FEW {
            self.heuristic.part_few(simd, here, there, bounds)
        } else {
            let figures = self.heuristic.gather(simd, here, bounds, count);
            let split = self.heuristic.try_split(simd, &figures, bounds, count);
            split.map(|(split, cost)| (scatter(here, there, |r| self.heuristic.goes_left(&split, r)), cost))
        };
        match found {
            Some((_, cost)) if may_be_leaf && cost >= self.heuristic.leaf_cost(bounds, count) => {
                Division::Leaf
            }
            Some((left, _)) if left == 0 || left == count => Division::Parts { left: count / 2, moved: true },
            Some((left, _)) => Division::Parts { left, moved: true },
            None if may_be_leaf => Division::Leaf,
            None => Division::Parts { left: count / 2, moved: false },
        }
    }
}

/// Copies `from` to `to`: left ones from the front, right ones from the back. Gives the number of left ones.
#[inline(always)]
pub(super) fn scatter(
    from: &[Reference],
    to: &mut [Reference],
    goes_left: impl Fn(&Reference) -> bool,
) -> usize {
    let (mut front, mut back) = (0, to.len());
    for reference in from {
        let left = goes_left(reference);
        to[front] = *reference;
        to[back - 1] = *reference;
        front += usize::from(left);
        back -= usize::from(!left);
    }
    front
}
