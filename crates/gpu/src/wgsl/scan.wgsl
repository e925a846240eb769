// Exclusive prefix sums of a tile, from the sum before it: Sengupta, Harris, Zhang, Owens 2007, "Scan primitives for GPU
// computing". Reduce, then scan: a single pass would need workgroups to wait for each other, which WebGPU does not
// promise to end.
//#include group_scan

struct Parameters {
    count: u32,
    has_sums: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> values: array<u32>;
@group(0) @binding(2) var<storage, read> tile_sums: array<u32>;
@group(0) @binding(3) var<storage, read_write> sums: array<u32>;

@compute @workgroup_size(GROUP)
fn main(@builtin(workgroup_id) tile: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let start = tile.x * TILE + lane * ITEMS;
    var own: array<u32, ITEMS>;
    var total = 0u;
    for (var k = 0u; k < ITEMS; k++) {
        own[k] = 0u;
        if (start + k < parameters.count) {
            own[k] = values[start + k];
        }
        total += own[k];
    }
    var running = group_scan(lane, total).x;
    if (parameters.has_sums != 0u) {
        running += tile_sums[tile.x];
    }
    for (var k = 0u; k < ITEMS; k++) {
        // One more than there are values: the last is the sum of all.
        if (start + k <= parameters.count) {
            sums[start + k] = running;
        }
        running += own[k];
    }
}
