// Rays of the stream tracer on their way, field by field: the field f of the ray in a slot is the word f * slots + slot. As in
// `vastlight-trace`, `stream`, and `vastlight-transport`, `stream::records`. Who includes this has the binding `streams`, and
// `parameters.slots`.

// Where it starts, where it goes, and how far.
const STREAM_ORIGIN: u32 = 0u;
const STREAM_DIRECTION: u32 = 3u;
// Its closest hit so far: t, or how far it goes where there is none, weights, instance, triangle.
const STREAM_HIT: u32 = 6u;
// Where it stands: see `KdPlace`.
const STREAM_PLACE: u32 = 11u;
// What it carries: weight, sample, number in the tree of its sample (0 for shadow rays), key.
const STREAM_WEIGHT: u32 = 21u;
const STREAM_SAMPLE: u32 = 24u;
const STREAM_NODE: u32 = 25u;
const STREAM_KEY: u32 = 26u;
const STREAM_FIELDS: u32 = 27u;
const STREAM_NONE: u32 = 0xffffffffu;

fn stream_word(field: u32, slot: u32) -> u32 {
    return streams[field * parameters.slots + slot];
}

fn stream_f32(field: u32, slot: u32) -> f32 {
    return bitcast<f32>(stream_word(field, slot));
}

fn stream_vec3(field: u32, slot: u32) -> vec3<f32> {
    return vec3<f32>(stream_f32(field, slot), stream_f32(field + 1u, slot), stream_f32(field + 2u, slot));
}
