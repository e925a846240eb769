// How many elements of each tile are chosen: Blelloch 1990, "Prefix sums and their applications", packing.
// Who includes this says by `selected(i)` which are.
//#include group_scan

@group(0) @binding(2) var<storage, read_write> counts: array<u32>;

@compute @workgroup_size(GROUP)
fn main(@builtin(workgroup_id) tile: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    var chosen = 0u;
    for (var k = 0u; k < ITEMS; k++) {
        let i = tile.x * TILE + k * GROUP + lane;
        if (i < parameters.count && selected(i)) {
            chosen++;
        }
    }
    let total = group_scan(lane, chosen).y;
    if (lane == 0u) {
        counts[tile.x] = total;
    }
}
