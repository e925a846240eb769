// How much a node of a tree of lights may matter to a point, as in `vastlight-transport`, `light::bounds` (Conty Estevez
// and Kulla 2018, "Importance sampling of many lights with adaptive tree splitting").
//#include light_words

/// Centre, radius; axis, cosine of the cone; cosine of emission, intensity, alignment; link, flags.
const LIGHT_NODE_WORDS: u32 = 13u;
const LIGHT_LINK: u32 = 11u;

const LIGHT_LEAF: u32 = 1u;
const LIGHT_TWO_SIDED: u32 = 2u;
const LIGHT_FRONT_OF_PLANE: u32 = 4u;

fn light_is_leaf(node: u32) -> bool {
    return (lights[node + 12u] & LIGHT_LEAF) != 0u;
}

/// Mean of max(x, 0) for x uniform within `spread` of `center`, both at most 1.
fn light_clipped_mean(center: f32, spread: f32) -> f32 {
    if (center >= spread) {
        return center;
    }
    if (center <= -spread) {
        return 0.0;
    }
    let above = center + spread;
    return above * above / (4.0 * spread);
}

/// cos(max(0, a - b)) from cos a and b's sine and cosine, for angles in [0, pi].
fn light_cos_of_difference(cos_a: f32, sin_b: f32, cos_b: f32) -> f32 {
    if (cos_a >= cos_b) {
        return 1.0;
    }
    let sin_a = sqrt(max(1.0 - cos_a * cos_a, 0.0));
    return cos_a * cos_b + sin_a * sin_b;
}

/// Cosine of the smallest angle between a normal in the cone and a direction to the point from within the sphere.
fn light_nearest_cosine(cos_cone: f32, cos_w: f32, sin_b: f32) -> f32 {
    if (sin_b >= 1.0 || cos_cone <= -1.0) {
        return 1.0;
    }
    let sin_o = sqrt(max(1.0 - cos_cone * cos_cone, 0.0));
    let cos_b = sqrt(max(1.0 - sin_b * sin_b, 0.0));
    return light_cos_of_difference(light_cos_of_difference(cos_w, sin_o, cos_cone), sin_b, cos_b);
}

/// Mean cosine between the normals and the direction `w` to the point, clipped at zero; 0 where no light goes.
fn light_emitted_cosine(node: u32, w: vec3<f32>, sin_b: f32) -> f32 {
    let flags = lights[node + 12u];
    let cos_axis = dot(light_vec3(node + 4u), w);
    if ((flags & LIGHT_FRONT_OF_PLANE) != 0u) {
        return max(cos_axis, 0.0);
    }
    let two_sided = (flags & LIGHT_TWO_SIDED) != 0u;
    let cos_w = select(cos_axis, abs(cos_axis), two_sided);
    let nearest = light_nearest_cosine(light_f32(node + 7u), cos_w, sin_b);
    if (nearest < light_f32(node + 8u) || nearest <= 0.0) {
        return 0.0;
    }
    // Between normals all along the axis and normals all around.
    let around = select(0.25, 0.5, two_sided);
    let mean = around + light_f32(node + 10u) * (light_clipped_mean(cos_w, sin_b) - around);
    return max(mean, 0.1 * nearest);
}

/// An estimate of the irradiance at a point on a surface facing `normal` (zero: facing any way). Without `directions` the
/// lights' normals are not looked at.
fn light_importance(node: u32, at: vec3<f32>, normal: vec3<f32>, directions: bool) -> f32 {
    let to_point = at - light_vec3(node);
    let radius = light_f32(node + 3u);
    let distance_squared = dot(to_point, to_point);
    let falloff = light_f32(node + 9u) / max(distance_squared + 0.3 * radius * radius, 1e-20);
    let inverse = 1.0 / sqrt(max(distance_squared, 1e-30));
    // The sine of the angle under which the sphere is seen; inside it the direction means less.
    let sine = radius * inverse;
    let sin_b = min(sine, 1.0);
    let w = to_point * inverse / max(sine, 1.0);
    var received = 1.0;
    if (!light_is_zero(normal)) {
        received = light_clipped_mean(-dot(w, normal), sin_b);
    }
    if (received <= 0.0) {
        return 0.0;
    }
    var emitted = 1.0;
    if (directions) {
        emitted = light_emitted_cosine(node, w, sin_b);
    }
    return min(falloff * emitted * received, 1e30);
}
