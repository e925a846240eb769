// Point and spot lights, as in `vastlight-transport`, `light::punctual` and `light::local`.
//#include frame
//#include light_ies
//#include light_sample

/// Position, frame, intensity, range (0: none), kind, cosines of the inner and outer half angle, profile (0: none).
const LIGHT_PUNCTUAL_WORDS: u32 = 20u;
const LIGHT_IS_SPOT: u32 = 1u;

/// Radiant intensity towards the unit vector `direction` (world space, away from the light).
fn light_intensity(light: u32, direction: vec3<f32>) -> vec3<f32> {
    var cone = 1.0;
    let z = light_vec3(light + 9u);
    if (lights[light + 16u] == LIGHT_IS_SPOT) {
        let inner = light_f32(light + 17u);
        let outer = light_f32(light + 18u);
        // Equal angles make a hard edge.
        let x = clamp((-dot(direction, z) - outer) / max(inner - outer, 1e-6), 0.0, 1.0);
        cone = x * x;
    }
    let profile = lights[light + 19u];
    if (cone > 0.0 && profile != 0u) {
        let own = Frame(light_vec3(light + 3u), light_vec3(light + 6u), z);
        cone *= light_ies(profile, frame_to_local(own, direction));
    }
    return light_vec3(light + 12u) * cone;
}

/// The range's window at a distance.
fn light_window(light: u32, distance: f32) -> f32 {
    let range = light_f32(light + 15u);
    if (!(range > 0.0)) {
        return 1.0;
    }
    let x = distance / range;
    return clamp(1.0 - x * x * x * x, 0.0, 1.0);
}

fn light_punctual_sample(number: u32, at: vec3<f32>, probability: f32) -> LightSample {
    let light = lights[LIGHT_PUNCTUAL] + number * LIGHT_PUNCTUAL_WORDS;
    let to_light = light_vec3(light) - at;
    let distance = length(to_light);
    if (!(distance > 0.0) || !real_is_finite(distance) || !(distance * distance > 0.0)) {
        return light_nothing();
    }
    let wi = to_light / distance;
    let radiance = light_intensity(light, -wi) * (light_window(light, distance) / (distance * distance));
    if (light_is_zero(radiance) || !real_is_finite3(radiance)) {
        return light_nothing();
    }
    return LightSample(wi, distance, radiance, probability, LIGHT_VALID | LIGHT_DELTA);
}
