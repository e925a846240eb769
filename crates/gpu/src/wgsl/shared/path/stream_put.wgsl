// Writing rays of the stream tracer. Who includes this has `streams` to be written.
//#include stream_state

fn put_stream_word(field: u32, slot: u32, word: u32) {
    streams[field * parameters.slots + slot] = word;
}

fn put_stream_f32(field: u32, slot: u32, number: f32) {
    put_stream_word(field, slot, bitcast<u32>(number));
}

fn put_stream_vec3(field: u32, slot: u32, v: vec3<f32>) {
    put_stream_f32(field, slot, v.x);
    put_stream_f32(field + 1u, slot, v.y);
    put_stream_f32(field + 2u, slot, v.z);
}

/// A ray and what it carries.
struct StreamRay {
    origin: vec3<f32>,
    direction: vec3<f32>,
    t_max: f32,
    weight: vec3<f32>,
    sample: u32,
    node: u32,
    key: u32,
}

/// Puts a ray at its start into a slot.
fn put_stream_ray(slot: u32, ray: StreamRay) {
    put_stream_vec3(STREAM_ORIGIN, slot, ray.origin);
    put_stream_vec3(STREAM_DIRECTION, slot, ray.direction);
    put_stream_f32(STREAM_HIT, slot, ray.t_max);
    put_stream_f32(STREAM_HIT + 1u, slot, 0.0);
    put_stream_f32(STREAM_HIT + 2u, slot, 0.0);
    for (var field = STREAM_HIT + 3u; field < STREAM_WEIGHT; field++) {
        put_stream_word(field, slot, STREAM_NONE);
    }
    put_stream_vec3(STREAM_WEIGHT, slot, ray.weight);
    put_stream_word(STREAM_SAMPLE, slot, ray.sample);
    put_stream_word(STREAM_NODE, slot, ray.node);
    put_stream_word(STREAM_KEY, slot, ray.key);
}
