// Maps from the unit square to other domains, each with its density, as in `vastlight-math`, `warp`.
//#include real

/// Density of `warp_concentric_disk` over area, and of `warp_uniform_sphere` over solid angle.
const WARP_DISK_PDF: f32 = OVER_PI;
const WARP_SPHERE_PDF: f32 = 0.25 * OVER_PI;

/// The unit disc, uniformly (Shirley and Chiu 1997, "A low distortion map between disk and square").
fn warp_concentric_disk(u: vec2<f32>) -> vec2<f32> {
    let p = u * 2.0 - vec2<f32>(1.0);
    if (p.x == 0.0 && p.y == 0.0) {
        return vec2<f32>(0.0);
    }
    // The angle is measured from the nearer axis.
    let nearer_y = abs(p.x) <= abs(p.y);
    let q = select(p, p.yx, nearer_y);
    let sc = real_sin_cos(QUARTER_PI * (q.y / q.x));
    let on_disk = vec2<f32>(q.x * sc.y, q.x * sc.x);
    return select(on_disk, on_disk.yx, nearer_y);
}

/// Directions around +z with density proportional to the cosine.
fn warp_cosine_hemisphere(u: vec2<f32>) -> vec3<f32> {
    let d = warp_concentric_disk(u);
    return vec3<f32>(d, sqrt(max(1.0 - dot(d, d), 0.0)));
}

/// Density of `warp_cosine_hemisphere` over solid angle, for a direction with this z.
fn warp_cosine_hemisphere_pdf(cos_theta: f32) -> f32 {
    return max(cos_theta, 0.0) * OVER_PI;
}

/// Directions of the upper half sphere, uniformly. Density 1 / (2 pi).
fn warp_uniform_hemisphere(u: vec2<f32>) -> vec3<f32> {
    return warp_direction(1.0 - u.x, u.y * TAU);
}

/// Directions of the whole sphere, uniformly.
fn warp_uniform_sphere(u: vec2<f32>) -> vec3<f32> {
    return warp_direction(1.0 - 2.0 * u.x, u.y * TAU);
}

/// Directions within a cone around +z, uniformly; `one_minus_cos` of the half angle.
fn warp_uniform_cone(u: vec2<f32>, one_minus_cos: f32) -> vec3<f32> {
    let d = warp_concentric_disk(u);
    let height = dot(d, d) * one_minus_cos;
    let scale = sqrt(max(one_minus_cos * (2.0 - height), 0.0));
    return vec3<f32>(d * scale, 1.0 - height);
}

/// Density of `warp_uniform_cone` over solid angle, inside the cone.
fn warp_uniform_cone_pdf(one_minus_cos: f32) -> f32 {
    return 1.0 / (TAU * one_minus_cos);
}

/// Weights of the second and third corner of points of a triangle, uniformly over its area (E. Heitz 2019, "A
/// low-distortion map between triangle and square"). Density 1 / area.
fn warp_uniform_triangle(u: vec2<f32>) -> vec2<f32> {
    if (u.x < u.y) {
        let a = u.x * 0.5;
        return vec2<f32>(a, u.y - a);
    }
    let b = u.y * 0.5;
    return vec2<f32>(u.x - b, b);
}

/// The direction with this z and this angle around z from x.
fn warp_direction(z: f32, phi: f32) -> vec3<f32> {
    let r = sqrt(max(1.0 - z * z, 0.0));
    let sc = real_sin_cos(phi);
    return vec3<f32>(r * sc.y, r * sc.x, z);
}

/// A number in [-1, 1] distributed like a tent around 0. Density 1 - |x|.
fn warp_tent(u: f32) -> f32 {
    if (u < 0.5) {
        return sqrt(2.0 * u) - 1.0;
    }
    return 1.0 - sqrt(max(2.0 - 2.0 * u, 0.0));
}
