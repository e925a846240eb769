//! HLBVH2: Garanzha, Pantaleoni, McAllister 2011, "Simpler and faster HLBVH with work queues"; Garanzha's thesis of 2014,
//! chapter 5.
//!
//! Primitives are sorted once by 30-bit Morton codes. Runs whose codes have the same upper 15 bits become clusters. The
//! tree of each cluster follows from the lower bits ([`super::morton`]); above the clusters stands a tree made with the
//! surface-area heuristic, for which each cluster is one primitive: by grids as published, or by bins, which are exact.
//!
//! Deviation: the grids are those of [`super::grid`], also finer ones where a cell of the top grid holds several clusters.

use super::morton::{CODE_BITS, Emitter, sorted_codes};
use super::pieces::Piece;
use super::{Binned, BuildConfig, Scratch, grid, top_down};
use crate::sort::{Pair, key, parts};
use crate::{BinaryTree, Reference};
use rayon::prelude::*;
use std::ops::Range;

/// Upper bits that a cluster's codes share.
const CLUSTER_BITS: u32 = 15;
/// Pairs that one thread looks at at a time.
const CHUNK: usize = 1 << 14;

/// How the tree over clusters is made.
#[derive(Clone, Copy, Debug)]
pub(super) enum Top {
    Grid,
    Binned,
}

/// Builds a tree.
pub(super) fn build(
    references: &[Reference],
    top: Top,
    config: &BuildConfig,
    scratch: &mut Scratch,
) -> BinaryTree {
    if references.is_empty() {
        return BinaryTree::default();
    }
    let sorted = sorted_codes(references, config.level, scratch);
    let clusters = clusters(sorted);
    let emitter = Emitter::new(references, config);
    let mut in_code_order = bytemuck::zeroed_vec(references.len());
    let places = parts(&mut in_code_order, clusters.iter().map(|run| run.len()));
    let piece = |(run, prims): (&Range<usize>, &mut [u32])| emitter.piece(&sorted[run.clone()], prims);
    let pieces: Vec<Piece> = clusters.par_iter().zip(places).map(piece).collect();
    let top = top_tree(&pieces, top, config);
    let prims = prims(&in_code_order, &clusters, &top);
    BinaryTree { nodes: hang(pieces, &top).assemble(), prims }
}

/// The runs whose codes have the same upper bits.
fn clusters(sorted: &[Pair]) -> Vec<Range<usize>> {
    let cluster = |i: usize| key(sorted[i]) >> (CODE_BITS - CLUSTER_BITS);
    let starts_cluster = |&i: &usize| i == 0 || cluster(i) != cluster(i - 1);
    let starts = |chunk: usize| {
        let range = chunk * CHUNK..((chunk + 1) * CHUNK).min(sorted.len());
        range.filter(starts_cluster).collect::<Vec<usize>>()
    };
    let starts: Vec<Vec<usize>> = (0..sorted.len().div_ceil(CHUNK)).into_par_iter().map(starts).collect();
    let starts = starts.concat();
    let ends = starts.iter().copied().skip(1).chain([sorted.len()]);
    starts.iter().zip(ends).map(|(&start, end)| start..end).collect()
}

/// The tree over clusters, one in each leaf.
fn top_tree(pieces: &[Piece], top: Top, config: &BuildConfig) -> BinaryTree {
    let mut references: Vec<Reference> =
        pieces.iter().zip(0..).map(|(piece, i)| Reference::new(&piece.bounds(), i)).collect();
    let config = BuildConfig { max_leaf: 1, ..*config };
    let mut scratch = Scratch::default();
    match top {
        Top::Grid => grid::build(&references, &config, &mut scratch),
        Top::Binned => top_down::build(&Binned::new(&config), &mut references, &config, &mut scratch),
    }
}

/// The primitives, cluster by cluster in the order of the tree's leaves.
fn prims(in_code_order: &[u32], clusters: &[Range<usize>], top: &BinaryTree) -> Vec<u32> {
    let mut prims = bytemuck::zeroed_vec(in_code_order.len());
    let runs: Vec<&Range<usize>> = top.prims.iter().map(|&cluster| &clusters[cluster as usize]).collect();
    let places = parts(&mut prims, runs.iter().map(|run| run.len()));
    runs.into_par_iter().zip(places).with_min_len(8).for_each(|(run, place)| {
        place.copy_from_slice(&in_code_order[run.clone()]);
    });
    prims
}

/// Hangs the clusters' trees below the leaves of the tree over them.
fn hang(pieces: Vec<Piece>, top: &BinaryTree) -> Piece {
    let mut pieces: Vec<Option<Piece>> = pieces.into_iter().map(Some).collect();
    let mut hung: Vec<Option<Piece>> = top.nodes.iter().map(|_| None).collect();
    for (i, node) in top.nodes.iter().enumerate().rev() {
        let mut take_node = |node: u32| hung[node as usize].take().unwrap_or_default();
        hung[i] = Some(if node.is_leaf() {
            pieces[top.prims[node.first as usize] as usize].take().unwrap_or_default()
        } else {
            let (left, right) = (take_node(node.left), take_node(node.left + 1));
            Piece::pair(left, right)
        });
    }
    hung.first_mut().and_then(Option::take).unwrap_or_default()
}
