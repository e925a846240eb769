// Rays of the stream tracer between traversal and intersection.
//#include kd
//#include stream_put

fn stream_world(slot: u32) -> WorldRay {
    let t_max = stream_f32(STREAM_HIT, slot);
    return WorldRay(stream_vec3(STREAM_ORIGIN, slot), 0.0, stream_vec3(STREAM_DIRECTION, slot), t_max);
}
