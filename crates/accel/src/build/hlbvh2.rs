//! HLBVH2: Garanzha, Pantaleoni, McAllister 2011, "Simpler and faster HLBVH with work queues"; Garanzha's thesis of 2014,
//! chapter 5.
//!
//! Primitives are sorted once by 30-bit Morton codes. Runs whose codes have the same upper 15 bits become clusters. The
//! tree of each cluster follows from the lower bits ([`super::morton`]); above the clusters stands a tree made with the
//! surface-area heuristic, for which each cluster is one primitive: by grids as published, or by bins, which are exact.
//!
//! Deviation: the grids are those of [`super::grid`], also finer ones where a cell of the top grid holds several clusters.

use super::codes::{CODE_BITS, sorted_codes};
use super::morton::{InOrder, Leaves, fill_leaves, topology};
use super::pieces::Piece;
use super::{Binned, BuildConfig, Scratch, grid, top_down};
use crate::sort::{Pair, key, parts};
use crate::{BinaryTree, Node, Reference};
use rayon::prelude::*;
use std::ops::Range;
use vastlight_simd::Level;

/// Upper bits that a cluster's codes share.
const CLUSTER_BITS: u32 = 15;
/// Pairs that one thread looks at at a time.
const CHUNK: usize = 1 << 14;

/// Trees that follow from sorted codes.
#[derive(Clone, Copy, Debug)]
pub(crate) enum MortonTree {
    /// All nodes from codes.
    Whole,
    /// Clusters from codes, grids above.
    UnderGrid,
    /// Clusters from codes, bins above.
    UnderBins,
}

impl MortonTree {
    /// The tree that the builder `name` makes, if it makes one from codes.
    pub(crate) fn of_builder(name: &str) -> Option<Self> {
        match name {
            "morton" => Some(Self::Whole),
            "hlbvh2" => Some(Self::UnderGrid),
            "hlbvh2-binned" => Some(Self::UnderBins),
            _ => None,
        }
    }

    /// The nodes of all clusters over sorted codes, of which there is at least one.
    pub(crate) fn forest(self, sorted: &[Pair], config: &BuildConfig) -> Forest {
        let cluster_bits = match self {
            Self::Whole => 0,
            Self::UnderGrid | Self::UnderBins => CLUSTER_BITS,
        };
        let clusters = clusters(sorted, cluster_bits);
        let pieces = clusters.par_iter().map(|run| topology(&sorted[run.clone()], config)).collect();
        Forest { kind: self, clusters, pieces }
    }
}

/// Trees of clusters that stand in the order of their codes.
pub(crate) struct Forest {
    kind: MortonTree,
    clusters: Vec<Range<usize>>,
    pieces: Vec<Piece>,
}

impl Forest {
    /// Leaves of all trees.
    pub(crate) fn leaves(&self) -> usize {
        self.pieces.iter().map(|piece| piece.nodes().div_ceil(2)).sum()
    }

    /// Nodes, with those above the clusters.
    pub(crate) fn nodes(&self) -> usize {
        2 * self.leaves() - 1
    }

    /// Fills the leaves and finds the boxes of all nodes.
    pub(crate) fn fill<L: Leaves>(
        &mut self,
        sorted: &[Pair],
        leaves: &L,
        elements: &mut [L::Element],
        level: Level,
    ) {
        fill_leaves(&mut self.pieces, sorted, leaves, elements, level);
    }

    /// Writes all nodes of the finished tree to `nodes`; leaves keep their `first` unless it is to count primitives
    /// (`runs`). Gives the tree over clusters.
    pub(crate) fn join(self, config: &BuildConfig, nodes: &mut [Node], runs: bool) -> BinaryTree {
        let top = top_tree(&self.pieces, self.kind, config);
        hang(self.pieces, &top).assemble_into(nodes, runs);
        top
    }
}

/// Builds a tree.
pub(super) fn build(
    references: &[Reference],
    kind: MortonTree,
    config: &BuildConfig,
    scratch: &mut Scratch,
) -> BinaryTree {
    if references.is_empty() {
        return BinaryTree::default();
    }
    let sorted = sorted_codes(references, config.level, scratch);
    let mut forest = kind.forest(sorted, config);
    let mut in_code_order = bytemuck::zeroed_vec(references.len());
    forest.fill(sorted, &InOrder { references }, &mut in_code_order, config.level);
    let mut nodes = bytemuck::zeroed_vec(forest.nodes());
    let clusters = forest.clusters.clone();
    let top = forest.join(config, &mut nodes, true);
    BinaryTree { nodes, prims: prims(&in_code_order, &clusters, &top) }
}

/// The runs whose codes have the same upper bits.
fn clusters(sorted: &[Pair], cluster_bits: u32) -> Vec<Range<usize>> {
    let cluster = |i: usize| key(sorted[i]) >> (CODE_BITS - cluster_bits);
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
fn top_tree(pieces: &[Piece], kind: MortonTree, config: &BuildConfig) -> BinaryTree {
    let mut references: Vec<Reference> =
        pieces.iter().zip(0..).map(|(piece, i)| Reference::new(&piece.bounds(), i)).collect();
    let config = BuildConfig { max_leaf: 1, ..*config };
    let mut scratch = Scratch::default();
    match kind {
        MortonTree::UnderGrid => grid::build(&references, &config, &mut scratch),
        MortonTree::Whole | MortonTree::UnderBins => {
            top_down::build(&Binned::new(&config), &mut references, &config, &mut scratch)
        }
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
