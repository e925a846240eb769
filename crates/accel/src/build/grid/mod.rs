//! Grid SAH: Garanzha, Premoze, Bely, Galaktionov 2011, "Grid-based SAH BVH construction on a GPU"; Garanzha's thesis
//! of 2014, chapter 4.
//!
//! References are distributed once, by the cells of a grid of 1024^3 that hold their centres. All sums of the
//! surface-area heuristic come from counts of references in cells: a task is a node with a box of at most 8^3 cells of
//! one level of detail, and where the box gets smaller than half of that, a finer level is taken.
//!
//! Deviations:
//! - The grid is laid around the centres, not around the scene.
//! - A block of `BottomGrid` is kept as the list of its references: a dense one would be 97 % empty. Below the levels of
//!   `TopGrid`, and for small tasks, a task bins its own list, which it parts for its children.
//! - A thread has a queue of its own for each task of at most [`RUN`] references, so that the order of the nodes does
//!   not depend on the threads.
//! - Where a single cell of the finest level holds more references than a leaf may, they get a grid of their own, and
//!   are split trivially only if their centres coincide.

mod bins;
mod cells;
mod subtree;

use super::pieces::Piece;
use super::{BuildConfig, Scratch};
use crate::sort::{key, payload, radix_sort};
use crate::{BinaryTree, Reference};
use bins::Bins;
use cells::{COARSEST, Entry, Lattice, Region, TOP, TopGrid, entry};
use rayon::prelude::*;
use subtree::Subtree;
use vastlight_simd::{Kernel, Level, Simd8};

/// Most references of a task that one thread works on.
const RUN: usize = 1 << 12;
/// References that one thread looks at at a time.
const CHUNK: usize = 1 << 13;

/// Builds a tree.
pub(super) fn build(references: &[Reference], config: &BuildConfig, scratch: &mut Scratch) -> BinaryTree {
    if references.is_empty() {
        return BinaryTree::default();
    }
    let lattice = Lattice::new(&super::top_down::bounds(references, config.level));
    let (pairs, spare) = scratch.pairs(references.len());
    pairs.par_chunks_mut(CHUNK).zip(references.par_chunks(CHUNK)).enumerate().for_each(
        |(i, (pairs, part))| {
            let first = (i * CHUNK) as u32;
            pairs.iter_mut().zip(part).zip(first..).for_each(|((pair, reference), index)| {
                *pair = crate::sort::pair(cells::key(lattice.cell(reference)), index);
            });
        },
    );
    let sorted = radix_sort(pairs, spare, cells::KEY_BITS);
    let grid = TopGrid::new(sorted);
    let builder = Builder {
        references,
        sorted,
        grid,
        lattice,
        level: config.level,
        max_leaf: config.max_leaf.max(1) as usize,
    };
    let mut prims = bytemuck::zeroed_vec(references.len());
    let whole = Region { level: COARSEST, min: [0; 3], max: [8; 3] };
    let nodes = builder.piece(whole, &mut prims, 0).assemble();
    BinaryTree { nodes, prims }
}

/// What all tasks share.
struct Builder<'a> {
    references: &'a [Reference],
    sorted: &'a [crate::sort::Pair],
    grid: TopGrid,
    lattice: Lattice,
    level: Level,
    max_leaf: usize,
}

impl Builder<'_> {
    /// The tree over the references in a region, as many as `prims` has room for.
    fn piece(&self, region: Region, prims: &mut [u32], depth: u32) -> Piece {
        let split =
            if prims.len() > RUN { self.level.dispatch(Divide { builder: self, region }) } else { None };
        let Some([(left, count), (right, _)]) = split else {
            return Piece::subtree(self.level.dispatch(Subtree { builder: self, region, prims, depth }));
        };
        let (left_prims, right_prims) = prims.split_at_mut(count as usize);
        let (left, right) = rayon::join(
            || self.piece(left, left_prims, depth + 1),
            || self.piece(right, right_prims, depth + 1),
        );
        Piece::pair(left, right)
    }

    /// Copies the references in a region to `to`, in the order of their cells.
    fn gather(&self, region: &Region, to: &mut [Entry]) {
        let mut next = to.iter_mut();
        self.grid.visit(region, &mut |begin, count| {
            let run = &self.sorted[begin as usize..(begin + count) as usize];
            for &pair in run {
                if let Some(slot) = next.next() {
                    *slot = entry(cells::unpack_key(key(pair)), payload(pair));
                }
            }
        });
    }
}

/// Splits a region of a task with many references, by counts of the grid.
struct Divide<'a, 'b> {
    builder: &'a Builder<'b>,
    region: Region,
}

impl Kernel for Divide<'_, '_> {
    type Output = Option<[(Region, u32); 2]>;

    #[inline(always)]
    fn run<S: Simd8>(mut self, simd: S) -> Self::Output {
        loop {
            self.region = self.region.refined(TOP);
            if self.region.fits_finer() && self.region.level == TOP {
                // The levels below are kept as lists.
                return None;
            }
            let mut bins = Bins::new();
            self.builder.grid.bin(simd, &self.region, &mut bins);
            if let Some(parts) = bins.split(&self.region, &self.builder.lattice) {
                return Some(parts);
            }
            if self.region.level == TOP {
                return None;
            }
            self.region = bins.tight(&self.region);
        }
    }
}
