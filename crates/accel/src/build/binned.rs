//! Binned surface-area heuristic: Wald 2007, "On fast construction of SAH-based bounding volume hierarchies".
//!
//! Deviations: costs count blocks of `max_leaf` primitives rather than primitives, since a block is tested at once; small
//! runs use fewer bins, and runs of at most [`FEW`] none: there every place between two centres is priced.

use super::{BuildConfig, FEW, Heuristic, RunBounds};
use crate::Reference;
use crate::reference::{EMPTY_LANES, packed_half_area};
use vastlight_simd::Simd8;

const MAX_BINS: usize = 16;

/// Axes along which the centres of a few references are spread less than this times the most are not looked at.
const LEAST_EXTENT: f32 = 0.125;

/// Adding this to a small number rounds it to an integer in the low bits of the mantissa.
const ROUNDER: f32 = 12_582_912.0;

/// The heuristic.
#[derive(Clone, Copy, Debug)]
pub struct Binned {
    block: u32,
    /// Of which power of two a block is, if it is one.
    block_bits: Option<u32>,
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
    /// By axis; lanes behind the third are unused.
    start: [f32; 8],
    scale: [f32; 8],
    bins: usize,
}

impl BinMap {
    #[inline(always)]
    fn new(run: &RunBounds, count: usize) -> Self {
        let bins = (4 + count / 16).min(MAX_BINS);
        let (start, mut scale) = (run.centers, [0.0; 8]);
        for axis in 0..3 {
            let extent = -run.centers[axis + 4] - start[axis];
            // A little less than the number of bins, so that the last centre falls into the last bin.
            let fitting = (bins as f32 - 0.01) / extent;
            scale[axis] = if extent > 0.0 && fitting.is_finite() { fitting } else { 0.0 };
        }
        Self { start, scale, bins }
    }

    /// The bins of a reference by axis, in the low bits of the first three lanes.
    #[inline(always)]
    fn bins_of<S: Simd8>(&self, simd: S, reference: &Reference) -> [usize; 3] {
        let lanes = simd.load(reference.lanes());
        let twice_center = simd.sub(lanes, simd.swap_halves(lanes));
        let x = simd.mul(simd.sub(twice_center, simd.load(&self.start)), simd.load(&self.scale));
        let bins = simd.to_array(simd.add(simd.sub(x, simd.splat(0.5)), simd.splat(ROUNDER)));
        [0, 1, 2].map(|axis| bins[axis].to_bits() as usize % MAX_BINS)
    }

    /// The bin of a reference along one axis, as [`BinMap::bins_of`] gives it.
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
        let block = config.max_leaf.max(1);
        let block_bits = block.is_power_of_two().then(|| block.ilog2());
        Self { block, block_bits, traversal_cost: config.traversal_cost }
    }

    #[inline(always)]
    fn blocks(&self, count: u32) -> f32 {
        let count = count + (self.block - 1);
        self.block_bits.map_or_else(|| count / self.block, |bits| count >> bits) as f32
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

impl Binned {
    /// How many references in `order` best go left, and the cost.
    #[inline(always)]
    fn cheapest_place<S: Simd8>(&self, simd: S, references: &[Reference], order: &Order) -> (usize, f32) {
        let count = references.len();
        let reference = |place: usize| &references[order[place % FEW] as usize % count];
        let mut right_costs = [0.0; FEW];
        let mut around = simd.load(&EMPTY_LANES);
        for first in (1..count).rev() {
            around = simd.min(around, simd.load(reference(first).lanes()));
            let area = packed_half_area(&simd.to_array(around));
            right_costs[first % FEW] = area * self.blocks((count - first) as u32);
        }
        let (mut best, mut least) = (0, f32::INFINITY);
        let mut around = simd.load(&EMPTY_LANES);
        for left in 1..count {
            around = simd.min(around, simd.load(reference(left - 1).lanes()));
            let area = packed_half_area(&simd.to_array(around));
            let cost = area * self.blocks(left as u32) + right_costs[left % FEW];
            let better = cost < least;
            (best, least) = (if better { left } else { best }, if better { cost } else { least });
        }
        (best, least)
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
            let in_bins = map.bins_of(simd, reference);
            for (axis, bin) in in_bins.into_iter().enumerate() {
                let around = &mut bins.boxes[axis][bin];
                *around = simd.to_array(simd.min(simd.load(around), lanes));
                bins.counts[axis][bin] += reference.weight();
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
    fn part_few<S: Simd8>(
        &self,
        simd: S,
        from: &[Reference],
        to: &mut [Reference],
        run: &RunBounds,
    ) -> Option<(usize, f32)> {
        let mut best: Option<(usize, f32, Order)> = None;
        let extent = [0, 1, 2].map(|axis| -(run.centers[axis] + run.centers[axis + 4]));
        let least = extent[0].max(extent[1]).max(extent[2]) * LEAST_EXTENT;
        for axis in (0..3).filter(|&axis| extent[axis] >= least) {
            let Some(order) = order_along(simd, from, run, axis) else { continue };
            let (left, cost) = self.cheapest_place(simd, from, &order);
            if cost < best.map_or(f32::INFINITY, |b| b.1) {
                best = Some((left, cost, order));
            }
        }
        let (left, cost, order) = best?;
        for (slot, place) in to.iter_mut().zip(order) {
            *slot = from[place as usize % from.len()];
        }
        Some((left, cost + self.traversal_cost * packed_half_area(&run.boxes)))
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

/// Places of at most [`FEW`] references, in some order.
type Order = [u8; FEW];

/// The order of the centres of at most [`FEW`] references along an axis, those of equal centres in their old one; none where
/// all are equal.
#[inline(always)]
fn order_along<S: Simd8>(simd: S, references: &[Reference], run: &RunBounds, axis: usize) -> Option<Order> {
    let start = run.centers[axis];
    let scale = 0.99 / -(run.centers[axis + 4] + start);
    if !(scale > 0.0 && scale.is_finite()) {
        return None;
    }
    // Numbers from 1 to 2 whose last bits are the places of the references, so that no two are equal.
    let mut keys = [f32::INFINITY; FEW];
    for (place, (key, reference)) in keys.iter_mut().zip(references).enumerate() {
        let x = 1.0 + (reference.twice_center(axis) - start) * scale;
        *key = f32::from_bits(x.to_bits() & !(FEW as u32 - 1) | place as u32);
    }
    let mut order = [0; FEW];
    let (blocks, _) = keys.as_chunks::<8>();
    for (place, key) in keys.iter().enumerate().take(references.len()) {
        let key = simd.splat(*key);
        let mut rank = 0;
        for block in &blocks[..references.len().div_ceil(8)] {
            rank += simd.bits(simd.le(simd.load(block), key)).count_ones() as usize;
        }
        order[(rank - 1) % FEW] = place as u8;
    }
    Some(order)
}
