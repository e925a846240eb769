// Light from infinity: the background, the sun's disc, and directional lights, as in `vastlight-transport`,
// `light::environment`, `light::map` and `light::sky`.
//#include frame
//#include light_grid
//#include light_sample

const LIGHT_CONSTANT: u32 = 0u;
/// Grid, texels, width, height, strength, sine and cosine of the rotation.
const LIGHT_IMAGE: u32 = 1u;
/// Grid, table, its azimuths and elevations, towards the sun along the ground, and in space, radiance of the ground,
/// extinction at the ground, height of the eye.
const LIGHT_SKY: u32 = 2u;

/// Direction, irradiance, its luminance.
const LIGHT_DIRECTIONAL_WORDS: u32 = 7u;

fn light_background_kind() -> u32 {
    return lights[LIGHT_BACKGROUND_KIND];
}

/// From the world to an image turned about +y.
fn light_to_image(image: u32, d: vec3<f32>) -> vec3<f32> {
    let s = light_f32(image + 5u);
    let c = light_f32(image + 6u);
    return vec3<f32>(d.x * c - d.z * s, d.y, d.x * s + d.z * c);
}

fn light_from_image(image: u32, d: vec3<f32>) -> vec3<f32> {
    let s = light_f32(image + 5u);
    let c = light_f32(image + 6u);
    return vec3<f32>(d.x * c + d.z * s, d.y, d.z * c - d.x * s);
}

fn light_image_radiance(image: u32, wi: vec3<f32>) -> vec3<f32> {
    let width = lights[image + 2u];
    let cells = light_footprint(light_uv_of(light_to_image(image, wi)), width, lights[image + 3u]);
    let upper = lights[image + 1u] + 3u * cells.y.x * width;
    let lower = lights[image + 1u] + 3u * cells.y.y * width;
    let sum = light_vec3(upper + 3u * cells.x.x) * cells.weights.x
        + light_vec3(upper + 3u * cells.x.y) * cells.weights.y
        + light_vec3(lower + 3u * cells.x.x) * cells.weights.z
        + light_vec3(lower + 3u * cells.x.y) * cells.weights.w;
    return sum * light_f32(image + 4u);
}

/// Bilinear lookup in the table of the sky; coordinates in [0, 1].
fn light_sky_lookup(sky: u32, x: f32, y: f32) -> vec3<f32> {
    let table = lights[sky + 1u];
    let width = lights[sky + 2u];
    let last = vec2<u32>(width - 1u, lights[sky + 3u] - 1u);
    let v = clamp(vec2<f32>(x, y), vec2<f32>(0.0), vec2<f32>(1.0)) * vec2<f32>(last);
    let cell = min(vec2<u32>(v), last - 1u);
    let part = v - vec2<f32>(cell);
    let near = table + 3u * (cell.y * width + cell.x);
    let next = near + 3u * width;
    let low = light_vec3(near) * (1.0 - part.x) + light_vec3(near + 3u) * part.x;
    let high = light_vec3(next) * (1.0 - part.x) + light_vec3(next + 3u) * part.x;
    return low * (1.0 - part.y) + high * part.y;
}

/// The table's coordinate of the angle between a direction's azimuth and the sun's.
fn light_azimuth_from_sun(sky: u32, wi: vec3<f32>) -> f32 {
    let across = vec2<f32>(wi.x, wi.z);
    let distance = length(across);
    var cosine = 1.0;
    if (distance > 1e-12) {
        cosine = dot(across, light_vec2(sky + 4u)) / distance;
    }
    return sqrt(real_acos(cosine) / PI);
}

/// Radiance of the sky without the sun's disc.
fn light_sky_radiance(sky: u32, wi: vec3<f32>) -> vec3<f32> {
    if (wi.y >= 0.0) {
        let elevation = sqrt(real_asin(wi.y) / HALF_PI);
        return light_sky_lookup(sky, light_azimuth_from_sun(sky, wi), elevation);
    }
    // The ground, seen through the haze up to where the ray meets it.
    let distance = light_f32(sky + 15u) / max(-wi.y, 1e-5);
    let depth = light_vec3(sky + 12u) * distance;
    let passed = vec3<f32>(real_exp(-depth.x), real_exp(-depth.y), real_exp(-depth.z));
    let horizon = light_sky_lookup(sky, sqrt(real_acos(dot(wi, light_vec3(sky + 6u))) / PI), 0.0);
    return light_vec3(sky + 9u) * passed + horizon * (vec3<f32>(1.0) - passed);
}

/// The sun's frame; its radiance, the luminance of its irradiance, half the disc's angle and 1 minus its cosine follow.
fn light_sun_frame(sun: u32) -> Frame {
    return Frame(light_vec3(sun), light_vec3(sun + 3u), light_vec3(sun + 6u));
}

