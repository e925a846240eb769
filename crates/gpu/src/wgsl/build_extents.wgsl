// The box around twice the centres of boxes, or around their corners: each workgroup's in its own memory, then all.
//#include doubled_centre
//#include group

struct Parameters {
    count: u32,
    corners: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> boxes: array<Box>;
@group(0) @binding(2) var<storage, read_write> extents: array<atomic<u32>, 6>;

var<workgroup> own: array<atomic<u32>, 6>;

@compute @workgroup_size(GROUP)
fn main(@builtin(workgroup_id) tile: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    if (lane < 6u) {
        atomicStore(&own[lane], select(0u, 0xffffffffu, lane < 3u));
    }
    var around = empty_box();
    for (var k = 0u; k < ITEMS; k++) {
        let i = tile.x * TILE + k * GROUP + lane;
        if (i < parameters.count) {
            let b = boxes[i];
            for (var axis = 0u; axis < 3u; axis++) {
                let centre = ordered(bitcast<u32>(doubled_centre(b, axis)));
                around[axis] = min(around[axis], select(centre, b[axis], parameters.corners != 0u));
                around[axis + 3u] = max(around[axis + 3u], select(centre, b[axis + 3u], parameters.corners != 0u));
            }
        }
    }
    workgroupBarrier();
    for (var axis = 0u; axis < 3u; axis++) {
        atomicMin(&own[axis], around[axis]);
        atomicMax(&own[axis + 3u], around[axis + 3u]);
    }
    workgroupBarrier();
    if (lane < 3u) {
        atomicMin(&extents[lane], atomicLoad(&own[lane]));
    } else if (lane < 6u) {
        atomicMax(&extents[lane], atomicLoad(&own[lane]));
    }
}
