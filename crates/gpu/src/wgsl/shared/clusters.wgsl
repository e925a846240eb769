// Clusters: runs of sorted codes with the same upper 15 bits, one in each cell of a grid of 32 x 32 x 32 that holds any.

/// Cells of the grid.
const CELLS: u32 = 32768u;
/// Lower bits of a code, which elements of a cluster do not share.
const CLUSTER_SHIFT: u32 = 15u;
/// The grid's level of detail.
const CLUSTER_LEVEL: u32 = CLUSTER_SHIFT / 3u;
