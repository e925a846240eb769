//! Cells, their levels of detail, and the dense top grid.

use crate::Reference;
use crate::build::RunBounds;
use crate::build::grid::bins::Bins;
use crate::sort::{Pair, key as key_of};
use vastlight_simd::Simd8;

/// Bits of a cell's number along one axis on the finest level: 1024 cells.
const AXIS_BITS: u32 = 10;
/// Bits of a key.
pub(super) const KEY_BITS: u32 = 3 * AXIS_BITS;
/// Level of `TopGrid`, 128 cells along an axis; level `i` has half as many cells as level `i - 1`.
pub(super) const TOP: u32 = 3;
/// The level with 8 cells along an axis.
pub(super) const COARSEST: u32 = 7;
/// Most cells of a task's box along an axis.
pub(super) const SIDE: u32 = 8;

/// The key of a cell: `TopGrid` cell above (z, y, x), cell in its block of 8^3 below.
#[inline(always)]
pub(super) fn key([x, y, z]: [u32; 3]) -> u32 {
    let top = (z >> 3) << 14 | (y >> 3) << 7 | x >> 3;
    top << 9 | (z & 7) << 6 | (y & 7) << 3 | x & 7
}

/// The cell of a key.
#[inline(always)]
pub(super) fn unpack_key(key: u32) -> [u32; 3] {
    let (top, bottom) = (key >> 9, key & 511);
    let part = |top: u32, bottom: u32| (top & 127) << 3 | bottom & 7;
    [part(top, bottom), part(top >> 7, bottom >> 3), part(top >> 14, bottom >> 6)]
}

/// A reference in a task's list: its cell on the finest level, and its place among the references.
pub(super) type Entry = u64;

/// An entry.
#[inline(always)]
pub(super) fn entry([x, y, z]: [u32; 3], reference: u32) -> Entry {
    u64::from(z << 20 | y << 10 | x) << 32 | u64::from(reference)
}

/// An entry's cell along an axis, on the finest level.
#[inline(always)]
pub(super) fn cell_of(entry: Entry, axis: usize) -> u32 {
    (entry >> (32 + 10 * axis)) as u32 & 1023
}

/// Where cells are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lattice {
    start: [f32; 3],
    cells_per_unit: [f32; 3],
    /// Of a cell, in a unit of its own: the largest from 2048 to 4095, and none less than 1. Costs are whole numbers then, which
    /// no processor rounds, and areas of eight cells a side have 32 bits.
    pub(super) size: [u32; 3],
}

impl Lattice {
    /// The lattice around the centres of a run.
    pub(super) fn new(bounds: &RunBounds) -> Self {
        let start = [bounds.centers[0], bounds.centers[1], bounds.centers[2]];
        let extent: [f32; 3] = std::array::from_fn(|axis| (-bounds.centers[axis + 4] - start[axis]).max(0.0));
        let cells_per_unit = extent.map(|extent| {
            let scale = (1 << AXIS_BITS) as f32 / extent;
            if scale.is_finite() { scale } else { 0.0 }
        });
        Self { start, cells_per_unit, size: sizes(extent) }
    }

    /// Whether all centres are in one cell.
    pub(super) fn is_point(&self) -> bool {
        self.cells_per_unit == [0.0; 3]
    }

    /// The cell of a reference's centre on the finest level.
    #[inline(always)]
    pub(super) fn cell(&self, reference: &Reference) -> [u32; 3] {
        let cell = |axis: usize| {
            let x = (reference.twice_center(axis) - self.start[axis]) * self.cells_per_unit[axis];
            (x as u32).min((1 << AXIS_BITS) - 1)
        };
        [cell(0), cell(1), cell(2)]
    }
}

/// [`Lattice::size`] of lengths.
fn sizes(extent: [f32; 3]) -> [u32; 3] {
    let exponent = extent[0].max(extent[1]).max(extent[2]).to_bits() >> 23;
    // Along no axis a cell is of no size, else flat scenes would have no areas to compare.
    if exponent < 11 {
        return [1; 3];
    }
    let scale = f32::from_bits((265 - exponent) << 23);
    extent.map(|x| ((x * scale) as u32).max(1))
}

/// A box of cells of one level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Region {
    pub(super) level: u32,
    pub(super) min: [u32; 3],
    /// Behind the last cell.
    pub(super) max: [u32; 3],
}

impl Region {
    /// Whether the box on the next finer level has at most 8 cells along each axis.
    #[inline(always)]
    pub(super) fn fits_finer(&self) -> bool {
        (0..3).all(|axis| self.max[axis] - self.min[axis] <= SIDE / 2)
    }

