//! HLBVH2: Garanzha, Pantaleoni, McAllister 2011, "Simpler and faster HLBVH with work queues"; Garanzha's thesis of 2014,
//! chapter 5.
//!
//! Runs of sorted codes with the same upper 15 bits are clusters, one in each cell of a grid of 32^3 that holds any. Above them stands
//! a tree by the surface-area heuristic over that grid, in three levels of detail; below, splits come from work queues.
//!
//! Deviations: the grid is that of the clusters, and not one of 128^3 around their boxes, so that each has a cell of its own and
//! clusters are found by a search for each cell; the heuristic counts what is in a cluster, not clusters. Its costs are whole numbers, with sizes
//! of cells rounded down to at most 1023, so that the tree is the same on all devices.

use super::codes::Sorted;
use super::splits::{self, Splits};
use crate::kernel::{device_struct, kernel};
use crate::primitives::GROUP;
use crate::recording::{Buffer, Groups, Recording};
use vastlight_math::Vec3;

/// Cells of the grid.
const CELLS: u32 = 1 << 15;
/// Lower bits of a code, which elements of a cluster do not share.
const CLUSTER_SHIFT: u32 = 15;

/// Most levels of nodes above equal codes: each split over the grid takes a layer of its cells at least, those below a bit.
pub(super) const LEVELS: u32 = 3 * 31 + CLUSTER_SHIFT;

device_struct! {
    struct CountParameters as "Parameters" { count }
}
device_struct! {
    struct QueueParameters as "Parameters" { leaf }
}
kernel!(pub(crate) COUNT_CELLS = "build_cells", CountParameters, 2);
kernel!(pub(crate) TOP = "build_top", CountParameters, 6);
kernel!(pub(crate) PLACE = "build_place", CountParameters, 6);
kernel!(pub(crate) QUEUE = "build_queue", QueueParameters, 4);

/// Clusters in the order of the tree over them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clusters {
    /// Where each cell's cluster starts in the order of codes.
    cells: Buffer,
    /// Where it starts now.
    places: Buffer,
    /// The codes and elements as they are now.
    pub(super) placed: Sorted,
    splits: Splits,
}

/// Records the tree over clusters.
pub(super) fn record_top(recording: &mut Recording, extents: Buffer, sorted: Sorted, count: u32) -> Clusters {
    let cells = recording.buffer("cells", u64::from(CELLS) + 1);
    let parameters = CountParameters { count };
    let groups = Groups::Direct((CELLS + 1).div_ceil(GROUP));
    recording.dispatch(&COUNT_CELLS, &parameters, &[sorted.codes, cells], groups);
    let splits = Splits::none(recording, count);
    let tasks = recording.buffer("tasks", 2 * 4 * u64::from(CELLS));
    let places = recording.buffer("places of clusters", CELLS.into());
    let buffers = [extents, cells, tasks, places, splits.spans, splits.starting];
    recording.dispatch(&TOP, &parameters, &buffers, Groups::Direct(1));
    let placed = Sorted {
        codes: recording.buffer("placed codes", count.into()),
        order: recording.buffer("placed order", count.into()),
    };
    let buffers = [sorted.codes, sorted.order, cells, places, placed.codes, placed.order];
    recording.dispatch(&PLACE, &parameters, &buffers, Groups::Direct(count.div_ceil(GROUP)));
    Clusters { cells, places, placed, splits }
}

/// Records what is below clusters.
pub(super) fn record(recording: &mut Recording, clusters: &Clusters, count: u32, leaf: u32) -> Splits {
    let leaf = leaf.max(1);
    let Clusters { cells, places, placed, splits } = *clusters;
    let queue = recording.buffer("runs", 2 * u64::from(splits::capacity(count, leaf)));
    let tails = recording.upload("tails", &[0_u32, 0]);
    let groups = Groups::Direct(CELLS / GROUP);
    recording.dispatch(&QUEUE, &QueueParameters { leaf }, &[cells, places, tails, queue], groups);
    let codes = (placed.codes, CLUSTER_SHIFT);
    splits::record_below(recording, codes, (queue, tails), &splits, (count, leaf));
    splits
}

/// A tree over clusters.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Top {
    /// The clusters' cells and numbers of elements, in the order of the tree.
    pub clusters: Vec<(u32, u32)>,
    /// Start, end and first element on the right of each node with children.
    pub splits: Vec<[u32; 3]>,
}

