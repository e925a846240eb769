// Photons that arrive at surfaces: they land where light may leave in all directions, and go on in narrow lobes alone, as in
// `vastlight-transport`, `photon::flight`. A photon has a slot for each of its first landings; those that it does not need keep a
// place that is no number.
//#include bsdf/focus
//#include page_table
//#include path_state
//#include photon_direction
//#include photon_flight
//#include photon_words
//#include pool_one
//#include queue
//#include stream_put
//#include vertex

struct Parameters {
    slots: u32,
    capacity: u32,
    full: u32,
    next: u32,
    photons: u32,
    pass_first: u32,
    seed: u32,
    landings: u32,
    max_depth: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> tables: array<u32>;
@group(0) @binding(2) var<storage, read> pool_a: array<u32>;
@group(0) @binding(3) var<storage, read_write> page_table: array<atomic<u32>>;
@group(0) @binding(4) var<storage, read_write> paths: array<u32>;
@group(0) @binding(5) var<storage, read_write> streams: array<u32>;
@group(0) @binding(6) var<storage, read_write> queues: array<u32>;
@group(0) @binding(7) var<storage, read_write> tails: array<atomic<u32>>;
@group(0) @binding(8) var<storage, read_write> photons: array<u32>;

/// Counters: photons' rays.
const RAYS: u32 = 5u;
const MAX_PANES: u32 = 32u;
const CAMERA_DIMENSIONS: u32 = 4u;
const WAVELENGTH_DIMENSION: u32 = 3u;
/// Dimensions of a start, and of a vertex: choice of lobe, direction, roulette; and the wavelength of the whole way.
const PHOTON_START_DIMENSIONS: u32 = 2u;
const PHOTON_DIMENSIONS: u32 = 3u;
const PHOTON_POINTS: u32 = 4u;
/// Flags: whether a narrow lobe has sent the photon on; landings are counted from a bit on.
const PHOTON_FOCUSED: u32 = 128u;
const LANDED_SHIFT: u32 = 8u;

/// A photon as it arrives.
struct Flying {
    slot: u32,
    number: u32,
    depth: u32,
    flux: vec3<f32>,
    media: MediumStack,
    panes: u32,
    flags: u32,
    random: array<vec2<f32>, PHOTON_POINTS>,
}

fn load_photon(slot: u32) -> Flying {
    var photon: Flying;
    photon.slot = slot;
    photon.number = stream_word(STREAM_SAMPLE, slot);
    photon.depth = stream_word(STREAM_NODE, slot);
    photon.flux = stream_vec3(STREAM_WEIGHT, slot);
    for (var i = 0u; i < 4u; i++) {
        photon.media[i] = path_word(PATH_MEDIA + i, slot);
    }
    photon.panes = path_word(PATH_PANES, slot);
    photon.flags = path_word(PATH_FLAGS, slot);
    let sampler = photon_sampler(photon.number);
    let first = CAMERA_DIMENSIONS + PHOTON_START_DIMENSIONS + (photon.depth - 1u) * PHOTON_DIMENSIONS;
    // In a loop, since drivers inline every call.
    for (var i = 0u; i < PHOTON_POINTS; i++) {
        photon.random[i] = point_at(sampler, select(first + i, WAVELENGTH_DIMENSION, i == PHOTON_DIMENSIONS));
    }
    return photon;
}

/// Absorption on the way to the vertex.
fn absorbed(photon: ptr<function, Flying>, vertex: ptr<function, Vertex>, distance: f32) {
    let medium = medium_current((*photon).media);
    if (medium != NO_MEDIUM) {
        (*photon).flux *= transmittance(medium_attenuation(medium), distance);
    } else if (!(*vertex).outside && vertex_bounds_volume(vertex)) {
        (*photon).flux *= transmittance((*vertex).evaluated.attenuation, distance);
    }
}

/// Keeps a photon where it lands.
fn land(photon: ptr<function, Flying>, vertex: ptr<function, Vertex>, segments: u32) {
    let landed = (*photon).flags >> LANDED_SHIFT;
    if (landed >= parameters.landings) {
        return;
    }
    (*photon).flags += 1u << LANDED_SHIFT;
    let at = (landed * parameters.photons + (*photon).number) * PHOTON_WORDS;
    let told = min(segments, 255u);
    for (var i = 0u; i < 3u; i++) {
        photons[at + i] = bitcast<u32>((*vertex).surface.position[i]);
        photons[at + PHOTON_FLUX + i] = bitcast<u32>((*photon).flux[i]);
    }
    photons[at + PHOTON_FROM] = direction_pack((*vertex).wo, told);
    photons[at + PHOTON_NORMAL] = direction_pack(vertex_facing_side(vertex), told >> 4u);
}

/// Sends a photon on in a narrow lobe; whether it goes on. It carries power, not radiance.
fn bounce(photon: ptr<function, Flying>, vertex: ptr<function, Vertex>, bsdf: Bsdf) -> bool {
    let wo = frame_to_local((*vertex).frame, (*vertex).wo);
    let next = bsdf_sample(bsdf, wo, (*photon).random[0].x, (*photon).random[1]);
    let direction = frame_to_outer((*vertex).frame, next.wi);
    let outwards = dot(direction, (*vertex).surface.normal);
    let delta = (next.flags & BSDF_DELTA) != 0u;
    let transmitted = (next.flags & BSDF_TRANSMITTED) != 0u;
    if ((next.flags & BSDF_VALID) == 0u || next.wi.z * outwards <= 0.0 || !(delta || bsdf_focuses(bsdf))) {
        return false;
    }
    let inwards = dot((*vertex).wo, (*vertex).surface.normal);
    let shading = abs(wo.z * outwards / (inwards * next.wi.z));
    let factor = next.weight * (next.radiance_scale * shading);
    let survival = min(max(max(factor.x, factor.y), factor.z), 1.0);
    if (!((*photon).random[2].x < survival)) {
        return false;
    }
    (*photon).flux *= factor / survival;
    let straight = delta && transmitted && bsdf_is_pane(bsdf);
    (*photon).panes += select(0u, 1u, straight && (*photon).panes < MAX_PANES);
    (*photon).flags |= select(PHOTON_FOCUSED, 0u, straight);
    (*photon).flags |= select(0u, PATH_DISPERSED, (next.flags & BSDF_DISPERSED) != 0u);
    if (transmitted) {
        (*photon).media = vertex_media_behind(vertex, (*photon).media);
    }
    if (!real_is_finite3((*photon).flux)) {
        return false;
    }
    send(photon, surface_origin((*vertex).surface, direction), direction);
    return true;
}

/// Puts a photon that goes on into its slot.
fn send(photon: ptr<function, Flying>, origin: vec3<f32>, direction: vec3<f32>) {
    let slot = (*photon).slot;
    let depth = (*photon).depth + 1u;
    let key = photon_ray_key((*photon).number, depth);
    put_stream_ray(slot, StreamRay(origin, direction, PATH_FAR, (*photon).flux, (*photon).number, depth, key));
    for (var i = 0u; i < 4u; i++) {
        put_word(PATH_MEDIA + i, slot, (*photon).media[i]);
    }
    put_word(PATH_PANES, slot, (*photon).panes);
    put_word(PATH_FLAGS, slot, (*photon).flags);
}

/// The photon in a slot arrives; whether it goes on.
fn arrive(slot: u32) -> bool {
    let prim = stream_word(STREAM_HIT + 4u, slot);
    if (prim == NO_HIT) {
        return false;
    }
    var photon = load_photon(slot);
    let weights = vec2<f32>(stream_f32(STREAM_HIT + 1u, slot), stream_f32(STREAM_HIT + 2u, slot));
    let met = meeting_by_number(stream_f32(STREAM_HIT, slot), weights, stream_word(STREAM_HIT + 3u, slot), prim);
    var vertex = vertex_at(met, stream_vec3(STREAM_DIRECTION, slot), Cone(0.0, 0.0));
    absorbed(&photon, &vertex, met.t);
    let segments = photon.depth - photon.panes;
    // The eye adds one at least.
    if (segments >= parameters.max_depth) {
        return false;
    }
    let dispersed = (photon.flags & PATH_DISPERSED) != 0u;
    let bsdf = bsdf_new(vertex_params(&vertex, photon.random[PHOTON_DIMENSIONS].x, photon.media, dispersed));
    if ((photon.flags & PHOTON_FOCUSED) != 0u && bsdf_receives(bsdf)) {
        land(&photon, &vertex, segments);
    }
    return bounce(&photon, &vertex, bsdf);
}

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    var slot = 0u;
    var goes_on = false;
    if (id.x < atomicLoad(&tails[parameters.full])) {
        slot = queues[parameters.full * parameters.slots + id.x];
        goes_on = arrive(slot);
    }
    let place = reserve(lane, u32(goes_on), parameters.next);
    _ = reserve(lane, u32(goes_on), RAYS);
    if (goes_on) {
        queues[parameters.next * parameters.slots + place] = slot;
    }
}
