//! Trees by the surface-area heuristic over cells of a grid: what `wgsl/shared/region.wgsl` does, by the CPU.

use std::collections::BTreeMap;
use vastlight_math::Vec3;

/// Coarsest level of detail, 8 cells a side; level 0 has 1024.
const COARSEST: u32 = 7;

/// A tree over cells.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CellTree {
    /// Cells and their numbers of elements, in the order of the tree. Those of one leaf stand in that of their numbers.
    pub cells: Vec<(u32, u32)>,
    /// Start, end and first element on the right of each node with children.
    pub splits: Vec<[u32; 3]>,
}

/// The tree over the cells of a level of detail that hold any of some codes, plane by plane, until a node has one cell or at most
/// `leaf` elements. The box around twice the centres is `extents`.
#[must_use]
pub fn tree(extents: [Vec3; 2], codes: &[u32], finest: u32, leaf: u32) -> CellTree {
    if codes.is_empty() {
        return CellTree::default();
    }
    let mut held = BTreeMap::new();
    codes.iter().for_each(|code| *held.entry(code >> (3 * finest)).or_insert(0) += 1);
    let cells: Vec<Cell> = held.iter().map(|(&number, &held)| Cell::new(number, held)).collect();
    let mut builder = Builder { tree: CellTree::default(), sizes: sizes(extents), finest, leaf };
    builder.divide(&cells, Region { low: [0; 3], high: [7; 3], level: COARSEST }, 0);
    builder.tree
}

/// A cell of the finest level.
#[derive(Clone, Copy)]
struct Cell {
    number: u32,
    held: u32,
    place: [u32; 3],
}

impl Cell {
    fn new(number: u32, held: u32) -> Self {
        let axis = |k: u32| (0..10).fold(0, |x, bit| x | (number >> (3 * bit + 2 - k) & 1) << bit);
        Self { number, held, place: [axis(0), axis(1), axis(2)] }
    }
}

/// Cells of a level of detail.
#[derive(Clone, Copy)]
struct Region {
    low: [u32; 3],
    high: [u32; 3],
    level: u32,
}

impl Region {
    fn lengths(&self) -> [u32; 3] {
        [0, 1, 2].map(|axis| self.high[axis] - self.low[axis] + 1)
    }

    /// By finer cells, where at most four a side become at most eight.
    fn refined(mut self, finest: u32) -> Self {
        while self.level > finest && self.lengths().into_iter().all(|length| length <= 4) {
            self.low = self.low.map(|x| 2 * x);
            self.high = self.high.map(|x| 2 * x + 1);
            self.level -= 1;
        }
        self
    }
}

/// The sizes of cells in whole numbers, the largest from 2048 to 4095, none less than 1.
fn sizes([min, max]: [Vec3; 2]) -> [u64; 3] {
    let sizes = max - min;
    let exponent = sizes.max_element().to_bits() >> 23;
    if exponent < 11 {
        return [1; 3];
    }
    (sizes * f32::from_bits((265 - exponent) << 23)).to_array().map(|x| (x as u64).max(1))
}

/// Cells on both sides of a plane.
type Parts = (Vec<Cell>, Vec<Cell>);

struct Builder {
    tree: CellTree,
    sizes: [u64; 3],
    finest: u32,
    leaf: u32,
}

impl Builder {
    /// Where a cell is on a level.
    fn at(&self, cell: &Cell, level: u32) -> [u32; 3] {
        cell.place.map(|x| x >> (level - self.finest))
    }

    fn around(&self, cells: &[Cell], level: u32) -> Region {
        let mut region = Region { low: [u32::MAX; 3], high: [0; 3], level };
        for place in cells.iter().map(|cell| self.at(cell, level)) {
            for (axis, x) in place.into_iter().enumerate() {
                region.low[axis] = region.low[axis].min(x);
                region.high[axis] = region.high[axis].max(x);
            }
        }
        region
    }

    /// Elements times the area of the box around cells.
    fn side_cost(&self, cells: &[Cell], level: u32) -> u64 {
        let lengths = self.around(cells, level).lengths();
        let [a, b, c] = [0, 1, 2].map(|axis| u64::from(lengths[axis]) * self.sizes[axis]);
        (a * b + b * c + c * a) * u64::from(held(cells))
    }

    /// The cells on both sides of the plane of least cost; none where all are in one cell of the level.
    fn parted(&self, cells: &[Cell], region: &Region) -> Option<Parts> {
        let mut best: Option<(u64, Parts)> = None;
        for axis in 0..3 {
            for last in region.low[axis]..region.high[axis] {
                let parts: Parts = cells.iter().partition(|cell| self.at(cell, region.level)[axis] <= last);
                if parts.0.is_empty() || parts.1.is_empty() {
                    continue;
                }
                let cost = self.side_cost(&parts.0, region.level) + self.side_cost(&parts.1, region.level);
                if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                    best = Some((cost, parts));
                }
            }
        }
        best.map(|(_, parts)| parts)
    }

    /// Adds what is below a region with the elements from `first` on.
    fn divide(&mut self, cells: &[Cell], region: Region, first: u32) {
        let end = first + held(cells);
        let leaf = |tree: &mut CellTree| tree.cells.extend(cells.iter().map(|c| (c.number, c.held)));
        if end - first <= self.leaf {
            return leaf(&mut self.tree);
        }
        let mut region = region.refined(self.finest);
        let mut parts = self.parted(cells, &region);
        while parts.is_none() && region.level > self.finest {
            region = self.around(cells, region.level).refined(self.finest);
            parts = self.parted(cells, &region);
        }
        let Some((left, right)) = parts else {
            return leaf(&mut self.tree);
        };
        let middle = first + held(&left);
        self.tree.splits.push([first, end, middle]);
        self.divide(&left, self.around(&left, region.level), first);
        self.divide(&right, self.around(&right, region.level), middle);
    }
}

fn held(cells: &[Cell]) -> u32 {
    cells.iter().map(|cell| cell.held).sum()
}
