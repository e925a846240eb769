//! Binned surface-area heuristic: Wald 2007, "On fast construction of SAH-based bounding volume hierarchies".
//!
//! Deviations: costs count blocks of `max_leaf` primitives rather than primitives, since a block is tested at once; small
//! runs use fewer bins.

use super::{BuildConfig, Heuristic, RunBounds};
use crate::Reference;
use crate::reference::{EMPTY_LANES, packed_half_area};
use vastlight_simd::Simd8;

const MAX_BINS: usize = 16;

/// Adding this to a small number rounds it to an integer in the low bits of the mantissa.
const ROUNDER: f32 = 12_582_912.0;

/// The heuristic.
#[derive(Clone, Copy, Debug)]
pub struct Binned {
    block: usize,
    traversal_cost: f32,
}

/// What fell into each bin along each axis.
#[derive(Clone, Debug)]
pub struct Bins {
    boxes: [[[f32; 8]; MAX_BINS]; 3],
    counts: [[u32; MAX_BINS]; 3],
}

/// References in bins below `bin` along `axis` go left.
#[derive(Clone, Copy, Debug)]
pub struct BinSplit {
    map: BinMap,
    axis: usize,
    bin: u32,
}

/// Maps a centre to its bin.
#[derive(Clone, Copy, Debug)]
struct BinMap {
    start: [f32; 3],
    scale: [f32; 3],
    bins: usize,
}

impl BinMap {
    #[inline(always)]
    fn new(run: &RunBounds, count: usize) -> Self {
        let bins = (4 + count / 16).min(MAX_BINS);
        let start = [run.centers[0], run.centers[1], run.centers[2]];
        let scale = std::array::from_fn(|axis| {
            let extent = -run.centers[axis + 4] - start[axis];
            // A little less than the number of bins, so that the last centre falls into the last bin.
            let scale = (bins as f32 - 0.01) / extent;
            if extent > 0.0 && scale.is_finite() { scale } else { 0.0 }
        });
        Self { start, scale, bins }
    }

    #[inline(always)]
    fn bin(&self, reference: &Reference, axis: usize) -> usize {
        let x = (reference.twice_center(axis) - self.start[axis]) * self.scale[axis];
        (x - 0.5 + ROUNDER).to_bits() as usize % MAX_BINS
    }
}

impl Binned {
    /// The heuristic with the costs of `config`.
    #[must_use]
    pub fn new(config: &BuildConfig) -> Self {
        Self { block: config.max_leaf.max(1) as usize, traversal_cost: config.traversal_cost }
    }

    #[inline(always)]
    fn blocks(&self, count: u32) -> f32 {
        (count as usize).div_ceil(self.block) as f32
    }

    /// The cheapest plane of one axis: its first right bin and its cost.
    #[inline(always)]
    fn sweep<S: Simd8>(&self, simd: S, bins: &Bins, axis: usize, used: usize) -> Option<(u32, f32)> {
        let (boxes, counts) = (&bins.boxes[axis], &bins.counts[axis]);
        let mut right_costs = [0.0; MAX_BINS];
        let (mut around, mut below) = (simd.load(&EMPTY_LANES), 0);
        for bin in (1..used).rev() {
            around = simd.min(around, simd.load(&boxes[bin]));
            below += counts[bin];
            right_costs[bin] = if below == 0 {
                f32::INFINITY
            } else {
                packed_half_area(&simd.to_array(around)) * self.blocks(below)
            };
        }
        let mut best: Option<(u32, f32)> = None;
        let (mut around, mut below) = (simd.load(&EMPTY_LANES), 0);
        for bin in 1..used {
            around = simd.min(around, simd.load(&boxes[bin - 1]));
            below += counts[bin - 1];
            if below == 0 {
                continue;
            }
            let cost = packed_half_area(&simd.to_array(around)) * self.blocks(below) + right_costs[bin];
            if cost < best.map_or(f32::INFINITY, |b| b.1) {
                best = Some((bin as u32, cost));
            }
        }
        best
    }
}

impl Heuristic for Binned {
    type Figures = Bins;
    type Split = BinSplit;

    #[inline(always)]
    fn gather<S: Simd8>(&self, simd: S, references: &[Reference], run: &RunBounds, count: usize) -> Bins {
        let map = BinMap::new(run, count);
        let mut bins = Bins { boxes: [[EMPTY_LANES; MAX_BINS]; 3], counts: [[0; MAX_BINS]; 3] };
        for reference in references {
            let lanes = simd.load(reference.lanes());
            for axis in 0..3 {
                let bin = map.bin(reference, axis);
                let around = &mut bins.boxes[axis][bin];
                *around = simd.to_array(simd.min(simd.load(around), lanes));
                bins.counts[axis][bin] += 1;
            }
        }
        bins
    }

    #[inline(always)]
    fn merge<S: Simd8>(&self, simd: S, mut a: Bins, b: &Bins) -> Bins {
        for axis in 0..3 {
            for bin in 0..MAX_BINS {
                let (x, y) = (simd.load(&a.boxes[axis][bin]), simd.load(&b.boxes[axis][bin]));
                a.boxes[axis][bin] = simd.to_array(simd.min(x, y));
                a.counts[axis][bin] += b.counts[axis][bin];
            }
        }
        a
    }

    #[inline(always)]
    fn try_split<S: Simd8>(
        &self,
        simd: S,
        bins: &Bins,
        run: &RunBounds,
        count: usize,
    ) -> Option<(BinSplit, f32)> {
        let map = BinMap::new(run, count);
        let mut best: Option<(BinSplit, f32)> = None;
        for axis in 0..3 {
            if map.scale[axis] == 0.0 {
                continue;
            }
            if let Some((bin, cost)) = self.sweep(simd, bins, axis, map.bins)
                && cost < best.map_or(f32::INFINITY, |b| b.1)
            {
                best = Some((BinSplit { map, axis, bin }, cost));
            }
        }
        best.map(|(split, cost)| (split, cost + self.traversal_cost * packed_half_area(&run.boxes)))
    }

    #[inline(always)]
    fn leaf_cost(&self, run: &RunBounds, count: usize) -> f32 {
        packed_half_area(&run.boxes) * self.blocks(count as u32)
    }

    #[inline(always)]
    fn goes_left(&self, split: &BinSplit, reference: &Reference) -> bool {
        split.map.bin(reference, split.axis) < split.bin as usize
    }
}
