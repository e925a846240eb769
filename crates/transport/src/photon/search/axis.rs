//! An axis of a box cut into cells of one size.

use std::ops::RangeInclusive;

/// Cells along an axis. Which cell a coordinate is in grows with it, whatever the rounding.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis {
    min: f32,
    max: f32,
    /// Of a cell, m.
    size: f32,
    per_cell: f32,
    cells: u32,
}

impl Axis {
    /// Cells of `size` metres from `min` to `max`, larger where there would be more than `most`.
    pub(super) fn new(min: f32, max: f32, size: f32, most: u32) -> Self {
        let extent = (max - min).min(f32::MAX);
        let size = size.max(extent / most as f32).min(f32::MAX);
        let cells = ((extent / size) as u32).saturating_add(1).min(most);
        Self { min, max, size, per_cell: 1.0 / size, cells }
    }

    /// How many cells there are, at least one.
    pub(super) fn cells(&self) -> u32 {
        self.cells
    }

    /// Where it starts and ends, and cells to the metre.
    pub(super) fn numbers(&self) -> [f32; 3] {
        [self.min, self.max, self.per_cell]
    }

    /// Of a cell, m.
    pub(super) fn size(&self) -> f32 {
        self.size
    }

    /// Where a coordinate is, in cells from the first.
    #[inline(always)]
    pub(super) fn place(&self, x: f32) -> f32 {
        ((x - self.min) * self.per_cell).min(self.cells as f32)
    }

    /// The cell of a coordinate, the nearest where it is outside.
    #[inline(always)]
    pub(super) fn cell(&self, x: f32) -> u32 {
        (self.place(x) as u32).min(self.cells - 1)
    }

    /// The cells of an interval; none where it is outside.
    #[inline(always)]
    pub(super) fn cells_of(&self, low: f32, high: f32) -> Option<RangeInclusive<u32>> {
        let apart = high < self.min || low > self.max;
        (!apart).then(|| self.cell(low)..=self.cell(high))
    }

    /// The distance from a place to a cell, m, and never more than that, by a thousandth of a cell for rounding.
    #[inline(always)]
    pub(super) fn distance(&self, place: f32, cell: u32) -> f32 {
        let cell = cell as f32;
        let gap = (cell - place).max(place - (cell + 1.0)) - 1.0 / 1024.0;
        gap.max(0.0) * self.size
    }
}
