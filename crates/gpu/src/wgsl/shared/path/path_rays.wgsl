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
    if (found.node == NONE) {
        return;
    }
    let cluster = read_cluster(found.node);
    for (var corner = 0u; corner < 3u; corner++) {
        put_vec3(PATH_CORNERS + 3u * corner, slot, page_corner(cluster, found, corner));
    }
    put_word(PATH_BLOCK, slot, found.page);
    put_word(PATH_BLOCK + 1u, slot, page_place(found));
}

/// What a ray that waited has found so far.
fn known_hit(slot: u32) -> Hit {
    return Hit(
        path_f32(PATH_HIT, slot),
        path_f32(PATH_HIT + 1u, slot),
        path_f32(PATH_HIT + 2u, slot),
        path_word(PATH_HIT + 3u, slot),
        path_word(PATH_HIT + 4u, slot),
    );
}

/// Where the walk of a ray goes on, in `restart`.
fn take_restart(slot: u32) {
    restart = Turn(
        path_word(PATH_RESTART, slot),
        path_word(PATH_RESTART + 1u, slot),
        path_word(PATH_RESTART + 2u, slot),
    );
}

fn put_restart(slot: u32, turn: Turn) {
    put_word(PATH_RESTART, slot, turn.enter);
    put_word(PATH_RESTART + 1u, slot, turn.instance);
    put_word(PATH_RESTART + 2u, slot, turn.subtree);
}
