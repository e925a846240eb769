// Photons that leave point lights through a regular grid on a rectangle before each, one through the middle of each square and none at
// random: D. Bogolepov, D. Sopin, V. Turlapov 2010, section 2.1, as in `vastlight-transport`, `photon::rectangle`.
//#include light_punctual
//#include path_state
//#include photon_flight
//#include photon_words
//#include queue
//#include stream_put

struct Parameters {
    slots: u32,
    capacity: u32,
    count: u32,
    first: u32,
    photons: u32,
    columns: u32,
    rows: u32,
    shift_x: f32,
    shift_y: f32,
    pass_first: u32,
    seed: u32,
    landings: u32,
    next: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> lights: array<u32>;
@group(0) @binding(2) var<storage, read> rectangles: array<u32>;
@group(0) @binding(3) var<storage, read_write> paths: array<u32>;
@group(0) @binding(4) var<storage, read_write> streams: array<u32>;
@group(0) @binding(5) var<storage, read_write> queues: array<u32>;
@group(0) @binding(6) var<storage, read_write> tails: array<atomic<u32>>;
@group(0) @binding(7) var<storage, read_write> photons: array<u32>;

/// A rectangle: its frame, its least corner, the sides of a square of its grid.
const RECTANGLE_WORDS: u32 = 13u;
/// Counters: photons' rays.
const RAYS: u32 = 5u;
const NO_NUMBER: u32 = 0x7fc00000u;

fn rectangle_vec3(at: u32) -> vec3<f32> {
    return vec3<f32>(bitcast<f32>(rectangles[at]), bitcast<f32>(rectangles[at + 1u]), bitcast<f32>(rectangles[at + 2u]));
}

fn rectangle_vec2(at: u32) -> vec2<f32> {
    return vec2<f32>(bitcast<f32>(rectangles[at]), bitcast<f32>(rectangles[at + 1u]));
}

/// The photon of a number: its ray, with its power.
fn photon_ray(number: u32) -> StreamRay {
    let each = parameters.columns * parameters.rows;
    let light = lights[LIGHT_PUNCTUAL] + number / each * LIGHT_PUNCTUAL_WORDS;
    let rectangle = number / each * RECTANGLE_WORDS;
    let square = vec2<f32>(vec2<u32>(number % each % parameters.columns, number % each / parameters.columns));
    let step = rectangle_vec2(rectangle + 11u);
    let shift = vec2<f32>(parameters.shift_x, parameters.shift_y);
    let at = rectangle_vec2(rectangle + 9u) + (square + 0.5 + shift) * step;
    let squared = 1.0 + dot(at, at);
    let frame = Frame(rectangle_vec3(rectangle), rectangle_vec3(rectangle + 3u), rectangle_vec3(rectangle + 6u));
    let direction = frame_to_outer(frame, vec3<f32>(at, 1.0)) / sqrt(squared);
    // Seen from the light, a square is smaller by its distance and its slant.
    let flux = light_intensity(light, direction) * (step.x * step.y / (squared * sqrt(squared)));
    let key = photon_ray_key(number, 1u);
    return StreamRay(light_vec3(light), direction, PATH_FAR, flux, number, 1u, key);
}

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let slot = id.x;
    var flies = false;
    if (slot < parameters.count) {
        let ray = photon_ray(parameters.first + slot);
        flies = real_is_finite3(ray.weight) && any(ray.weight != vec3<f32>(0.0));
        put_stream_ray(slot, ray);
        for (var i = 0u; i < 4u; i++) {
            put_word(PATH_MEDIA + i, slot, NO_HIT);
        }
        put_word(PATH_PANES, slot, 0u);
        put_word(PATH_FLAGS, slot, 0u);
        for (var i = 0u; i < parameters.landings; i++) {
            photons[(i * parameters.photons + ray.sample) * PHOTON_WORDS] = NO_NUMBER;
        }
    }
    let place = reserve(lane, u32(flies), parameters.next);
    _ = reserve(lane, u32(flies), RAYS);
    if (flies) {
        queues[parameters.next * parameters.slots + place] = slot;
    }
}
