//! HLBVH2: Garanzha, Pantaleoni, McAllister 2011, "Simpler and faster HLBVH with work queues"; Garanzha's thesis of 2014,
//! chapter 5.
//!
//! Runs of sorted codes with the same upper 15 bits are clusters, one in each cell of a grid of 32^3 that holds any. Above them stands
//! a tree by the surface-area heuristic over that grid, in three levels of detail; below, splits come from work queues.
//!
//! Deviations: the grid is that of the clusters, and not one of 128^3 around their boxes, so that each has a cell of its own and
//! clusters are found by a search for each cell; the heuristic counts what is in a cluster, not clusters. Its costs are whole numbers, with sizes
//! of cells rounded down to at most 4095, so that the tree is the same on all devices.

use super::Count;
use super::codes::Sorted;
use super::regions::{self, CellTree};
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
    struct CellsParameters as "Parameters" { count, cells, shift }
}
device_struct! {
    struct CountParameters as "Parameters" { count }
}
device_struct! {
    struct QueueParameters as "Parameters" { leaf }
}
kernel!(pub(crate) COUNT_CELLS = "build_cells", CellsParameters, 2);
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
pub(super) fn record_top(
    recording: &mut Recording,
    extents: Buffer,
    sorted: Sorted,
    count: Count,
) -> Clusters {
    let cells = record_cells(recording, sorted.codes, count, CLUSTER_SHIFT);
    let parameters = CountParameters { count: count.most };
    let splits = Splits::none(recording, count.most);
    let tasks = recording.buffer("tasks", 2 * 4 * u64::from(CELLS));
    let places = recording.buffer("places of clusters", CELLS.into());
    let buffers = [extents, cells, tasks, places, splits.spans, splits.starting];
    count.dispatch(recording, &TOP, &parameters, &buffers, Groups::Direct(1));
    let placed = Sorted {
        codes: recording.buffer("placed codes", count.most.into()),
        order: recording.buffer("placed order", count.most.into()),
    };
    let buffers = [sorted.codes, sorted.order, cells, places, placed.codes, placed.order];
    let groups = Groups::Direct(count.most.div_ceil(GROUP));
    count.dispatch(recording, &PLACE, &parameters, &buffers, groups);
    Clusters { cells, places, placed, splits }
}

/// Records what is below clusters.
pub(super) fn record(recording: &mut Recording, clusters: &Clusters, count: Count, leaf: u32) -> Splits {
    let leaf = leaf.max(1);
    let Clusters { cells, places, placed, splits } = *clusters;
    let queue = recording.buffer("runs", 2 * u64::from(splits::capacity(count.most, leaf)));
    let tails = recording.upload("tails", &[0_u32, 0]);
    let groups = Groups::Direct(CELLS / GROUP);
    recording.dispatch(&QUEUE, &QueueParameters { leaf }, &[cells, places, tails, queue], groups);
    let codes = (placed.codes, CLUSTER_SHIFT);
    splits::record_below(recording, codes, (queue, tails), &splits, (count, leaf));
    splits
}

/// Records for each cell of the grid whose numbers are codes without their lower `shift` bits, and for what comes behind all, how many
/// sorted codes are below.
pub(super) fn record_cells(recording: &mut Recording, codes: Buffer, count: Count, shift: u32) -> Buffer {
    let cells: u32 = 1 << (super::codes::CODE_BITS - shift);
    let table = recording.buffer("cells", u64::from(cells) + 1);
    let groups = Groups::Direct((cells + 1).div_ceil(GROUP));
    let parameters = CellsParameters { count: count.most, cells, shift };
    count.dispatch(recording, &COUNT_CELLS, &parameters, &[codes, table], groups);
    table
}

/// The tree over the clusters of some codes, whose twice centres have the extents `extents`.
#[must_use]
pub fn top(extents: [Vec3; 2], codes: &[u32]) -> CellTree {
    regions::tree(extents, codes, CLUSTER_SHIFT / 3, 0)
}
