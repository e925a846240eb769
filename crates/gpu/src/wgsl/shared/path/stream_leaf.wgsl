// The intersection kernel for one ray: the triangles of the leaf at which it stands.
//#include kd_leaf
//#include stream_walk

/// Whether any hit will do.
fn stream_is_shadow(slot: u32) -> bool {
    return stream_word(STREAM_NODE, slot) == 0u;
}

fn stream_hit(slot: u32) -> Hit {
    return Hit(
        stream_f32(STREAM_HIT, slot),
        stream_f32(STREAM_HIT + 1u, slot),
        stream_f32(STREAM_HIT + 2u, slot),
        stream_word(STREAM_HIT + 3u, slot),
        stream_word(STREAM_HIT + 4u, slot),
    );
}

fn put_stream_hit(slot: u32, hit: Hit) {
    put_stream_f32(STREAM_HIT, slot, hit.t);
    put_stream_f32(STREAM_HIT + 1u, slot, hit.u);
    put_stream_f32(STREAM_HIT + 2u, slot, hit.v);
    put_stream_word(STREAM_HIT + 3u, slot, hit.instance);
    put_stream_word(STREAM_HIT + 4u, slot, hit.prim);
}

/// Tests the leaf at which the ray in a slot stands; whether a closer hit was found, which `best` becomes.
fn stream_test(slot: u32, best: ptr<function, Hit>) -> bool {
    let instance = stream_word(STREAM_PLACE, slot);
    var ray = mesh_ray(stream_world(slot), instance, (*best).t);
    return kd_test(&ray, stream_word(STREAM_PLACE + 1u, slot), best);
}
