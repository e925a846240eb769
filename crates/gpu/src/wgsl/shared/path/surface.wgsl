// From a hit to a surface as in `vastlight-transport`, `surface`, `placement`, `corners`, `cone`: position with an error bound,
// normals, tangent, texture coordinates, colour. Who includes this has the bindings `tables` and `corners`.
//#include frame
//#include material

const ABSENT: u32 = 0xffffffffu;

/// What a ray met: where along it, weights of the second and third corner, instance, triangle.
struct Meeting {
    t: f32,
    weights: vec2<f32>,
    instance: u32,
    prim: u32,
}

struct Surface {
    position: vec3<f32>,
    /// Distance along the normal that separates a ray's origin safely from the surface.
    offset: f32,
    normal: vec3<f32>,
    smooth_normal: vec3<f32>,
    /// Zero if unknown; the bitangent's sign.
    tangent: vec4<f32>,
    point: ShadingPoint,
}

/// A cone around a ray.
struct Cone {
    width: f32,
    spread: f32,
}

/// The part of the cone's lobe and the least width are those of the CPU.
const LOBE_PART: f32 = 0.125;

fn cone_moved(cone: Cone, distance: f32) -> Cone {
    return Cone(cone.width + cone.spread * distance, cone.spread);
}

fn cone_scattered(cone: Cone, pdf: f32) -> Cone {
    if (pdf > 0.0) {
        return Cone(cone.width, max(cone.spread, LOBE_PART / sqrt(pdf)));
    }
    return cone;
}

fn instance_record(instance: u32) -> u32 {
    return record_of(TABLES_INSTANCES, instance, GEOMETRY_INSTANCE_WORDS);
}

fn mesh_record(instance: u32) -> u32 {
    return record_of(TABLES_MESHES, tables[instance_record(instance) + GEOMETRY_MESH], GEOMETRY_MESH_WORDS);
}

