// Paths in flight, field by field: the field f of the path in a slot is the word f * capacity + slot. As in
// `vastlight-transport`, `wavefront::PathState` and `Sample`. Who includes this has the binding `paths`, and
// `parameters.capacity`.

// The sampler, and a hash of pixel, sample and seed.
const PATH_SAMPLER: u32 = 0u;
const PATH_KEY: u32 = 3u;
const PATH_THROUGHPUT: u32 = 4u;
// The last vertex, the normal that light sampling was told there, and the odds of the groups of lights.
const PATH_ORIGIN: u32 = 7u;
const PATH_NORMAL: u32 = 10u;
const PATH_ODDS: u32 = 13u;
const PATH_PDF: u32 = 16u;
const PATH_ETA_SQUARED: u32 = 17u;
const PATH_MEDIA: u32 = 18u;
const PATH_PANES: u32 = 22u;
const PATH_CONE: u32 = 23u;
const PATH_FLAGS: u32 = 25u;
// The next ray, from its origin on without end.
const PATH_RAY_ORIGIN: u32 = 26u;
const PATH_RAY_DIRECTION: u32 = 29u;
// What it met: t, weights, instance, triangle.
const PATH_HIT: u32 = 32u;
// Where that is: the triangle's corners in its mesh, its block and its place there.
const PATH_CORNERS: u32 = 37u;
const PATH_BLOCK: u32 = 46u;
// Of the shadow ray: the channels that are blocked, in the place of the hit, which is shaded by then.
const PATH_BLOCKED: u32 = 32u;
// From which subtree on the ray walks again.
const PATH_RESTART: u32 = 48u;
// The shadow ray: origin, direction, length, what it carries.
const PATH_SHADOW_ORIGIN: u32 = 51u;
const PATH_SHADOW_DIRECTION: u32 = 54u;
const PATH_SHADOW_LENGTH: u32 = 57u;
const PATH_SHADOW_RADIANCE: u32 = 58u;
// What becomes of the path.
const SAMPLE_RADIANCE: u32 = 61u;
const SAMPLE_ALBEDO: u32 = 64u;
const SAMPLE_NORMAL: u32 = 67u;
const SAMPLE_POSITION: u32 = 70u;
const SAMPLE_DEPTH: u32 = 73u;
const SAMPLE_COVERAGE: u32 = 74u;
const SAMPLE_OBJECT: u32 = 75u;
const SAMPLE_MATERIAL: u32 = 76u;
const PATH_FIELDS: u32 = 77u;

/// In the flags: the path has scattered at a surface that is not perfectly specular; it carries one wavelength.
const PATH_SCATTERED: u32 = 1u;
const PATH_DISPERSED: u32 = 2u;
const NO_HIT: u32 = 0xffffffffu;
/// How far rays go that go on for ever.
const PATH_FAR: f32 = 1e30;

fn path_word(field: u32, slot: u32) -> u32 {
    return paths[field * parameters.capacity + slot];
}

fn path_f32(field: u32, slot: u32) -> f32 {
    return bitcast<f32>(path_word(field, slot));
}

fn path_vec3(field: u32, slot: u32) -> vec3<f32> {
    return vec3<f32>(path_f32(field, slot), path_f32(field + 1u, slot), path_f32(field + 2u, slot));
}

fn put_word(field: u32, slot: u32, word: u32) {
    paths[field * parameters.capacity + slot] = word;
}

fn put_f32(field: u32, slot: u32, number: f32) {
    put_word(field, slot, bitcast<u32>(number));
}

fn put_vec3(field: u32, slot: u32, v: vec3<f32>) {
    put_f32(field, slot, v.x);
    put_f32(field + 1u, slot, v.y);
    put_f32(field + 2u, slot, v.z);
}

/// Adds to what a path sees.
fn add_radiance(slot: u32, radiance: vec3<f32>) {
    put_vec3(SAMPLE_RADIANCE, slot, path_vec3(SAMPLE_RADIANCE, slot) + radiance);
}

/// The key of alpha decisions of the segment of this number.
fn alpha_key(slot: u32, depth: u32) -> u32 {
    return path_word(PATH_KEY, slot) + depth * 0x9e3779b9u;
}

/// The same of the shadow ray at its end.
fn shadow_key(slot: u32, depth: u32) -> u32 {
    return alpha_key(slot, depth) ^ 0x5bd1e995u;
}
