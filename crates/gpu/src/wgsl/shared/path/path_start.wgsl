// Starts of paths: thin-lens or parallel rays through the pixel filter (`vastlight-transport`, `camera`). Who includes this has what
// `path_state` asks for, the bindings `tables` and `pixels`, and in `parameters` first, samples, first_sample and seed.
//#include path_state
//#include random
//#include table_access
//#include warp

/// Where the inverse of the filter's distribution is at `u`, pixels.
fn filter_offset(camera: u32, u: f32) -> f32 {
    let steps = tables[camera + CAMERA_FILTER];
    let scaled = u * f32(steps);
    let step = min(u32(scaled), steps - 1u);
    let a = table_f32(camera + CAMERA_FILTER + 1u + step);
    let b = table_f32(camera + CAMERA_FILTER + 2u + step);
    return a + (b - a) * (scaled - f32(step));
}

fn map_from_camera(camera: u32, v: vec3<f32>) -> vec3<f32> {
    return table_vec3(camera) * v.x + table_vec3(camera + 3u) * v.y + table_vec3(camera + 6u) * v.z;
}

fn put_ray(camera: u32, slot: u32, pixel: vec2<u32>, sampler: Sampler) {
    let filtered = point_at(sampler, 0u);
    let center = vec2<f32>(pixel) + 0.5;
    let offset = vec2<f32>(filter_offset(camera, filtered.x), filter_offset(camera, filtered.y));
    let plane = (center + offset) * table_vec2(camera + CAMERA_SCALE) + table_vec2(camera + CAMERA_SCALE + 2u);
    var origin = vec3<f32>(0.0);
    var direction = vec3<f32>(plane, -1.0);
    let lens = table_vec2(camera + CAMERA_LENS);
    if (tables[camera + CAMERA_ORTHOGRAPHIC] == 1u) {
        origin = vec3<f32>(plane, 0.0);
        direction = vec3<f32>(0.0, 0.0, -1.0);
    } else if (lens.x > 0.0) {
        origin = vec3<f32>(warp_concentric_disk(point_at(sampler, 1u)) * lens.x, 0.0);
        direction = direction * lens.y - origin;
    }
    let axis = table_vec3(camera + CAMERA_AXIS);
    put_vec3(PATH_RAY_ORIGIN, slot, map_from_camera(camera, origin) + table_vec3(camera + 9u));
    put_vec3(PATH_RAY_DIRECTION, slot, normalize_or(map_from_camera(camera, direction), axis));
}

/// Starts the path in a slot.
fn start_path(slot: u32) {
    let number = parameters.first + slot;
    let pixel = pixels[number / parameters.samples];
    let sample = parameters.first_sample + number % parameters.samples;
    let pixel_hash = hash_pair(pixel.x, pixel.y);
    let sampler = Sampler(hash_more(pixel_hash, parameters.seed), reverseBits(sample));
    let camera = tables[TABLES_CAMERA];
    for (var field = 0u; field < PATH_FIELDS; field++) {
        put_word(field, slot, 0u);
    }
    put_word(PATH_SAMPLER, slot, sampler.key.x);
    put_word(PATH_SAMPLER + 1u, slot, sampler.key.y);
    put_word(PATH_SAMPLER + 2u, slot, sampler.index_reversed);
    put_word(PATH_KEY, slot, hash_more(hash_more(pixel_hash, sample), parameters.seed).y);
    put_vec3(PATH_THROUGHPUT, slot, vec3<f32>(1.0));
    put_f32(PATH_ETA_SQUARED, slot, 1.0);
    for (var i = 0u; i < 4u; i++) {
        put_word(PATH_MEDIA + i, slot, 0xffffffffu);
    }
    put_f32(PATH_CONE, slot, table_f32(camera + CAMERA_CONE));
    put_f32(PATH_CONE + 1u, slot, table_f32(camera + CAMERA_CONE + 1u));
    put_word(SAMPLE_OBJECT, slot, NO_HIT);
    put_word(SAMPLE_MATERIAL, slot, NO_HIT);
    put_ray(camera, slot, pixel, sampler);
}
