// The light of photons at the surfaces that rays of the stream tracer met, added to their samples before `stream_shade` derives new
// rays, as in `vastlight-transport`, `stream::shade`, `of_photons`. A kernel of its own, since no kernel may see more than eight
// buffers.
//#include bsdf/focus
//#include group
//#include page_table
//#include phong
//#include photon_gather
//#include pool_one
//#include stream_state
//#include stream_sum

struct Parameters {
    slots: u32,
    full: u32,
    max_depth: u32,
    first: u32,
    end: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> tables: array<u32>;
@group(0) @binding(2) var<storage, read> photon_map: array<u32>;
@group(0) @binding(3) var<storage, read> voxels: array<vec2<u32>>;
@group(0) @binding(4) var<storage, read> pool_a: array<u32>;
@group(0) @binding(5) var<storage, read_write> page_table: array<atomic<u32>>;
@group(0) @binding(6) var<storage, read> streams: array<u32>;
@group(0) @binding(7) var<storage, read> queues: array<u32>;
@group(0) @binding(8) var<storage, read_write> tails: array<atomic<u32>>;

/// Cosine between the normals of a photon's surface and the vertex's, below which they are not one surface.
const SAME_SURFACE: f32 = 0.7;

/// The surface that light of photons leaves: its colours, its normal, its shading normal on the side of the ray, the mirror image of the
/// ray, and with how many segments photons count.
struct Receiver {
    phong: Phong,
    normal: vec3<f32>,
    facing: vec3<f32>,
    mirrored: vec3<f32>,
    most_segments: u32,
}

var<private> receiver: Receiver;

fn of_near(near: Near) -> vec3<f32> {
    let same_surface = abs(dot(near.normal, receiver.normal)) >= SAME_SURFACE;
    let lit = dot(near.wi, near.normal) > 0.0 && dot(near.wi, receiver.facing) > 0.0;
    if (!same_surface || !lit || near.segments > receiver.most_segments) {
        return vec3<f32>(0.0);
    }
    return phong_local(receiver.phong, dot(receiver.mirrored, near.wi), true) * near.flux * near.weight;
}

/// The light of photons that the ray in a slot brings to its sample.
fn light_of_photons(slot: u32, depth: u32) -> vec3<f32> {
    let weights = vec2<f32>(stream_f32(STREAM_HIT + 1u, slot), stream_f32(STREAM_HIT + 2u, slot));
    let instance = stream_word(STREAM_HIT + 3u, slot);
    let met = meeting_by_number(stream_f32(STREAM_HIT, slot), weights, instance, stream_word(STREAM_HIT + 4u, slot));
    var vertex = vertex_at(met, stream_vec3(STREAM_DIRECTION, slot), Cone(0.0, 0.0));
    if (!bsdf_receives(bsdf_new(vertex.evaluated.params))) {
        return vec3<f32>(0.0);
    }
    var weight = stream_vec3(STREAM_WEIGHT, slot);
    if (!vertex.outside && vertex_bounds_volume(&vertex)) {
        weight *= transmittance(vertex.evaluated.attenuation, met.t);
    }
    let facing = vertex_facing_normal(&vertex);
    let mirrored = facing * (2.0 * dot(facing, vertex.wo)) - vertex.wo;
    let most_segments = parameters.max_depth - depth;
    receiver = Receiver(phong_new(vertex.evaluated), vertex.surface.normal, facing, mirrored, most_segments);
    gather_part = vec2<u32>(parameters.first, parameters.end);
    return weight * gather(vertex.surface.position);
}

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= atomicLoad(&tails[parameters.full])) {
        return;
    }
    let slot = queues[parameters.full * parameters.slots + id.x];
    let node = stream_word(STREAM_NODE, slot);
    let depth = 32u - countLeadingZeros(node);
    let met = stream_word(STREAM_HIT + 4u, slot) != STREAM_NONE;
    if (node == 0u || !met || depth > parameters.max_depth) {
        return;
    }
    let seen = light_of_photons(slot, depth);
    if (any(seen != vec3<f32>(0.0))) {
        sum_add(stream_word(STREAM_SAMPLE, slot), seen);
    }
}
