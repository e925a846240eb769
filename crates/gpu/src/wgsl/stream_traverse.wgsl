// The second kernel of the stream tracer: brings each ray of a queue to its next leaf, and hands it on to intersection, or to
// shading when its way has ended.
//#include queue
//#include stream_walk
//#include unsettled

struct Parameters {
    slots: u32,
    full: u32,
    on: u32,
    ended: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> tree: array<u32>;
@group(0) @binding(2) var<storage, read_write> streams: array<u32>;
@group(0) @binding(3) var<storage, read_write> queues: array<u32>;
@group(0) @binding(4) var<storage, read_write> tails: array<atomic<u32>>;

fn stream_place(slot: u32) -> KdPlace {
    var seen: vec4<u32>;
    for (var i = 0u; i < 4u; i++) {
        seen[i] = stream_word(STREAM_PLACE + 6u + i, slot);
    }
    return KdPlace(
        stream_word(STREAM_PLACE, slot),
        stream_word(STREAM_PLACE + 1u, slot),
        stream_f32(STREAM_PLACE + 2u, slot),
        stream_word(STREAM_PLACE + 3u, slot),
        stream_word(STREAM_PLACE + 4u, slot),
        stream_f32(STREAM_PLACE + 5u, slot),
        seen,
    );
}

fn put_stream_place(slot: u32, place: KdPlace) {
    put_stream_word(STREAM_PLACE, slot, place.instance);
    put_stream_word(STREAM_PLACE + 1u, slot, place.leaf);
    put_stream_f32(STREAM_PLACE + 2u, slot, place.safe);
    put_stream_word(STREAM_PLACE + 3u, slot, place.top_leaf);
    put_stream_word(STREAM_PLACE + 4u, slot, place.top_item);
    put_stream_f32(STREAM_PLACE + 5u, slot, place.top_safe);
    for (var i = 0u; i < 4u; i++) {
        put_stream_word(STREAM_PLACE + 6u + i, slot, place.seen[i]);
    }
}

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    var slot = 0u;
    var goes_on = false;
    let held = id.x < atomicLoad(&tails[parameters.full]);
    if (held) {
        slot = queues[parameters.full * parameters.slots + id.x];
        let world = stream_world(slot);
        var place = stream_place(slot);
        goes_on = kd_advance(world, world.t_max, &place);
        put_stream_place(slot, place);
    }
    let on_place = reserve(lane, u32(goes_on), parameters.on);
    let ended_place = reserve(lane, u32(held && !goes_on), parameters.ended);
    if (goes_on) {
        queues[parameters.on * parameters.slots + on_place] = slot;
    } else if (held) {
        queues[parameters.ended * parameters.slots + ended_place] = slot;
    }
}
