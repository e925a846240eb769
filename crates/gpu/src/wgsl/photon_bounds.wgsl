// The box around all photons whose numbers are finite, and how many they are: each workgroup's in its own memory, then all.
//#include boxes
//#include group
//#include photon_kept

struct Parameters {
    count: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> photons: array<u32>;
/// The box, and the number.
@group(0) @binding(2) var<storage, read_write> bounds: array<atomic<u32>, 7>;

var<workgroup> own: array<atomic<u32>, 7>;

@compute @workgroup_size(GROUP)
fn main(@builtin(workgroup_id) tile: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    if (lane < 7u) {
        atomicStore(&own[lane], select(0u, 0xffffffffu, lane < 3u));
    }
    var around = empty_box();
    var kept = 0u;
    for (var k = 0u; k < ITEMS; k++) {
        let i = tile.x * TILE + k * GROUP + lane;
        if (i < parameters.count && is_kept(i)) {
            kept++;
            for (var axis = 0u; axis < 3u; axis++) {
                let place = ordered(photons[i * PHOTON_WORDS + axis]);
                around[axis] = min(around[axis], place);
                around[axis + 3u] = max(around[axis + 3u], place);
            }
        }
    }
    workgroupBarrier();
    for (var axis = 0u; axis < 3u; axis++) {
        atomicMin(&own[axis], around[axis]);
        atomicMax(&own[axis + 3u], around[axis + 3u]);
    }
    atomicAdd(&own[6], kept);
    workgroupBarrier();
    if (lane < 3u) {
        atomicMin(&bounds[lane], atomicLoad(&own[lane]));
    } else if (lane < 6u) {
        atomicMax(&bounds[lane], atomicLoad(&own[lane]));
    } else if (lane == 6u) {
        atomicAdd(&bounds[6], atomicLoad(&own[6]));
    }
}