fn light_sun_contains(sun: u32, wi: vec3<f32>) -> bool {
    let off = wi - light_vec3(sun + 6u);
    return dot(off, off) <= 2.0 * light_f32(sun + 14u);
}

/// The sun's irradiance on a surface.
fn light_sun_estimate(normal: vec3<f32>) -> f32 {
    let sun = lights[LIGHT_SUN];
    if (sun == 0u) {
        return 0.0;
    }
    var facing = 1.0;
    if (!light_is_zero(normal)) {
        facing = clamp(dot(normal, light_vec3(sun + 6u)) + light_f32(sun + 13u), 0.0, 1.0);
    }
    return light_f32(sun + 12u) * facing;
}

/// An estimate of the background's irradiance on a surface with this normal (zero: facing any way).
fn light_background_estimate(normal: vec3<f32>) -> f32 {
    let mean = light_vec2(LIGHT_MEANS);
    return max(mean.x * (1.0 + normal.y) + mean.y * (1.0 - normal.y), 0.0) * HALF_PI;
}

/// The word of a directional light.
fn light_directional(number: u32) -> u32 {
    return lights[LIGHT_DIRECTIONAL] + number * LIGHT_DIRECTIONAL_WORDS;
}

/// Irradiance from it on a surface with this normal (zero: facing it).
fn light_directional_estimate(light: u32, normal: vec3<f32>) -> f32 {
    let strength = light_f32(light + 6u);
    if (light_is_zero(normal)) {
        return strength;
    }
    return strength * max(dot(light_vec3(light), normal), 0.0);
}

/// Sum of the square roots of the directional lights' estimates.
fn light_directional_total(normal: vec3<f32>) -> f32 {
    var sum = 0.0;
    for (var i = 0u; i < lights[LIGHT_DIRECTIONAL_COUNT]; i++) {
        sum += sqrt(light_directional_estimate(light_directional(i), normal));
    }
    return sum;
}

/// Radiance from infinity along a direction: background and sun's disc.
fn light_environment(wi: vec3<f32>) -> vec3<f32> {
    let data = lights[LIGHT_BACKGROUND];
    let kind = light_background_kind();
    if (kind == LIGHT_CONSTANT) {
        return light_vec3(data);
    }
    if (kind == LIGHT_IMAGE) {
        return light_image_radiance(data, wi);
    }
    let sky = light_sky_radiance(data, wi);
    let sun = lights[LIGHT_SUN];
    if (sun != 0u && wi.y > 0.0 && light_sun_contains(sun, wi)) {
        return sky + light_vec3(sun + 9u);
    }
    return sky;
}

/// A direction of the background, for a surface with this normal; zero if all is black.
fn light_background_sample(normal: vec3<f32>, u: vec2<f32>) -> vec3<f32> {
    let data = lights[LIGHT_BACKGROUND];
    let kind = light_background_kind();
    if (kind == LIGHT_CONSTANT) {
        if (light_is_zero(normal)) {
            return warp_uniform_sphere(u);
        }
        return frame_to_outer(frame_from_z(normal), warp_cosine_hemisphere(u));
    }
    let grid = lights[data];
    let uv = light_grid_sample(grid, light_halves(grid, normal), u);
    if (uv.y < 0.0) {
        return vec3<f32>(0.0);
    }
    let direction = light_direction_of(uv);
    if (kind == LIGHT_IMAGE) {
        return light_from_image(data, direction);
    }
    return direction;
}

/// Density with which `light_background_sample` finds a direction.
fn light_background_pdf(normal: vec3<f32>, wi: vec3<f32>) -> f32 {
    let data = lights[LIGHT_BACKGROUND];
    let kind = light_background_kind();
    if (kind == LIGHT_CONSTANT) {
        return select(warp_cosine_hemisphere_pdf(dot(wi, normal)), WARP_SPHERE_PDF, light_is_zero(normal));
    }
    var own = wi;
    if (kind == LIGHT_IMAGE) {
        own = light_to_image(data, wi);
    }
    return light_grid_pdf(lights[data], normal, own);
}

/// A direction into the sun's disc.
fn light_sun_sample(u: vec2<f32>) -> vec3<f32> {
    let sun = lights[LIGHT_SUN];
    let own = light_sun_frame(sun);
    // Just inside, so that rounding does not lose the disc's edge.
    return frame_to_outer(own, warp_uniform_cone(u, light_f32(sun + 14u) * 0.9999));
}

/// Density with which `light_sun_sample` finds a direction.
fn light_sun_pdf(wi: vec3<f32>) -> f32 {
    let sun = lights[LIGHT_SUN];
    if (sun != 0u && light_sun_contains(sun, wi)) {
        return warp_uniform_cone_pdf(light_f32(sun + 14u));
    }
    return 0.0;
}
