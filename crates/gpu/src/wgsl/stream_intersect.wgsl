// The third kernel of the stream tracer: tests the leaves at which the rays of a queue stand, and hands the rays back to
// traversal, or on to shading when any hit will do. Rays that meet what is dear to judge are left to `stream_intersect_settled`.
//#include queue
//#include stream_leaf
//#include unsettled

struct Parameters {
    slots: u32,
    full: u32,
    on: u32,
    ended: u32,
    left: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> tree: array<u32>;
@group(0) @binding(2) var<storage, read> blocks: array<u32>;
@group(0) @binding(3) var<storage, read_write> streams: array<u32>;
@group(0) @binding(4) var<storage, read_write> queues: array<u32>;
@group(0) @binding(5) var<storage, read_write> tails: array<atomic<u32>>;

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    var slot = 0u;
    var ends = false;
    var is_left = false;
    let held = id.x < atomicLoad(&tails[parameters.full]);
    if (held) {
        slot = queues[parameters.full * parameters.slots + id.x];
        var best = stream_hit(slot);
        ends = stream_test(slot, &best) && stream_is_shadow(slot);
        is_left = is_unsettled() && !ends;
        if (!is_left) {
            put_stream_hit(slot, best);
        }
    }
    let goes_on = held && !ends && !is_left;
    let on_place = reserve(lane, u32(goes_on), parameters.on);
    let ended_place = reserve(lane, u32(ends), parameters.ended);
    let left_place = reserve(lane, u32(is_left), parameters.left);
    if (goes_on) {
        queues[parameters.on * parameters.slots + on_place] = slot;
    } else if (ends) {
        queues[parameters.ended * parameters.slots + ended_place] = slot;
    } else if (is_left) {
        queues[parameters.left * parameters.slots + left_place] = slot;
    }
}