/// The material of a triangle.
fn material_of_triangle(mesh: u32, prim: u32) -> u32 {
    let first = tables[mesh + GEOMETRY_PARTS];
    var low = 0u;
    var high = tables[mesh + GEOMETRY_PART_COUNT];
    while (low < high) {
        let middle = (low + high) / 2u;
        if (tables[first + 2u * middle] <= prim) {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    if (low == 0u) {
        return 0u;
    }
    return tables[first + 2u * low - 1u];
}

/// The numbers of a triangle's corners.
fn corners_of(mesh: u32, prim: u32) -> vec3<u32> {
    let at = tables[mesh + GEOMETRY_TRIANGLES] + 3u * prim;
    return vec3<u32>(corners[at], corners[at + 1u], corners[at + 2u]);
}

fn corner_f32(at: u32) -> f32 {
    return bitcast<f32>(corners[at]);
}

fn corner_vec2(first: u32, corner: u32) -> vec2<f32> {
    let at = first + 2u * corner;
    return vec2<f32>(corner_f32(at), corner_f32(at + 1u));
}

fn corner_vec3(first: u32, corner: u32) -> vec3<f32> {
    let at = first + 3u * corner;
    return vec3<f32>(corner_f32(at), corner_f32(at + 1u), corner_f32(at + 2u));
}

fn corner_vec4(first: u32, corner: u32) -> vec4<f32> {
    let at = first + 4u * corner;
    return vec4<f32>(corner_f32(at), corner_f32(at + 1u), corner_f32(at + 2u), corner_f32(at + 3u));
}

fn blend_vec3(first: u32, corner: vec3<u32>, weights: vec3<f32>) -> vec3<f32> {
    return corner_vec3(first, corner.x) * weights.x + corner_vec3(first, corner.y) * weights.y
        + corner_vec3(first, corner.z) * weights.z;
}

/// The product of an instance's map with a vector.
fn map_vector(instance: u32, v: vec3<f32>) -> vec3<f32> {
    return table_vec3(instance) * v.x + table_vec3(instance + 3u) * v.y + table_vec3(instance + 6u) * v.z;
}

fn map_normal(instance: u32, v: vec3<f32>, otherwise: vec3<f32>) -> vec3<f32> {
    let at = instance + GEOMETRY_NORMAL_MAP;
    return normalize_or(table_vec3(at) * v.x + table_vec3(at + 3u) * v.y + table_vec3(at + 6u) * v.z, otherwise);
}

/// Bound of the error of a coordinate, there and back.
fn placement_error(instance: u32, largest_coordinate: f32, position: vec3<f32>) -> f32 {
    let at = instance + GEOMETRY_NORM;
    let p = abs(position);
    let world = table_f32(at) * largest_coordinate + table_f32(at + 2u) + max(max(p.x, p.y), p.z);
    return table_f32(at + 1u) * world;
}

/// Texture coordinates and colour alone: all that alpha depends on.
fn surface_point(mesh: u32, corner: vec3<u32>, weights: vec3<f32>, uv_sets: u32) -> ShadingPoint {
    var point: ShadingPoint;
    for (var uv_set = 0u; uv_set < min(uv_sets, UV_SETS); uv_set++) {
        let first = tables[mesh + GEOMETRY_UVS + uv_set];
        if (first != ABSENT) {
            point.uvs[uv_set] = corner_vec2(first, corner.x) * weights.x + corner_vec2(first, corner.y) * weights.y
                + corner_vec2(first, corner.z) * weights.z;
        }
    }
    point.color = vec4<f32>(1.0);
    let colors = tables[mesh + GEOMETRY_COLORS];
    if (colors != ABSENT) {
        point.color = corner_vec4(colors, corner.x) * weights.x + corner_vec4(colors, corner.y) * weights.y
            + corner_vec4(colors, corner.z) * weights.z;
    }
    return point;
}

/// Twice the area of a triangle of texture coordinates.
fn uv_area(first: u32, corner: vec3<u32>) -> f32 {
    let a = corner_vec2(first, corner.x);
    let b = corner_vec2(first, corner.y) - a;
    let c = corner_vec2(first, corner.z) - a;
    return b.x * c.y - b.y * c.x;
}

/// The tangent in world space; zero where there is none.
fn surface_tangent(mesh: u32, instance: u32, corner: vec3<u32>, weights: vec3<f32>) -> vec4<f32> {
    var tangent = vec4<f32>(0.0);
    let own = tables[mesh + GEOMETRY_TANGENTS];
    if (own != ABSENT) {
        let blended = corner_vec4(own, corner.x) * weights.x + corner_vec4(own, corner.y) * weights.y
            + corner_vec4(own, corner.z) * weights.z;
        tangent = vec4<f32>(blended.xyz, corner_vec4(own, corner.x).w);
    }
    return vec4<f32>(map_vector(instance, tangent.xyz), tangent.w * table_f32(instance + GEOMETRY_HANDEDNESS));
}

/// The unit normal of a triangle with these edges, in object space.
fn face_normal(edges: array<vec3<f32>, 2>) -> vec3<f32> {
    // Scaled, so that products stay in range.
    let size = max(max(length_bound(edges[0]), length_bound(edges[1])), 1e-30);
    return normalize_or(cross(edges[0] / size, edges[1] / size), vec3<f32>(0.0, 0.0, 1.0));
}

fn length_bound(v: vec3<f32>) -> f32 {
    let a = abs(v);
    return max(max(a.x, a.y), a.z);
}

/// The surface at a meeting, seen along `direction` through a cone. Texture coordinates of `uv_sets` sets are found, and
/// the tangent if it is asked for.
fn surface_at(met: Meeting, direction: vec3<f32>, cone: Cone, uv_sets: u32, with_tangent: bool) -> Surface {
    let instance = instance_record(met.instance);
    let mesh = mesh_record(met.instance);
    let corner = corners_of(mesh, met.prim);
    let weights = vec3<f32>(1.0 - met.weights.x - met.weights.y, met.weights.x, met.weights.y);
    let positions = tables[mesh + GEOMETRY_POSITIONS];
    let a = corner_vec3(positions, corner.x);
    let b = corner_vec3(positions, corner.y);
    let c = corner_vec3(positions, corner.z);
    let edges = array<vec3<f32>, 2>(b - a, c - a);

    var surface: Surface;
    let inside = a * weights.x + b * weights.y + c * weights.z;
    surface.position = map_vector(instance, inside) + table_vec3(instance + 9u);
    surface.normal = map_normal(instance, face_normal(edges), vec3<f32>(0.0, 0.0, 1.0));
    let n = abs(surface.normal);
    let reach = max(max(length_bound(a), length_bound(b)), length_bound(c));
    surface.offset = placement_error(instance, reach, surface.position) * (n.x + n.y + n.z);
    surface.smooth_normal = surface.normal;
    let normals = tables[mesh + GEOMETRY_NORMALS];
    if (normals != ABSENT) {
        let blended = map_normal(instance, blend_vec3(normals, corner, weights), surface.normal);
        surface.smooth_normal = select(blended, -blended, dot(blended, surface.normal) < 0.0);
    }
    if (with_tangent) {
        surface.tangent = surface_tangent(mesh, instance, corner, weights);
    }
    surface.point = surface_point(mesh, corner, weights, uv_sets);
    if (uv_sets > 0u) {
        let width = cone_moved(cone, met.t).width;
        let seen = abs(dot(cross(map_vector(instance, edges[0]), map_vector(instance, edges[1])), direction));
        for (var uv_set = 0u; uv_set < min(uv_sets, UV_SETS); uv_set++) {
            let first = tables[mesh + GEOMETRY_UVS + uv_set];
            if (first != ABSENT && seen > 0.0) {
                surface.point.areas[uv_set] = width * width * abs(uv_area(first, corner)) / seen;
            }
        }
    }
    return surface;
}

/// Where a ray towards `direction` starts: off the surface, on the side to which it goes.
fn surface_origin(surface: Surface, direction: vec3<f32>) -> vec3<f32> {
    return surface.position + surface.normal * real_copysign(surface.offset, dot(direction, surface.normal));
}

/// The frame of the interpolated normal.
fn surface_frame(surface: Surface) -> Frame {
    if (all(surface.tangent == vec4<f32>(0.0))) {
        return frame_from_z(surface.smooth_normal);
    }
    var frame = frame_from_z_and_tangent(surface.smooth_normal, surface.tangent.xyz);
    frame.y *= surface.tangent.w;
    return frame;
}

/// The unit vector nearest to `given` about which the mirror image of `wo` is above the surface.
fn surface_bend(given: vec3<f32>, normal: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    let lift = 1e-3 - dot(given, normal);
    var z = given;
    if (lift > 0.0) {
        z = normalize_or(given + normal * lift, normal);
    }
    let mirrored = z * (2.0 * dot(wo, z)) - wo;
    let limit = min(0.9 * dot(wo, normal), 0.01);
    let height = dot(mirrored, normal);
    if (height >= limit && dot(wo, z) > 0.0) {
        return z;
    }
    let lifted = normalize_or(mirrored + normal * (limit - height), normal);
    return normalize_or(wo + lifted, normal);
}

/// The shading frame bent as far as needed for `wo` and its mirror direction to lie on their side of the surface.
fn surface_facing(surface: Surface, frame: Frame, wo: vec3<f32>) -> Frame {
    if (all(frame.z == surface.normal)) {
        return frame;
    }
    let side = real_copysign(1.0, dot(wo, surface.normal));
    let z = surface_bend(frame.z * side, surface.normal * side, wo) * side;
    if (all(z == frame.z)) {
        return frame;
    }
    let handedness = real_copysign(1.0, dot(cross(frame.x, frame.y), frame.z));
    var bent = frame_from_z_and_tangent(z, frame.x);
    bent.y *= handedness;
    return bent;
}
