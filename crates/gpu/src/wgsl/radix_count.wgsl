// How often each digit occurs in each tile: digit by digit, tile by tile within a digit.
//#include radix

@group(0) @binding(2) var<storage, read_write> counts: array<u32>;

var<workgroup> own: array<atomic<u32>, GROUP>;

@compute @workgroup_size(GROUP)
fn main(@builtin(workgroup_id) tile: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    atomicStore(&own[lane], 0u);
    workgroupBarrier();
    for (var k = 0u; k < ITEMS; k++) {
        let i = tile.x * TILE + k * GROUP + lane;
        if (i < parameters.count) {
            atomicAdd(&own[digit_of(keys[i])], 1u);
        }
    }
    workgroupBarrier();
    counts[lane * parameters.tiles + tile.x] = atomicLoad(&own[lane]);
}
