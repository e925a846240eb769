// Sampling a triangle light, by solid angle where it is near or large, by area elsewhere, as in `vastlight-transport`,
// `light::triangle` (Arvo 1995, "Stratified sampling of spherical triangles").
//#include light_words
//#include real
//#include warp

const LIGHT_FAR_RATIO: f32 = 0.1;
const LIGHT_LEAST_SOLID_ANGLE: f32 = 3e-4;
const LIGHT_MOST_SOLID_ANGLE: f32 = 6.2;

/// In world space.
struct LightTriangle {
    a: vec3<f32>,
    edge_b: vec3<f32>,
    edge_c: vec3<f32>,
    /// Twice the area long; points to the front.
    normal: vec3<f32>,
}

struct LightPoint {
    wi: vec3<f32>,
    distance: f32,
    /// Of the second and third corner.
    weights: vec2<f32>,
    /// Over solid angle; 0 where there is no point.
    pdf: f32,
}

/// A triangle on the unit sphere.
struct LightSpherical {
    a: vec3<f32>,
    b: vec3<f32>,
    c: vec3<f32>,
    /// 0 if it is not worth being sampled by it.
    solid_angle: f32,
}

fn light_triangle_at(at: u32) -> LightTriangle {
    return LightTriangle(light_vec3(at), light_vec3(at + 3u), light_vec3(at + 6u), light_vec3(at + 9u));
}

fn light_unit_or_zero(v: vec3<f32>) -> vec3<f32> {
    let length_squared = dot(v, v);
    if (!(length_squared > 0.0) || !real_is_finite(length_squared)) {
        return vec3<f32>(0.0);
    }
    return v / sqrt(length_squared);
}

/// Whether a point lies in front.
fn light_faces(triangle: LightTriangle, at: vec3<f32>) -> bool {
    return dot(at - triangle.a, triangle.normal) > 0.0;
}

fn light_spherical(triangle: LightTriangle, at: vec3<f32>) -> LightSpherical {
    let to_a = triangle.a - at;
    let far_area = LIGHT_FAR_RATIO * dot(to_a, to_a);
    if (!(dot(triangle.normal, triangle.normal) >= 4.0 * (far_area * far_area))) {
        return LightSpherical(vec3<f32>(0.0), vec3<f32>(0.0), vec3<f32>(0.0), 0.0);
    }
    let to_b = to_a + triangle.edge_b;
    let to_c = to_a + triangle.edge_c;
    let scale = sqrt(dot(to_a, to_a) * dot(to_b, to_b) * dot(to_c, to_c));
    let a = light_unit_or_zero(to_a);
    let b = light_unit_or_zero(to_b);
    let c = light_unit_or_zero(to_c);
    if (!(scale > 0.0) || !real_is_finite(scale)) {
        return LightSpherical(a, b, c, 0.0);
    }
    // Van Oosterom and Strackee 1983; the determinant from the edges, which keep the digits of a small triangle.
    let determinant = abs(dot(to_a, triangle.normal)) / scale;
    return LightSpherical(a, b, c, 2.0 * real_atan2(determinant, 1.0 + dot(a, b) + dot(b, c) + dot(c, a)));
}

fn light_is_usable(spherical: LightSpherical) -> bool {
    return spherical.solid_angle >= LIGHT_LEAST_SOLID_ANGLE && spherical.solid_angle < LIGHT_MOST_SOLID_ANGLE;
}

/// A direction inside, uniformly over solid angle.
fn light_spherical_sample(spherical: LightSpherical, u: vec2<f32>) -> vec3<f32> {
    let a = spherical.a;
    let b = spherical.b;
    let c = spherical.c;
    let half_angle = real_sin_cos(0.5 * spherical.solid_angle * u.x);
    // The determinant's sign says on which side of AB the corner C lies.
    let turn = cross(a, b);
    let ab = turn * real_copysign(1.0, dot(turn, c));
    let tangent = light_unit_or_zero(c - a * dot(a, c));
    let k = (1.0 + dot(a, b)) * half_angle.x;
    let p = dot(ab * half_angle.y - (a + b) * half_angle.x, tangent);
    let whole = p * p + k * k;
    var x = a;
    if (whole > 0.0) {
        x = (a * (p * p - k * k) + tangent * (2.0 * p * k)) / whole;
    }
    // Along the arc from B to X, uniformly in 1 - cos.
    let height = u.y * 0.5 * dot(x - b, x - b);
    let away = light_unit_or_zero(x - b * dot(b, x));
    return light_unit_or_zero(b * (1.0 - height) + away * sqrt(max(height * (2.0 - height), 0.0)));
}

/// 1 / area as a density over solid angle, for the point at `to_light`.
fn light_area_pdf(triangle: LightTriangle, to_light: vec3<f32>) -> f32 {
    let distance_squared = dot(to_light, to_light);
    let facing = abs(dot(triangle.normal, to_light));
    if (!(facing > 0.0)) {
        return 0.0;
    }
    let pdf = 2.0 * distance_squared * sqrt(distance_squared) / facing;
    return select(0.0, pdf, real_is_finite(pdf));
}

fn light_point_by_area(triangle: LightTriangle, at: vec3<f32>, u: vec2<f32>) -> LightPoint {
    let weights = warp_uniform_triangle(u);
    let to_light = triangle.a + triangle.edge_b * weights.x + triangle.edge_c * weights.y - at;
    let distance = length(to_light);
    let wi = light_unit_or_zero(to_light);
    return LightPoint(wi, distance, weights, light_area_pdf(triangle, to_light));
}

/// `x` brought between 0 and `whole`.
fn light_part_of(whole: f32, x: f32) -> f32 {
    return select(0.0, min(x, whole), x > 0.0);
}

/// The point in a direction that was drawn by solid angle.
fn light_point_towards(triangle: LightTriangle, at: vec3<f32>, solid_angle: f32, wi: vec3<f32>) -> LightPoint {
    let to_a = triangle.a - at;
    let towards = dot(wi, triangle.normal);
    let to_plane = dot(to_a, triangle.normal);
    if (!(to_plane * sign(towards) > 0.0)) {
        return LightPoint(wi, 0.0, vec2<f32>(0.0), 0.0);
    }
    let distance = to_plane / towards;
    let p = wi * distance - to_a;
    let face = cross(triangle.edge_b, triangle.edge_c) / dot(triangle.normal, triangle.normal);
    let v = light_part_of(1.0, dot(cross(p, triangle.edge_c), face));
    let w = light_part_of(1.0 - v, dot(cross(triangle.edge_b, p), face));
    let exists = distance > 0.0 && real_is_finite(distance);
    return LightPoint(wi, distance, vec2<f32>(v, w), select(0.0, 1.0 / solid_angle, exists));
}

/// A point of the triangle as seen from a point.
fn light_triangle_sample(triangle: LightTriangle, at: vec3<f32>, u: vec2<f32>) -> LightPoint {
    let spherical = light_spherical(triangle, at);
    if (light_is_usable(spherical)) {
        return light_point_towards(triangle, at, spherical.solid_angle, light_spherical_sample(spherical, u));
    }
    return light_point_by_area(triangle, at, u);
}

/// Density over solid angle with which `light_triangle_sample` finds `position`.
fn light_triangle_pdf(triangle: LightTriangle, at: vec3<f32>, position: vec3<f32>) -> f32 {
    let spherical = light_spherical(triangle, at);
    if (light_is_usable(spherical)) {
        return 1.0 / spherical.solid_angle;
    }
    return light_area_pdf(triangle, position - at);
}
