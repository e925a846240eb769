// How often each value of some bits of the keys occurs: counted by each workgroup in its own memory, then added.
//#include group

const MAX_BINS: u32 = 1024u;

struct Parameters {
    count: u32,
    shift: u32,
    bins: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> keys: array<u32>;
@group(0) @binding(2) var<storage, read_write> counts: array<atomic<u32>>;

var<workgroup> own: array<atomic<u32>, MAX_BINS>;

@compute @workgroup_size(GROUP)
fn main(@builtin(workgroup_id) tile: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    for (var bin = lane; bin < MAX_BINS; bin += GROUP) {
        atomicStore(&own[bin], 0u);
    }
    workgroupBarrier();
    for (var k = 0u; k < ITEMS; k++) {
        let i = tile.x * TILE + k * GROUP + lane;
        if (i < parameters.count) {
            atomicAdd(&own[(keys[i] >> parameters.shift) & (parameters.bins - 1u)], 1u);
        }
    }
    workgroupBarrier();
    for (var bin = lane; bin < parameters.bins; bin += GROUP) {
        let counted = atomicLoad(&own[bin]);
        if (counted != 0u) {
            atomicAdd(&counts[bin], counted);
        }
    }
}
