// A ray prepared for the tests of one space, with the margins of `vastlight-accel`, `ray`. Who includes this has a function
// `triangle_again` for triangles that single precision does not settle.

const TOLERANCE: f32 = 8.0 / 16777216.0;
const NODE_MARGIN: f32 = 64.0 / 16777216.0;
const SMALLEST_COMPONENT: f32 = 1.0 / 67108864.0;
/// Directions are brought into this range by a power of two.
const LEAST_DIRECTION: f32 = 1.0 / 1048576.0;
const MOST_DIRECTION: f32 = 1048576.0;
const FARTHEST_ORIGIN: f32 = 1.2089258e24;
const FARTHEST_FROM_MESH: f32 = 1099511627776.0;

/// Its direction scaled by a power of two so that no product under- or overflows.
struct ScaledRay {
    origin: vec3<f32>,
    direction: vec3<f32>,
    /// Parameters along the scaled direction times this are parameters along the given one.
    t_scale: f32,
    /// Whether there is such a ray: it starts near enough, and has a direction.
    fits: bool,
}

/// A ray prepared for box tests.
struct BoxRay {
    reciprocal: vec3<f32>,
    /// `plane * reciprocal - offset` is where the ray enters and leaves a slab, margin included.
    near_offset: vec3<f32>,
    far_offset: vec3<f32>,
}

/// A ray prepared for triangle tests.
struct TriangleRay {
    origin: vec3<f32>,
    /// The axes that become x, y and z after the shear.
    axes: vec3<u32>,
    shear: vec3<f32>,
    tolerance: f32,
}

fn largest(v: vec3<f32>) -> f32 {
    return max(max(abs(v.x), abs(v.y)), abs(v.z));
}

fn scaled_ray(origin: vec3<f32>, direction: vec3<f32>) -> ScaledRay {
    let size = largest(direction);
    if (largest(origin) > FARTHEST_ORIGIN || size == 0.0) {
        return ScaledRay(origin, direction, 1.0, false);
    }
    if (size >= LEAST_DIRECTION && size <= MOST_DIRECTION) {
        return ScaledRay(origin, direction, 1.0, true);
    }
    let exponent = 127 - i32((bitcast<u32>(size) >> 23u) & 255u);
    let first = bitcast<f32>(u32(exponent / 2 + 127) << 23u);
    let second = bitcast<f32>(u32(exponent - exponent / 2 + 127) << 23u);
    return ScaledRay(origin, direction * first * second, first * second, true);
}

fn reciprocal_of(d: f32, smallest: f32) -> f32 {
    let at_least = max(abs(d), smallest);
    return 1.0 / select(at_least, -at_least, d < 0.0);
}

/// Against geometry with coordinates up to `extent`, with margins `factor` times those that meshes need.
fn box_ray(ray: ScaledRay, extent: f32, factor: f32) -> BoxRay {
    let d = ray.direction;
    let smallest = largest(d) * SMALLEST_COMPONENT;
    let reciprocal =
        vec3<f32>(reciprocal_of(d.x, smallest), reciprocal_of(d.y, smallest), reciprocal_of(d.z, smallest));
    let margin = (largest(ray.origin) + extent) * (NODE_MARGIN * factor) * abs(reciprocal);
    return BoxRay(reciprocal, ray.origin * reciprocal + margin, ray.origin * reciprocal - margin);
}

fn triangle_ray(ray: ScaledRay, boxes: BoxRay, extent: f32) -> TriangleRay {
    let d = ray.direction;
    let a = abs(d);
    var z = select(2u, 1u, a.y >= a.z);
    if (a.x >= a.y && a.x >= a.z) {
        z = 0u;
    }
    let x = (z + 1u) % 3u;
    let y = (z + 2u) % 3u;
    let scale = boxes.reciprocal[z];
    let shear = vec3<f32>(d[x] * scale, d[y] * scale, scale);
    return TriangleRay(ray.origin, vec3<u32>(x, y, z), shear, (largest(ray.origin) + extent) * TOLERANCE);
}

/// Where the ray enters and leaves a box, margins included.
fn box_range(ray: BoxRay, low: vec3<f32>, high: vec3<f32>) -> vec2<f32> {
    let backwards = ray.reciprocal < vec3<f32>(0.0);
    let enter = select(low, high, backwards) * ray.reciprocal - ray.near_offset;
    let leave = select(high, low, backwards) * ray.reciprocal - ray.far_offset;
    return vec2<f32>(max(max(enter.x, enter.y), enter.z), min(min(leave.x, leave.y), leave.z));
}

fn sheared(ray: TriangleRay, p: vec3<f32>) -> vec3<f32> {
    let q = p - ray.origin;
    let z = q[ray.axes.z];
    return vec3<f32>(q[ray.axes.x] - ray.shear.x * z, q[ray.axes.y] - ray.shear.y * z, z);
}

/// Twice the signed area of the triangle between the ray and an edge. The corners are taken in an order of their own,
/// so that the triangle on the other side of the edge gets the opposite number, however a driver rounds the
/// difference: rays through edges find one of both.
fn edge(p: vec3<f32>, q: vec3<f32>) -> f32 {
    if (p.x < q.x || (p.x == q.x && p.y < q.y)) {
        return -(q.x * p.y - q.y * p.x);
    }
    return p.x * q.y - p.y * q.x;
}

/// Whether the ray's line meets the triangle, then t and the weights of the second and third corner.
/// Woop, Benthin, Wald 2013, "Watertight ray/triangle intersection", with the deviations of `vastlight-accel`, `triangle`.
fn triangle(ray: TriangleRay, p: vec3<f32>, q: vec3<f32>, r: vec3<f32>) -> vec4<f32> {
    let a = sheared(ray, p);
    let b = sheared(ray, q);
    let c = sheared(ray, r);
    let u = edge(c, b);
    let v = edge(a, c);
    let w = edge(b, a);
    let sum = u + v + w;
    let inside = min(min(u, v), w) >= 0.0 || max(max(u, v), w) <= 0.0;
    if (!inside || sum == 0.0) {
        return vec4<f32>(0.0);
    }
    let off = max(abs(u * a.x + v * b.x + w * c.x), abs(u * a.y + v * b.y + w * c.y));
    if (off > abs(sum) * ray.tolerance) {
        return triangle_again(ray, a, b, c, sum < 0.0);
    }
    let t = (u * a.z + v * b.z + w * c.z) / sum * ray.shear.z;
    return vec4<f32>(1.0, t, v / sum, w / sum);
}
