// The rays of paths, and what they meet.
//#include path_state
//#include walk

fn path_ray(slot: u32) -> WorldRay {
    return WorldRay(path_vec3(PATH_RAY_ORIGIN, slot), 0.0, path_vec3(PATH_RAY_DIRECTION, slot), PATH_FAR);
}

fn shadow_ray(slot: u32) -> WorldRay {
    let length = path_f32(PATH_SHADOW_LENGTH, slot);
    return WorldRay(path_vec3(PATH_SHADOW_ORIGIN, slot), 0.0, path_vec3(PATH_SHADOW_DIRECTION, slot), length);
}

fn put_hit(slot: u32, hit: Hit) {
    put_f32(PATH_HIT, slot, hit.t);
    put_f32(PATH_HIT + 1u, slot, hit.u);
    put_f32(PATH_HIT + 2u, slot, hit.v);
    put_word(PATH_HIT + 3u, slot, hit.instance);
    put_word(PATH_HIT + 4u, slot, hit.prim);
}
