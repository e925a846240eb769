// The first queue of splits: the clusters that are longer than a leaf.
//#include clusters
//#include queue

struct Parameters {
    leaf: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> cells: array<u32>;
@group(0) @binding(2) var<storage, read> places: array<u32>;
@group(0) @binding(3) var<storage, read_write> tails: array<atomic<u32>>;
@group(0) @binding(4) var<storage, read_write> runs: array<vec2<u32>>;

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let length = cells[id.x + 1u] - cells[id.x];
    let long = length > parameters.leaf;
    let queued = reserve(lane, select(0u, 1u, long), 0u);
    if (long) {
        runs[queued] = vec2<u32>(places[id.x], places[id.x] + length);
    }
}