    /// The same box on the finest level that it fits, not finer than `finest`.
    #[inline(always)]
    pub(super) fn refined(mut self, finest: u32) -> Self {
        while self.level > finest && self.fits_finer() {
            self = self.finer();
        }
        self
    }

    /// The same box on the next finer level.
    #[inline(always)]
    pub(super) fn finer(&self) -> Self {
        Self { level: self.level - 1, min: self.min.map(|x| 2 * x), max: self.max.map(|x| 2 * x) }
    }
}

/// Counts of references in the cells of `TopGrid` and the levels above, dense.
pub(super) struct TopGrid {
    /// For each cell of `TopGrid`, its first reference in the sorted order.
    begins: Vec<u32>,
    /// By level, from `TopGrid` on; a little longer than the cells, so that eight can be read from each.
    counts: [Vec<u32>; (COARSEST - TOP + 1) as usize],
}

/// Cells along an axis, as a power of two.
#[inline(always)]
fn side_bits(level: u32) -> u32 {
    AXIS_BITS - level
}

impl TopGrid {
    /// The grid of sorted keys.
    pub(super) fn new(sorted: &[Pair]) -> Self {
        let cells = |level: u32| vec![0_u32; (1 << (3 * side_bits(level))) + SIDE as usize];
        let mut grid = Self {
            begins: cells(TOP),
            counts: [cells(TOP), cells(TOP + 1), cells(TOP + 2), cells(TOP + 3), cells(COARSEST)],
        };
        let mut begin = 0;
        while begin < sorted.len() {
            let cell = key_of(sorted[begin]) >> 9;
            let count = sorted[begin..].iter().take_while(|&&pair| key_of(pair) >> 9 == cell).count();
            grid.begins[cell as usize] = begin as u32;
            let at = [cell & 127, cell >> 7 & 127, cell >> 14];
            for level in TOP..=COARSEST {
                let index = Self::index(level, at.map(|x| x >> (level - TOP)));
                grid.counts[(level - TOP) as usize][index] += count as u32;
            }
            begin += count;
        }
        grid
    }

    #[inline(always)]
    fn index(level: u32, [x, y, z]: [u32; 3]) -> usize {
        let bits = side_bits(level);
        ((z << bits | y) << bits | x) as usize
    }

    /// Adds the cells of a region to bins.
    #[inline(always)]
    pub(super) fn bin<S: Simd8>(&self, simd: S, region: &Region, bins: &mut Bins) {
        let counts = &self.counts[(region.level - TOP) as usize];
        let ([x, y, z], [x_end, y_end, z_end]) = (region.min, region.max);
        let inside: [u32; 8] = std::array::from_fn(|i| if x + (i as u32) < x_end { u32::MAX } else { 0 });
        for cell_z in z..z_end {
            for cell_y in y..y_end {
                let start = Self::index(region.level, [x, cell_y, cell_z]);
                let Some(row) = counts.get(start..).and_then(|rest| rest.first_chunk::<8>()) else {
                    continue;
                };
                let row: [u32; 8] = std::array::from_fn(|i| row[i] & inside[i]);
                // Integers that are not zero are not equal to zero as floats either.
                let lanes: &[f32; 8] = bytemuck::cast_ref(&row);
                let full = simd.bits(simd.ne(simd.load(lanes), simd.splat(0.0)));
                if full != 0 {
                    bins.add_row(&row, full, (cell_y - y) as usize, (cell_z - z) as usize);
                }
            }
        }
    }

    /// Calls `found` with the first reference and the number of references of each cell of `TopGrid` in a region that
    /// has any.
    pub(super) fn visit(&self, region: &Region, found: &mut impl FnMut(u32, u32)) {
        let ([x, y, z], [x_end, y_end, z_end]) = (region.min, region.max);
        for cell_z in z..z_end {
            for cell_y in y..y_end {
                for cell_x in x..x_end {
                    let index = Self::index(region.level, [cell_x, cell_y, cell_z]);
                    let count = self.counts[(region.level - TOP) as usize][index];
                    if count == 0 {
                        continue;
                    }
                    if region.level == TOP {
                        found(self.begins[index], count);
                        continue;
                    }
                    let (min, max) = ([cell_x, cell_y, cell_z], [cell_x + 1, cell_y + 1, cell_z + 1]);
                    self.visit(&Region { level: region.level, min, max }.finer(), found);
                }
            }
        }
    }
}
