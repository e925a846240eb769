// Photons in the order of their voxels, and the grid of these, as in `vastlight-transport`, `photon::search::voxel`. Who includes this
// has the binding `photon_map`: a header that says how the grid lies, then the photons.
//#include photon_words

// Least and greatest corner, voxels to the metre and their number by axis, radius, its inverse, the weight in the middle, which weight.
const GRID_MIN: u32 = 0u;
const GRID_MAX: u32 = 3u;
const GRID_PER_CELL: u32 = 6u;
const GRID_CELLS: u32 = 9u;
const GRID_RADIUS: u32 = 12u;
const GRID_ONE_OVER_RADIUS: u32 = 13u;
const GRID_PEAK: u32 = 14u;
const GRID_WEIGHT: u32 = 15u;
const GRID_WORDS: u32 = 16u;

fn grid_f32(at: u32) -> f32 {
    return bitcast<f32>(photon_map[at]);
}

/// The voxel of a coordinate along an axis, the nearest where it is outside.
fn grid_cell(axis: u32, x: f32) -> u32 {
    let cells = photon_map[GRID_CELLS + axis];
    let place = (x - grid_f32(GRID_MIN + axis)) * grid_f32(GRID_PER_CELL + axis);
    return min(u32(clamp(place, 0.0, f32(cells))), cells - 1u);
}

/// The number of a voxel, z the fastest.
fn grid_number(cell: vec3<u32>) -> u32 {
    return (cell.x * photon_map[GRID_CELLS + 1u] + cell.y) * photon_map[GRID_CELLS + 2u] + cell.z;
}
