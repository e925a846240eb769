// The fourth kernel of the stream tracer: shades rays whose way has ended and derives new ones, mirrored, refracted and to a light, as
// in `vastlight-transport`, `stream::shade`.
//#include lights
//#include page_table
//#include phong
//#include pool_one
//#include queue
//#include random
//#include shading
//#include stream_put
//#include stream_sum

struct Parameters {
    slots: u32,
    capacity: u32,
    full: u32,
    next: u32,
    max_depth: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> tables: array<u32>;
@group(0) @binding(2) var<storage, read> lights: array<u32>;
@group(0) @binding(3) var<storage, read> pool_a: array<u32>;
@group(0) @binding(4) var<storage, read_write> page_table: array<atomic<u32>>;
@group(0) @binding(5) var<storage, read_write> paths: array<u32>;
@group(0) @binding(6) var<storage, read_write> streams: array<u32>;
@group(0) @binding(7) var<storage, read_write> queues: array<u32>;
@group(0) @binding(8) var<storage, read_write> tails: array<atomic<u32>>;

/// Counters: slots that were given out, rays and shadow rays that were derived.
const SLOTS: u32 = 4u;
const RAYS: u32 = 5u;
const SHADOW_RAYS: u32 = 6u;
/// Rays that carry less are not derived.
const FAINTEST: f32 = 1.0 / 512.0;
/// Rays are numbered by their way through the tree of a sample in 32 bits.
const DEEPEST: u32 = 31u;

/// Rays derived at one hit.
struct Derived {
    rays: array<StreamRay, 3>,
    count: u32,
    shadows: u32,
}

fn largest_channel(v: vec3<f32>) -> f32 {
    return max(max(v.x, v.y), v.z);
}

fn push_derived(derived: ptr<function, Derived>, ray: StreamRay) {
    (*derived).rays[(*derived).count] = ray;
    (*derived).count++;
}

/// What goes on from a surface, mirrored (0) or refracted (1).
fn go_on(load: StreamRay, vertex: ptr<function, Vertex>, direction: vec3<f32>, weight: vec3<f32>, kind: u32,
    derived: ptr<function, Derived>) {
    let carried = load.weight * weight;
    if (largest_channel(carried) >= FAINTEST) {
        let origin = surface_origin((*vertex).surface, direction);
        let node = 2u * load.node + kind;
        let key = load.key * 0x9e3779b9u + node;
        push_derived(derived, StreamRay(origin, direction, PATH_FAR, carried, load.sample, node, key));
    }
}

/// The mirrored and the refracted ray.
fn derive(load: StreamRay, vertex: ptr<function, Vertex>, phong: Phong, mirrored: vec3<f32>, derived: ptr<function, Derived>) {
    let parting = phong_part(phong, (*vertex).wo, vertex_facing_normal(vertex), (*vertex).outside);
    let side = vertex_facing_side(vertex);
    if (dot(mirrored, side) > 0.0) {
        go_on(load, vertex, mirrored, parting.mirrored, 0u, derived);
    }
    if (parting.refracts && dot(parting.direction, side) < 0.0) {
        go_on(load, vertex, parting.direction, parting.refracted, 1u, derived);
    }
}

/// A shadow ray to a light, with what it adds if nothing is in its way.
fn derive_shadow(load: StreamRay, vertex: ptr<function, Vertex>, phong: Phong, mirrored: vec3<f32>, derived: ptr<function, Derived>) {
    let normal = vertex_facing_normal(vertex);
    let key = vec2<u32>(path_word(PATH_SAMPLER, load.sample), path_word(PATH_SAMPLER + 1u, load.sample));
    let sampler = Sampler(key, path_word(PATH_SAMPLER + 2u, load.sample));
    // Each ray of the tree has two dimensions of its own.
    let first = CAMERA_DIMENSIONS + 2u * load.node;
    // In a loop, since drivers inline every call.
    var random: array<vec2<f32>, 2>;
    for (var i = 0u; i < 2u; i++) {
        random[i] = point_at(sampler, first + i);
    }
    let light = light_sample((*vertex).surface.position, normal, random[0].x, random[1]).sample;
    if ((light.flags & LIGHT_VALID) == 0u) {
        return;
    }
    let outwards = dot(light.wi, (*vertex).surface.normal);
    let cos_theta = dot(light.wi, normal);
    if (!(frame_to_local((*vertex).frame, light.wi).z * outwards > 0.0) || cos_theta <= 0.0) {
        return;
    }
    let local = phong_local(phong, dot(mirrored, light.wi), (light.flags & LIGHT_DELTA) != 0u);
    let weight = load.weight * (local * light.radiance * (cos_theta / light.pdf));
    let length = shadow_length(vertex, light.distance);
    if (largest_channel(weight) > 0.0 && length > 0.0) {
        let origin = surface_origin((*vertex).surface, light.wi);
        push_derived(derived, StreamRay(origin, light.wi, length, weight, load.sample, 0u, load.key ^ 0x5bd1e995u));
        (*derived).shadows = 1u;
    }
}

/// Shades the ray in a slot, if it met a surface within its depth.
fn shade_surface(slot: u32, given: StreamRay, depth: u32, derived: ptr<function, Derived>) -> vec3<f32> {
    let weights = vec2<f32>(stream_f32(STREAM_HIT + 1u, slot), stream_f32(STREAM_HIT + 2u, slot));
    let instance = stream_word(STREAM_HIT + 3u, slot);
    let met = meeting_by_number(stream_f32(STREAM_HIT, slot), weights, instance, stream_word(STREAM_HIT + 4u, slot));
    var load = given;
    var vertex = vertex_at(met, load.direction, Cone(0.0, 0.0));
    if (depth == 1u) {
        describe(load.sample, &vertex, bsdf_new(vertex.evaluated.params), load.direction, met);
    }
    if (!vertex.outside && vertex_bounds_volume(&vertex)) {
        load.weight *= transmittance(vertex.evaluated.attenuation, met.t);
    }
    if (depth < min(parameters.max_depth, DEEPEST)) {
        let phong = phong_new(vertex.evaluated);
        let normal = vertex_facing_normal(&vertex);
        let mirrored = normal * (2.0 * dot(normal, vertex.wo)) - vertex.wo;
        derive(load, &vertex, phong, mirrored, derived);
        derive_shadow(load, &vertex, phong, mirrored, derived);
    }
    return load.weight * vertex_emission(&vertex);
}

/// Shades the ray in a slot.
fn shade(slot: u32, derived: ptr<function, Derived>) {
    var load: StreamRay;
    load.direction = stream_vec3(STREAM_DIRECTION, slot);
    load.weight = stream_vec3(STREAM_WEIGHT, slot);
    load.sample = stream_word(STREAM_SAMPLE, slot);
    load.node = stream_word(STREAM_NODE, slot);
    load.key = stream_word(STREAM_KEY, slot);
    let is_free = stream_word(STREAM_HIT + 4u, slot) == NO_HIT;
    let depth = 32u - countLeadingZeros(load.node);
    var seen = vec3<f32>(0.0);
    if (load.node == 0u) {
        seen = select(vec3<f32>(0.0), load.weight, is_free);
    } else if (depth <= parameters.max_depth) {
        if (is_free) {
            seen = load.weight * light_environment(load.direction);
        } else {
            seen = shade_surface(slot, load, depth, derived);
        }
    }
    if (!all(seen == vec3<f32>(0.0))) {
        sum_add(load.sample, seen);
    }
}

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    var derived: Derived;
    var slot = 0u;
    if (id.x < atomicLoad(&tails[parameters.full])) {
        slot = queues[parameters.full * parameters.slots + id.x];
        shade(slot, &derived);
    }
    // The first ray takes the place of the one that ended.
    let further = reserve(lane, max(derived.count, 1u) - 1u, SLOTS);
    let place = reserve(lane, derived.count, parameters.next);
    _ = reserve(lane, derived.count - derived.shadows, RAYS);
    _ = reserve(lane, derived.shadows, SHADOW_RAYS);
    for (var i = 0u; i < derived.count; i++) {
        let room = select(further + i - 1u, slot, i == 0u);
        // Where there are too few slots the host starts again with fewer samples.
        if (room < parameters.slots && place + i < parameters.slots) {
            put_stream_ray(room, derived.rays[i]);
            queues[parameters.next * parameters.slots + place + i] = room;
        }
    }
}
