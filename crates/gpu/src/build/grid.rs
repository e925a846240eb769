//! Grid SAH: Garanzha, Premoze, Bely, Galaktionov 2011, "Grid-based SAH BVH construction on a GPU"; Garanzha's thesis of
//! 2014, chapter 4.
//!
//! One sort distributes the elements over the cells of a grid of 1024^3 in the order of their codes, so that each cell of each level of detail
//! is a run. A table says where the runs of one level start, `TopGrid`; coarser cells are longer runs. A task is a node with a region
//! of at most 8^3 cells; queues take level after level. Leaves gather their elements from their cells at the end.
//!
//! Deviations: the grid is laid around the centres, and `TopGrid` has no more cells than there are elements (128^3 from two millions on). Cells below
//! it are found in the runs by searching: dense blocks of 8^3 would be empty almost everywhere, and how many there are the device
//! alone knows. Costs are whole numbers. The CPU's `grid-sah` is the same tree, but it lays a new grid where one cell of the
//! finest level holds more than a leaf may; here, as in the paper, these elements are halved.

use super::codes::Sorted;
use super::splits::{self, Splits};
use super::{Count, codes, hlbvh2};
use crate::kernel::{device_struct, kernel};
use crate::primitives::{GROUP, queue};
use crate::recording::{Buffer, Groups, Recording};

/// Levels of detail, of which the coarsest has 8 cells a side.
const DETAILS: u32 = codes::CODE_BITS / 3 - 2;
/// The level with 128 cells a side, the finest that gets a table.
const TOP: u32 = 3;
/// Most levels of nodes above equal codes: a region of eight cells a side loses a layer by each split, and is refined when four are left.
pub(super) const LEVELS: u32 = (DETAILS - 1) * 12 + 21;
/// Tails: two queues, and that of leaves.
const LEAVES: u32 = 2;
/// All cells of the coarsest level, as kernels pack a region.
const WHOLE: [u32; 2] = [0, 0o7777];

device_struct! {
    struct Parameters as "Parameters" { count, table, leaf, capacity, full, next, leaves }
}
device_struct! {
    struct LeavesParameters as "Parameters" { table, leaf, capacity, leaves }
}
device_struct! {
    struct AlikeParameters as "Parameters" { count, leaf }
}
kernel!(pub(crate) DIVIDE = "build_grid", Parameters, 8);
kernel!(pub(crate) GATHER = "build_grid_leaves", LeavesParameters, 7);
kernel!(pub(crate) ALIKE = "build_grid_alike", AlikeParameters, 6);

/// Codes in their order, and where the cells of a level start.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cells {
    extents: Buffer,
    sorted: Sorted,
    table: Buffer,
    level: u32,
}

/// Records the table of cells of `count` sorted codes.
pub(super) fn record_cells(
    recording: &mut Recording,
    extents: Buffer,
    sorted: Sorted,
    count: Count,
) -> Cells {
    let level = table_level(count.most);
    let table = hlbvh2::record_cells(recording, sorted.codes, count, 3 * level);
    Cells { extents, sorted, table, level }
}

/// The finest level of detail with no more cells than there are elements.
fn table_level(count: u32) -> u32 {
    let most = u64::from(count);
    (TOP..DETAILS).find(|level| 1_u64 << (codes::CODE_BITS - 3 * level) <= most).unwrap_or(DETAILS - 1)
}

/// Records the splits over `count` elements whose leaves hold at most `leaf` (1 at least), and the elements in the order of the tree.
pub(super) fn record(recording: &mut Recording, cells: &Cells, count: Count, leaf: u32) -> (Splits, Buffer) {
    let (leaf, most) = (leaf.max(1), count.most);
    let splits = Splits::none(recording, most);
    let leaf_tasks = recording.buffer("leaf tasks", 4 * u64::from(most));
    let capacity = splits::capacity(most, leaf);
    let tasks = recording.buffer("tasks", 2 * 4 * u64::from(capacity));
    let root = [WHOLE[0], WHOLE[1], 0, most];
    let long = most > leaf;
    recording.write(if long { tasks } else { leaf_tasks }, bytemuck::cast_slice(&root).to_vec());
    let tails = recording.upload("tails", &[u32::from(long), 0, u32::from(!long)]);
    let workgroups = recording.buffer("workgroups", 3);
    // The last is for cells at the end of the longest way.
    for level in 0..=LEVELS {
        let (full, next) = (level % 2, 1 - level % 2);
        let parameters = queue::NextParameters { capacity, full, empty: next };
        recording.dispatch(&queue::NEXT, &parameters, &[tails, workgroups], Groups::Direct(1));
        let table = cells.level;
        let parameters = Parameters { count: most, table, leaf, capacity, full, next, leaves: LEAVES };
        let buffers = [
            cells.extents,
            cells.sorted.codes,
            cells.table,
            tails,
            tasks,
            leaf_tasks,
            splits.spans,
            splits.starting,
        ];
        count.dispatch(recording, &DIVIDE, &parameters, &buffers, Groups::Indirect(workgroups, 0));
    }
    (splits, record_order(recording, cells, (leaf_tasks, tails), &splits, (count, leaf)))
}

/// Records the elements of leaves, and the splits of cells that are too full.
fn record_order(
    recording: &mut Recording,
    cells: &Cells,
    (leaf_tasks, tails): (Buffer, Buffer),
    splits: &Splits,
    (count, leaf): (Count, u32),
) -> Buffer {
    let most = count.most;
    let order = recording.buffer("order", most.into());
    let places = recording.buffer("places of full cells", most.into());
    let parameters = LeavesParameters { table: cells.level, leaf, capacity: most, leaves: LEAVES };
    let Sorted { codes, order: sorted } = cells.sorted;
    let groups = Groups::Direct(most.div_ceil(GROUP));
    let buffers = [codes, sorted, cells.table, tails, leaf_tasks, order, places];
    recording.dispatch(&GATHER, &parameters, &buffers, groups);
    let buffers = [codes, sorted, places, order, splits.spans, splits.starting];
    count.dispatch(recording, &ALIKE, &AlikeParameters { count: most, leaf }, &buffers, groups);
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_have_no_more_cells_than_elements_but_for_few() {
        let levels = [0, 511, 512, 4095, 4096, 32_767, 32_768, 262_144, 2_097_152, 8_000_000];
        assert_eq!(levels.map(table_level), [7, 7, 7, 7, 6, 6, 5, 4, 3, 3]);
    }
}
