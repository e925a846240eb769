// The voxel and the number of each photon; those whose numbers are not finite come behind the last voxel.
//#include group
//#include photon_grid
//#include photon_kept

struct Parameters {
    count: u32,
    cells: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> photons: array<u32>;
@group(0) @binding(2) var<storage, read> photon_map: array<u32>;
@group(0) @binding(3) var<storage, read_write> keys: array<u32>;
@group(0) @binding(4) var<storage, read_write> numbers: array<u32>;

@compute @workgroup_size(GROUP)
fn main(@builtin(workgroup_id) tile: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    for (var k = 0u; k < ITEMS; k++) {
        let i = tile.x * TILE + k * GROUP + lane;
        if (i < parameters.count) {
            var cell: vec3<u32>;
            for (var axis = 0u; axis < 3u; axis++) {
                cell[axis] = grid_cell(axis, bitcast<f32>(photons[i * PHOTON_WORDS + axis]));
            }
            keys[i] = select(parameters.cells, grid_number(cell), is_kept(i));
            numbers[i] = i;
        }
    }
}
