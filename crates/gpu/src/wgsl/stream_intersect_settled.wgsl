// The third kernel of the stream tracer for the rays that `stream_intersect` leaves: surfaces are there or not by alpha, and shadow
// rays pass what is clear.
//#include page_table
//#include pool_one
//#include queue
//#include settled
//#include stream_leaf
//#include veils

struct Parameters {
    slots: u32,
    full: u32,
    on: u32,
    ended: u32,
    has_photons: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> tree: array<u32>;
@group(0) @binding(2) var<storage, read> blocks: array<u32>;
@group(0) @binding(3) var<storage, read> tables: array<u32>;
@group(0) @binding(4) var<storage, read> pool_a: array<u32>;
@group(0) @binding(5) var<storage, read_write> page_table: array<atomic<u32>>;
@group(0) @binding(6) var<storage, read_write> streams: array<u32>;
@group(0) @binding(7) var<storage, read_write> queues: array<u32>;
@group(0) @binding(8) var<storage, read_write> tails: array<atomic<u32>>;

/// Of the ray on its way: its key, and whether it is a shadow ray.
var<private> ray_key: u32;
var<private> ray_is_shadow: bool;

fn accepts(hit: Hit, veiled: bool) -> bool {
    if (!veiled) {
        return true;
    }
    let material = material_of(material_of_triangle(mesh_record(hit.instance), hit.prim));
    if (ray_is_shadow && parameters.has_photons == 0u && (tables[material] & FLAG_CLEAR) != 0u) {
        return false;
    }
    return alpha_is_there(meeting_by_number(hit.t, vec2<f32>(hit.u, hit.v), hit.instance, hit.prim), ray_key);
}

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    var slot = 0u;
    var ends = false;
    let held = id.x < atomicLoad(&tails[parameters.full]);
    if (held) {
        slot = queues[parameters.full * parameters.slots + id.x];
        ray_key = stream_word(STREAM_KEY, slot);
        ray_is_shadow = stream_is_shadow(slot);
        var best = stream_hit(slot);
        ends = stream_test(slot, &best) && ray_is_shadow;
        put_stream_hit(slot, best);
    }
    let on_place = reserve(lane, u32(held && !ends), parameters.on);
    let ended_place = reserve(lane, u32(ends), parameters.ended);
    if (ends) {
        queues[parameters.ended * parameters.slots + ended_place] = slot;
    } else if (held) {
        queues[parameters.on * parameters.slots + on_place] = slot;
    }
}
