// Shades what the paths' rays met, one segment at a time, as in `vastlight-transport`, `path`, `primary` and `ao`: emission with
// multiple importance sampling, a light for each vertex and its shadow ray, the next direction, roulette.
//#include lights
//#include page_table
//#include path_queues
//#include pool
//#include random
//#include shading
//#include warp

struct Parameters {
    capacity: u32,
    depth: u32,
    full: u32,
    next: u32,
    waiting: u32,
    again: u32,
    max_depth: u32,
    integrator: u32,
    roulette: u32,
    direct_sampling: u32,
    ao_distance: f32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> tables: array<u32>;
@group(0) @binding(2) var<storage, read> lights: array<u32>;
@group(0) @binding(3) var<storage, read> pool_a: array<u32>;
@group(0) @binding(4) var<storage, read> pool_b: array<u32>;
@group(0) @binding(5) var<storage, read_write> page_table: array<atomic<u32>>;
@group(0) @binding(6) var<storage, read_write> paths: array<u32>;
@group(0) @binding(7) var<storage, read_write> queues: array<u32>;
@group(0) @binding(8) var<storage, read_write> tails: array<atomic<u32>>;

const SHADOWS: u32 = 2u;
const INTEGRATOR_DIRECT: u32 = 1u;
const INTEGRATOR_PRIMARY: u32 = 2u;
const INTEGRATOR_AO: u32 = 3u;
const SAMPLING_BOTH: u32 = 0u;
const SAMPLING_BSDF: u32 = 1u;
const SAMPLING_LIGHT: u32 = 2u;

const ROULETTE_DEPTH: u32 = 4u;
const MAX_PANES: u32 = 32u;
const ROULETTE_MAX: f32 = 0.95;
const WAVELENGTH_DIMENSION: u32 = 3u;
const VERTEX_DIMENSIONS: u32 = 5u;
const RANDOM_POINTS: u32 = VERTEX_DIMENSIONS + 1u;
const RANDOM_LIGHT: u32 = 0u;
const RANDOM_PLACE: u32 = 1u;
const RANDOM_LOBE: u32 = 2u;
const RANDOM_DIRECTION: u32 = 3u;
const RANDOM_ROULETTE: u32 = 4u;
const RANDOM_WAVELENGTH: u32 = 5u;

/// A path as it is shaded.
struct Path {
    slot: u32,
    throughput: vec3<f32>,
    normal: vec3<f32>,
    odds: LightOdds,
    pdf: f32,
    eta_squared: f32,
    media: MediumStack,
    panes: u32,
    cone: Cone,
    flags: u32,
    direction: vec3<f32>,
    /// Of this vertex: choice of light, place on it, choice of lobe, direction, roulette; and of the whole path: wavelength.
    random: array<vec2<f32>, RANDOM_POINTS>,
    /// Whether it waits for pages, whether there is a shadow ray, and whether the path goes on.
    waits: bool,
    has_shadow: bool,
    goes_on: bool,
}

fn load_path(slot: u32) -> Path {
    var path: Path;
    path.slot = slot;
    let key = vec2<u32>(path_word(PATH_SAMPLER, slot), path_word(PATH_SAMPLER + 1u, slot));
    let sampler = Sampler(key, path_word(PATH_SAMPLER + 2u, slot));
    path.throughput = path_vec3(PATH_THROUGHPUT, slot);
    path.normal = path_vec3(PATH_NORMAL, slot);
    let odds = path_vec3(PATH_ODDS, slot);
    path.odds = LightOdds(odds.x, odds.y, odds.z);
    path.pdf = path_f32(PATH_PDF, slot);
    path.eta_squared = path_f32(PATH_ETA_SQUARED, slot);
    for (var i = 0u; i < 4u; i++) {
        path.media[i] = path_word(PATH_MEDIA + i, slot);
    }
    path.panes = path_word(PATH_PANES, slot);
    path.cone = Cone(path_f32(PATH_CONE, slot), path_f32(PATH_CONE + 1u, slot));
    path.flags = path_word(PATH_FLAGS, slot);
    path.direction = path_vec3(PATH_RAY_DIRECTION, slot);
    let first = CAMERA_DIMENSIONS + (parameters.depth - 1u) * VERTEX_DIMENSIONS;
    // In a loop, since drivers inline every call.
    for (var i = 0u; i < RANDOM_POINTS; i++) {
        path.random[i] = point_at(sampler, select(first + i, WAVELENGTH_DIMENSION, i == RANDOM_WAVELENGTH));
    }
    return path;
}

/// Keeps what the next segment needs.
fn store_path(path: ptr<function, Path>) {
    let slot = (*path).slot;
    put_vec3(PATH_THROUGHPUT, slot, (*path).throughput);
    put_vec3(PATH_NORMAL, slot, (*path).normal);
    put_vec3(PATH_ODDS, slot, vec3<f32>((*path).odds.local, (*path).odds.background, (*path).odds.sun));
    put_f32(PATH_PDF, slot, (*path).pdf);
    put_f32(PATH_ETA_SQUARED, slot, (*path).eta_squared);
    for (var i = 0u; i < 4u; i++) {
        put_word(PATH_MEDIA + i, slot, (*path).media[i]);
    }
    put_word(PATH_PANES, slot, (*path).panes);
    put_f32(PATH_CONE, slot, (*path).cone.width);
    put_f32(PATH_CONE + 1u, slot, (*path).cone.spread);
    put_word(PATH_FLAGS, slot, (*path).flags);
}

/// The power heuristic with exponent 2.
fn power_heuristic(mine: f32, other: f32) -> f32 {
    let ratio = other / mine;
    return 1.0 / (1.0 + ratio * ratio);
}

fn weight_of_light(light: f32, bsdf: f32) -> f32 {
    switch (parameters.direct_sampling) {
        case SAMPLING_BOTH: { return power_heuristic(light, bsdf); }
        case SAMPLING_LIGHT: { return 1.0; }
        default: { return 0.0; }
    }
}

fn weight_of_bsdf(bsdf: f32, light: f32) -> f32 {
    if (!(light > 0.0)) {
        return 1.0;
    }
    switch (parameters.direct_sampling) {
        case SAMPLING_BOTH: { return power_heuristic(bsdf, light); }
        case SAMPLING_LIGHT: { return 0.0; }
        default: { return 1.0; }
    }
}

/// Radiance from infinity at the end of a path, weighted against light sampling.
fn background(path: ptr<function, Path>) -> vec3<f32> {
    let radiance = light_environment((*path).direction);
    var weight = 1.0;
    if ((*path).pdf > 0.0 && any(radiance != vec3<f32>(0.0))) {
        let light = light_density_of_direction((*path).odds, (*path).normal, (*path).direction);
        weight = weight_of_bsdf((*path).pdf, light);
    }
    return (*path).throughput * radiance * weight;
}

/// Weight of emission that the path's ray ran into, against light sampling at the last vertex.
fn seen_from(path: ptr<function, Path>, met: Meeting, position: vec3<f32>) -> f32 {
    if (!((*path).pdf > 0.0)) {
        return 1.0;
    }
    let last = path_vec3(PATH_ORIGIN, (*path).slot);
    let light =
        light_density_of_hit((*path).odds, last, (*path).normal, met.instance, met.prim, position);
    return weight_of_bsdf((*path).pdf, light);
}

/// Absorption on the way to the vertex.
fn absorption(path: ptr<function, Path>, vertex: ptr<function, Vertex>, distance: f32) -> vec3<f32> {
    let medium = medium_current((*path).media);
    if (medium != NO_MEDIUM) {
        return transmittance(medium_attenuation(medium), distance);
    }
    if (!(*vertex).outside && vertex_bounds_volume(vertex)) {
        return transmittance((*vertex).evaluated.attenuation, distance);
    }
    return vec3<f32>(1.0);
}

fn put_shadow(path: ptr<function, Path>, start: vec3<f32>, direction: vec3<f32>, length: f32, radiance: vec3<f32>) {
    let slot = (*path).slot;
    put_vec3(PATH_SHADOW_ORIGIN, slot, start);
    put_vec3(PATH_SHADOW_DIRECTION, slot, direction);
    put_f32(PATH_SHADOW_LENGTH, slot, length);
    put_vec3(PATH_SHADOW_RADIANCE, slot, radiance);
    (*path).has_shadow = true;
}

/// Next-event estimation: a shadow ray to the chosen light, and what it carries.
fn connect(path: ptr<function, Path>, vertex: ptr<function, Vertex>, bsdf: Bsdf, light: LightSample) {
    let wi = frame_to_local((*vertex).frame, light.wi);
    let outwards = dot(light.wi, (*vertex).surface.normal);
    if (!(wi.z * outwards > 0.0)) {
        return;
    }
    let value = bsdf_eval_pdf(bsdf, frame_to_local((*vertex).frame, (*vertex).wo), wi);
    var weight = 1.0;
    if ((light.flags & LIGHT_DELTA) == 0u) {
        weight = weight_of_light(light.pdf, value.w);
    }
    var radiance = (*path).throughput * value.xyz * light.radiance * (weight / light.pdf);
    if (!(max(max(radiance.x, radiance.y), radiance.z) > 0.0)) {
        return;
    }
    var media = (*path).media;
    if ((outwards >= 0.0) != (*vertex).outside) {
        media = vertex_media_behind(vertex, media);
    }
    let medium = medium_current(media);
    if (medium != NO_MEDIUM && light.distance < PATH_FAR) {
        radiance *= transmittance(medium_attenuation(medium), light.distance);
    }
    let length = shadow_length(vertex, light.distance);
    if (length > 0.0) {
        put_shadow(path, surface_origin((*vertex).surface, light.wi), light.wi, length, radiance);
    }
}

/// Russian roulette by the energy that the path still carries.
fn survives(path: ptr<function, Path>, u: f32) -> bool {
    let t = (*path).throughput;
    let probability = min(max(max(t.x, t.y), t.z) * (*path).eta_squared, ROULETTE_MAX);
    if (u >= probability) {
        return false;
    }
    (*path).throughput /= probability;
    return true;
}

/// Draws the next direction and moves the path over the surface.
fn continue_path(path: ptr<function, Path>, vertex: ptr<function, Vertex>, bsdf: Bsdf, light_normal: vec3<f32>,
    odds: LightOdds, ends: bool) {
    let wo = frame_to_local((*vertex).frame, (*vertex).wo);
    let next = bsdf_sample(bsdf, wo, (*path).random[RANDOM_LOBE].x, (*path).random[RANDOM_DIRECTION]);
    if ((next.flags & BSDF_VALID) == 0u) {
        return;
    }
    let direction = frame_to_outer((*vertex).frame, next.wi);
    let outwards = dot(direction, (*vertex).surface.normal);
    if (next.wi.z * outwards <= 0.0 || !(max(max(next.weight.x, next.weight.y), next.weight.z) > 0.0)) {
        return;
    }
    let delta = (next.flags & BSDF_DELTA) != 0u;
    let transmitted = (next.flags & BSDF_TRANSMITTED) != 0u;
    (*path).throughput *= next.weight;
    (*path).eta_squared *= next.radiance_scale;
    let straight = delta && transmitted && bsdf_is_pane(bsdf);
    if (!straight) {
        (*path).pdf = select(next.pdf, 0.0, delta);
        (*path).cone = cone_scattered((*path).cone, (*path).pdf);
    }
    (*path).flags |= select(PATH_SCATTERED, 0u, delta);
    (*path).flags |= select(0u, PATH_DISPERSED, (next.flags & BSDF_DISPERSED) != 0u);
    if (transmitted) {
        (*path).media = vertex_media_behind(vertex, (*path).media);
    }
    if (ends && !straight) {
        return;
    }
    if (straight) {
        (*path).panes += select(0u, 1u, (*path).panes < MAX_PANES);
    } else {
        put_vec3(PATH_ORIGIN, (*path).slot, (*vertex).surface.position);
        (*path).normal = light_normal;
        (*path).odds = odds;
    }
    let roulette = parameters.roulette != 0u && parameters.depth >= ROULETTE_DEPTH;
    if (roulette && !survives(path, (*path).random[RANDOM_ROULETTE].x)) {
        return;
    }
    put_vec3(PATH_RAY_ORIGIN, (*path).slot, surface_origin((*vertex).surface, direction));
    put_vec3(PATH_RAY_DIRECTION, (*path).slot, direction);
    store_path(path);
    (*path).goes_on = true;
}

/// The first surface under a light at the camera.
fn shade_primary(path: ptr<function, Path>, vertex: ptr<function, Vertex>, bsdf: Bsdf) {
    let facing = max(dot(vertex_facing_normal(vertex), (*vertex).wo), 0.0);
    add_radiance((*path).slot, vertex_emission(vertex) + bsdf_albedo(bsdf) * (0.2 + 0.8 * facing));
}

/// The part of the hemisphere over the first surface in which nothing stands nearer than a distance.
fn shade_ao(path: ptr<function, Path>, vertex: ptr<function, Vertex>) {
    let local = warp_cosine_hemisphere((*path).random[0]);
    let direction = frame_to_outer(frame_from_z(vertex_facing_normal(vertex)), local);
    if (dot(direction, vertex_facing_side(vertex)) > 0.0) {
        let start = surface_origin((*vertex).surface, direction);
        put_shadow(path, start, direction, parameters.ao_distance, vec3<f32>(1.0));
    }
}

/// The end of a path whose ray met nothing.
fn leave(path: ptr<function, Path>) {
    if (parameters.integrator == INTEGRATOR_AO) {
        add_radiance((*path).slot, vec3<f32>(1.0));
    } else if (parameters.integrator == INTEGRATOR_PRIMARY) {
        add_radiance((*path).slot, vec3<f32>(0.35 + 0.25 * clamp((*path).direction.y, -1.0, 1.0)));
    } else if (parameters.depth - (*path).panes <= parameters.max_depth) {
        add_radiance((*path).slot, background(path));
    }
}

/// A path at a vertex: emission, light, and on.
fn scatter(path: ptr<function, Path>, vertex: ptr<function, Vertex>, bsdf: Bsdf, met: Meeting) {
    let length = parameters.depth - (*path).panes;
    if (length > parameters.max_depth) {
        return;
    }
    let emission = vertex_emission(vertex);
    if (any(emission != vec3<f32>(0.0))) {
        let seen = seen_from(path, met, (*vertex).surface.position);
        add_radiance((*path).slot, (*path).throughput * emission * seen);
    }
    let scattered = ((*path).flags & PATH_SCATTERED) != 0u;
    let ends = length >= parameters.max_depth || (parameters.integrator == INTEGRATOR_DIRECT && scattered);
    if (ends && !bsdf_is_pane(bsdf)) {
        return;
    }
    let light_normal = select(vertex_facing_normal(vertex), vec3<f32>(0.0), bsdf_transmits(bsdf));
    var odds = LightOdds(0.0, 0.0, 0.0);
    (*path).cone = cone_moved((*path).cone, met.t);
    if (bsdf_has_nondelta(bsdf) && !ends) {
        let pick = (*path).random[RANDOM_LIGHT].x;
        let answer = light_sample((*vertex).surface.position, light_normal, pick, (*path).random[RANDOM_PLACE]);
        odds = answer.odds;
        if ((answer.sample.flags & LIGHT_VALID) != 0u) {
            connect(path, vertex, bsdf, answer.sample);
        }
    }
    continue_path(path, vertex, bsdf, light_normal, odds, ends);
}

/// What the path's ray met.
fn path_meeting(slot: u32) -> Meeting {
    let weights = vec2<f32>(path_f32(PATH_HIT + 1u, slot), path_f32(PATH_HIT + 2u, slot));
    let place = TrianglePlace(path_word(PATH_BLOCK, slot), path_word(PATH_BLOCK + 1u, slot));
    var corners: array<vec3<f32>, 3>;
    for (var corner = 0u; corner < 3u; corner++) {
        corners[corner] = path_vec3(PATH_CORNERS + 3u * corner, slot);
    }
    let t = path_f32(PATH_HIT, slot);
    return Meeting(t, weights, path_word(PATH_HIT + 3u, slot), path_word(PATH_HIT + 4u, slot), place, corners);
}

/// Shades one path.
fn shade(path: ptr<function, Path>) {
    let slot = (*path).slot;
    let met = path_meeting(slot);
    if (met.prim == NO_HIT) {
        leave(path);
        return;
    }
    var vertex = vertex_at(met, (*path).direction, (*path).cone);
    if (lacks) {
        (*path).waits = true;
        return;
    }
    (*path).throughput *= absorption(path, &vertex, met.t);
    let dispersed = ((*path).flags & PATH_DISPERSED) != 0u;
    let bsdf = bsdf_new(vertex_params(&vertex, (*path).random[RANDOM_WAVELENGTH].x, (*path).media, dispersed));
    if (parameters.depth == 1u) {
        describe(slot, &vertex, bsdf, (*path).direction, met);
    }
    if (parameters.integrator == INTEGRATOR_PRIMARY) {
        shade_primary(path, &vertex, bsdf);
    } else if (parameters.integrator == INTEGRATOR_AO) {
        shade_ao(path, &vertex);
    } else {
        scatter(path, &vertex, bsdf, met);
    }
}

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    var path: Path;
    if (id.x < atomicLoad(&tails[parameters.full])) {
        path = load_path(take_path(id.x));
        shade(&path);
    }
    enqueue(lane, SHADOWS, path.slot, path.has_shadow);
    enqueue(lane, parameters.next, path.slot, path.goes_on);
    enqueue(lane, parameters.waiting, path.slot, path.waits);
}