/// The tree over the clusters of some codes, whose twice centres have the extents `extents`, plane by plane and cell by cell.
#[must_use]
pub fn top(extents: [Vec3; 2], codes: &[u32]) -> Top {
    let mut held = vec![0; CELLS as usize];
    codes.iter().for_each(|code| held[(code >> CLUSTER_SHIFT) as usize % CELLS as usize] += 1);
    let cells: Vec<Cell> = (0..).zip(&held).filter(|(_, held)| **held > 0).map(Cell::new).collect();
    let mut top = Top::default();
    if !cells.is_empty() {
        top.divide(&cells, Region { low: [0; 3], high: [7; 3], level: 2 }, 0, sizes(extents));
    }
    top
}

/// A cell of the finest level.
#[derive(Clone, Copy)]
struct Cell {
    number: u32,
    held: u32,
    place: [u32; 3],
}

impl Cell {
    fn new((number, held): (u32, &u32)) -> Self {
        let axis = |k: u32| (0..5).fold(0, |x, bit| x | (number >> (3 * bit + 2 - k) & 1) << bit);
        Self { number, held: *held, place: [axis(0), axis(1), axis(2)] }
    }

    fn at(&self, level: u32) -> [u32; 3] {
        self.place.map(|x| x >> level)
    }
}

/// Cells of a level of detail: 0 is the finest.
#[derive(Clone, Copy)]
struct Region {
    low: [u32; 3],
    high: [u32; 3],
    level: u32,
}

impl Region {
    fn around(cells: &[Cell], level: u32) -> Self {
        let mut region = Self { low: [31; 3], high: [0; 3], level };
        for place in cells.iter().map(|cell| cell.at(level)) {
            for (axis, x) in place.into_iter().enumerate() {
                region.low[axis] = region.low[axis].min(x);
                region.high[axis] = region.high[axis].max(x);
            }
        }
        region
    }

    fn lengths(&self) -> [u32; 3] {
        [0, 1, 2].map(|axis| self.high[axis] - self.low[axis] + 1)
    }

    /// By finer cells, where at most four a side become at most eight.
    fn refined(mut self) -> Self {
        while self.level > 0 && self.lengths().into_iter().all(|length| length <= 4) {
            self.low = self.low.map(|x| 2 * x);
            self.high = self.high.map(|x| 2 * x + 1);
            self.level -= 1;
        }
        self
    }
}

/// The sizes of cells in whole numbers, the largest from 512 to 1023.
fn sizes([min, max]: [Vec3; 2]) -> [u64; 3] {
    let sizes = max - min;
    let exponent = sizes.max_element().to_bits() >> 23;
    if exponent < 10 {
        return [1; 3];
    }
    (sizes * f32::from_bits((263 - exponent) << 23)).to_array().map(|x| x as u64)
}

/// Elements times the area of the box around cells.
fn side_cost(cells: &[Cell], level: u32, sizes: [u64; 3]) -> u64 {
    let lengths = Region::around(cells, level).lengths();
    let [a, b, c] = [0, 1, 2].map(|axis| u64::from(lengths[axis]) * sizes[axis]);
    let held: u64 = cells.iter().map(|cell| u64::from(cell.held)).sum();
    (a * b + b * c + c * a) * held
}

/// Cells on both sides of a plane.
type Parts = (Vec<Cell>, Vec<Cell>);

/// The cells on both sides of the plane of least cost; none where all are in one cell of the level.
fn parted(cells: &[Cell], region: &Region, sizes: [u64; 3]) -> Option<Parts> {
    let mut best: Option<(u64, Parts)> = None;
    for axis in 0..3 {
        for last in region.low[axis]..region.high[axis] {
            let parts: Parts = cells.iter().partition(|cell| cell.at(region.level)[axis] <= last);
            if parts.0.is_empty() || parts.1.is_empty() {
                continue;
            }
            let cost = side_cost(&parts.0, region.level, sizes) + side_cost(&parts.1, region.level, sizes);
            if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                best = Some((cost, parts));
            }
        }
    }
    best.map(|(_, parts)| parts)
}

impl Top {
    /// Adds what is below a region with the elements from `first` on.
    fn divide(&mut self, cells: &[Cell], region: Region, first: u32, sizes: [u64; 3]) {
        let mut region = region.refined();
        let mut parts = parted(cells, &region, sizes);
        while parts.is_none() && region.level > 0 {
            region = Region::around(cells, region.level).refined();
            parts = parted(cells, &region, sizes);
        }
        let Some((left, right)) = parts else {
            return self.clusters.extend(cells.iter().map(|cell| (cell.number, cell.held)));
        };
        let held = |cells: &[Cell]| cells.iter().map(|cell| cell.held).sum::<u32>();
        let middle = first + held(&left);
        self.splits.push([first, middle + held(&right), middle]);
        self.divide(&left, Region::around(&left, region.level), first, sizes);
        self.divide(&right, Region::around(&right, region.level), middle, sizes);
    }
}
