//! Binned surface-area heuristic over clusters first, over primitives below.
//!
//! The upper levels of a top-down build read and write every reference once a level, from memory. Bins are far coarser
//! there than primitives are, so clusters of neighbours serve as well: runs of Morton codes ([`super::morton`]), with
//! their exact boxes and numbers of primitives. Where a node has few enough primitives their boxes are fetched into
//! buffers that stay in a cache, and [`super::top_down`] does the rest.

use super::codes::Boxes;
use super::morton::runs;
use super::pieces::Piece;
use super::top_down::{self, MAX_HEURISTIC_DEPTH, Run, bounds_of, scatter};
use super::{Binned, BuildConfig, Heuristic};
use crate::reference::EMPTY_LANES;
use crate::sort::{Pair, payload};
use crate::{BinaryTree, Reference};
use rayon::prelude::*;
use std::ops::Range;
use vastlight_simd::{Kernel, Simd8};

/// Most primitives in a cluster.
const CLUSTER: usize = 32;

/// Nodes with at most so many primitives are built from them alone.
const SUBTREE: usize = 1 << 13;
/// Nodes of fewer clusters too, since bins cannot part them well.
const FEWEST: usize = 64;

/// Builds a tree over at least one box; `sorted` are their codes.
pub(crate) fn build<B: Boxes + ?Sized>(boxes: &B, sorted: &[Pair], config: &BuildConfig) -> BinaryTree {
    let runs = runs(sorted, 0, CLUSTER);
    let cluster = |(number, run): (usize, &Range<usize>)| {
        let lanes = config.level.dispatch(Around { boxes, sorted, run: run.clone() });
        Reference::to_cluster(lanes, number as u32, run.len() as u32)
    };
    let mut clusters: Vec<Reference> = runs.par_iter().enumerate().with_min_len(64).map(cluster).collect();
    let mut other = clusters.clone();
    let mut prims = bytemuck::zeroed_vec(sorted.len());
    let builder = Builder { boxes, sorted, runs: &runs, binned: Binned::new(config), config };
    let run = Run { here: &mut clusters, there: &mut other, prims: &mut prims, depth: 0 };
    BinaryTree { nodes: builder.piece(run).assemble(), prims }
}

/// The packed box around a run.
struct Around<'a, B: ?Sized> {
    boxes: &'a B,
    sorted: &'a [Pair],
    run: Range<usize>,
}

impl<B: Boxes + ?Sized> Kernel for Around<'_, B> {
    type Output = [f32; 8];

    #[inline(always)]
    fn run<S: Simd8>(self, simd: S) -> [f32; 8] {
        let mut around = simd.load(&EMPTY_LANES);
        for place in self.run {
            self.boxes.prefetch(simd, self.sorted, place);
            let reference = self.boxes.one(payload(self.sorted[place]));
            around = simd.min(around, simd.load(reference.lanes()));
        }
        simd.to_array(around)
    }
}

struct Builder<'a, B: ?Sized> {
    boxes: &'a B,
    sorted: &'a [Pair],
    runs: &'a [Range<usize>],
    binned: Binned,
    config: &'a BuildConfig,
}

impl<B: Boxes + ?Sized> Builder<'_, B> {
    /// The tree over the primitives of a run of clusters.
    fn piece(&self, run: Run<'_>) -> Piece {
        let Run { here, there, prims, depth } = run;
        if prims.len() <= SUBTREE || here.len() < FEWEST || depth >= MAX_HEURISTIC_DEPTH {
            return self.subtree(here, prims, depth);
        }
        let Some((left, left_prims)) = self.config.level.dispatch(Divide { builder: self, here, there })
        else {
            return self.subtree(here, prims, depth);
        };
        let (here, there) = (there.split_at_mut(left), here.split_at_mut(left));
        let (prims, depth) = (prims.split_at_mut(left_prims), depth + 1);
        let (left, right) = rayon::join(
            || self.piece(Run { here: here.0, there: there.0, prims: prims.0, depth }),
            || self.piece(Run { here: here.1, there: there.1, prims: prims.1, depth }),
        );
        Piece::pair(left, right)
    }

    /// The tree over the primitives of clusters, from their own boxes.
    fn subtree(&self, clusters: &[Reference], prims: &mut [u32], depth: u32) -> Piece {
        let mut here = self.config.level.dispatch(Fetch { builder: self, clusters, count: prims.len() });
        let mut there = here.clone();
        let run = Run { here: &mut here, there: &mut there, prims, depth };
        top_down::piece(&self.binned, self.config, run)
    }
}

/// Fetches the references of clusters.
struct Fetch<'a, 'b, B: ?Sized> {
    builder: &'a Builder<'b, B>,
    clusters: &'a [Reference],
    count: usize,
}

impl<B: Boxes + ?Sized> Kernel for Fetch<'_, '_, B> {
    type Output = Vec<Reference>;

    #[inline(always)]
    fn run<S: Simd8>(self, simd: S) -> Vec<Reference> {
        let Builder { boxes, sorted, runs, .. } = self.builder;
        let mut references = Vec::with_capacity(self.count);
        for cluster in self.clusters {
            for place in runs[cluster.prim() as usize].clone() {
                boxes.prefetch(simd, sorted, place);
                references.push(boxes.one(payload(sorted[place])));
            }
        }
        references
    }
}

/// Parts clusters in two by bins, from one buffer to the other; gives the number of clusters on the left and that of
/// their primitives, none where they cannot be parted.
struct Divide<'a, 'b, B: ?Sized> {
    builder: &'a Builder<'b, B>,
    here: &'a [Reference],
    there: &'a mut [Reference],
}

impl<B: Boxes + ?Sized> Kernel for Divide<'_, '_, B> {
    type Output = Option<(usize, usize)>;

    #[inline(always)]
    fn run<S: Simd8>(self, simd: S) -> Option<(usize, usize)> {
        let Self { builder, here, there } = self;
        let bounds = bounds_of(simd, here);
        let figures = builder.binned.gather(simd, here, &bounds, here.len());
        let (split, _) = builder.binned.try_split(simd, &figures, &bounds, here.len())?;
        let left = scatter(here, there, |r| builder.binned.goes_left(&split, r));
        let prims = there[..left].iter().map(|r| r.weight() as usize).sum();
        (left > 0 && left < here.len()).then_some((left, prims))
    }
}
