// How many runs of equal keys start in each tile.
//#include select

struct Parameters {
    count: u32,
    shift: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> keys: array<u32>;
@group(0) @binding(2) var<storage, read_write> counts: array<u32>;

fn selected(i: u32) -> bool {
    return i == 0u || keys[i] >> parameters.shift != keys[max(i, 1u) - 1u] >> parameters.shift;
}

fn emit(i: u32, place: u32) {}

@compute @workgroup_size(GROUP)
fn main(@builtin(workgroup_id) tile: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let chosen = count_selected(lane, tile.x, parameters.count);
    if (lane == 0u) {
        counts[tile.x] = chosen;
    }
}
