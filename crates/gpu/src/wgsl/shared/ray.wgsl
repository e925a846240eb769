// A ray prepared for the tests of one mesh, with the margins of `vastlight-accel`, `ray`.

const TOLERANCE: f32 = 8.0 / 16777216.0;
const NODE_MARGIN: f32 = 64.0 / 16777216.0;
const SMALLEST_COMPONENT: f32 = 1.0 / 67108864.0;

struct MeshRay {
    origin: vec3<f32>,
    reciprocal: vec3<f32>,
    near_offset: vec3<f32>,
    far_offset: vec3<f32>,
    /// The axes that become x, y and z after the shear.
    axes: vec3<u32>,
    shear: vec3<f32>,
    tolerance: f32,
}

fn largest(v: vec3<f32>) -> f32 {
    return max(max(abs(v.x), abs(v.y)), abs(v.z));
}

fn reciprocal_of(d: f32, smallest: f32) -> f32 {
    let at_least = max(abs(d), smallest);
    return 1.0 / select(at_least, -at_least, d < 0.0);
}

fn mesh_ray(origin: vec3<f32>, d: vec3<f32>, extent: f32) -> MeshRay {
    let reach = largest(origin) + extent;
    let smallest = largest(d) * SMALLEST_COMPONENT;
    var ray: MeshRay;
    ray.origin = origin;
    ray.reciprocal =
        vec3<f32>(reciprocal_of(d.x, smallest), reciprocal_of(d.y, smallest), reciprocal_of(d.z, smallest));
    let margin = reach * NODE_MARGIN * abs(ray.reciprocal);
    ray.near_offset = origin * ray.reciprocal + margin;
    ray.far_offset = origin * ray.reciprocal - margin;
    let a = abs(d);
    var z = select(2u, 1u, a.y >= a.z);
    if (a.x >= a.y && a.x >= a.z) {
        z = 0u;
    }
    let x = (z + 1u) % 3u;
    let y = (z + 2u) % 3u;
    ray.axes = vec3<u32>(x, y, z);
    ray.shear = vec3<f32>(d[x] * ray.reciprocal[z], d[y] * ray.reciprocal[z], ray.reciprocal[z]);
    ray.tolerance = reach * TOLERANCE;
    return ray;
}

/// Where the ray enters and leaves a box, margins included.
fn box_range(ray: MeshRay, low: vec3<f32>, high: vec3<f32>) -> vec2<f32> {
    let backwards = ray.reciprocal < vec3<f32>(0.0);
    let enter = select(low, high, backwards) * ray.reciprocal - ray.near_offset;
    let leave = select(high, low, backwards) * ray.reciprocal - ray.far_offset;
    return vec2<f32>(max(max(enter.x, enter.y), enter.z), min(min(leave.x, leave.y), leave.z));
}

fn sheared(ray: MeshRay, p: vec3<f32>) -> vec3<f32> {
    let q = p - ray.origin;
    let z = q[ray.axes.z];
    return vec3<f32>(q[ray.axes.x] - ray.shear.x * z, q[ray.axes.y] - ray.shear.y * z, z);
}

/// Whether the ray's line meets the triangle, then t and the weights of the second and third corner.
/// Woop, Benthin, Wald 2013, "Watertight ray/triangle intersection"; a triangle seen so much edge-on that the place
/// named by its weights is off the ray is missed, where the CPU asks double precision.
fn triangle(ray: MeshRay, p: vec3<f32>, q: vec3<f32>, r: vec3<f32>) -> vec4<f32> {
    let a = sheared(ray, p);
    let b = sheared(ray, q);
    let c = sheared(ray, r);
    let u = c.x * b.y - c.y * b.x;
    let v = a.x * c.y - a.y * c.x;
    let w = b.x * a.y - b.y * a.x;
    let sum = u + v + w;
    let inside = min(min(u, v), w) >= 0.0 || max(max(u, v), w) <= 0.0;
    let off = max(abs(u * a.x + v * b.x + w * c.x), abs(u * a.y + v * b.y + w * c.y));
    if (!inside || sum == 0.0 || off > abs(sum) * ray.tolerance) {
        return vec4<f32>(0.0);
    }
    let t = (u * a.z + v * b.z + w * c.z) / sum * ray.shear.z;
    return vec4<f32>(1.0, t, v / sum, w / sum);
}
