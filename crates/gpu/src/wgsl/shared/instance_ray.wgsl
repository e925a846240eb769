// Rays in the world and in the spaces of instances, and the rule by which a triangle's hit becomes the closest: what all walks
// share. Words are those of `vastlight-trace`, `words`.
//
// Who includes this has the binding `tree`, the part `settled` or `unsettled`, and a function `accepts` that says
// whether a hit counts, of a surface that rays may pass or not.
//#include ray

const NONE: u32 = 0xffffffffu;
const INSTANCE_WORDS: u32 = 16u;
const TREE_ROOT: u32 = 0u;
const TREE_INSTANCES: u32 = 1u;
const TREE_EXTENT: u32 = 3u;
const TREE_MARGIN: u32 = 4u;
const TREE_PAGE_SHIFT: u32 = 7u;
/// Parameters of rays that go on for ever.
const FAR: f32 = 3e38;

struct WorldRay {
    origin: vec3<f32>,
    t_min: f32,
    direction: vec3<f32>,
    t_max: f32,
}

/// Without `prim` a miss; `t` is then how far the ray goes.
struct Hit {
    t: f32,
    u: f32,
    v: f32,
    instance: u32,
    prim: u32,
}

/// A ray in the space of an instance's mesh.
struct MeshRay {
    boxes: BoxRay,
    triangles: TriangleRay,
    t_min: f32,
    t_max: f32,
    t_scale: f32,
    instance: u32,
    veiled: bool,
    /// Where its mesh's tree begins.
    root: u32,
    /// Whether there is such a ray.
    fits: bool,
}

fn tree_f32(at: u32) -> f32 {
    return bitcast<f32>(tree[at]);
}

/// The product of a row of an instance's map with a vector.
fn along_row(at: u32, v: vec3<f32>) -> f32 {
    return tree_f32(at) * v.x + tree_f32(at + 1u) * v.y + tree_f32(at + 2u) * v.z;
}

/// A ray in the space of an instance's mesh, as far as `t_max` in the world.
fn mesh_ray(world: WorldRay, instance: u32, t_max: f32) -> MeshRay {
    let at = tree[TREE_INSTANCES] + instance * INSTANCE_WORDS;
    var origin = world.origin;
    var direction = world.direction;
    if (tree[at + 14u] == 0u) {
        let moved = vec3<f32>(tree_f32(at + 3u), tree_f32(at + 7u), tree_f32(at + 11u));
        origin = vec3<f32>(along_row(at, origin), along_row(at + 4u, origin), along_row(at + 8u, origin)) + moved;
        direction =
            vec3<f32>(along_row(at, direction), along_row(at + 4u, direction), along_row(at + 8u, direction));
    }
    let scaled = scaled_ray(origin, direction);
    var ray: MeshRay;
    ray.fits = scaled.fits && largest(origin) <= FARTHEST_FROM_MESH;
    ray.root = tree[at + 12u];
    if (!ray.fits) {
        return ray;
    }
    let extent = tree_f32(at + 13u);
    ray.boxes = box_ray(scaled, extent, 1.0);
    ray.triangles = triangle_ray(scaled, ray.boxes, extent);
    ray.t_min = world.t_min / scaled.t_scale;
    ray.t_max = min(t_max / scaled.t_scale, FAR);
    ray.t_scale = scaled.t_scale;
    ray.instance = instance;
    ray.veiled = tree[at + 15u] != 0u;
    return ray;
}

/// Whether a meeting with a triangle is on the ray.
fn reaches(ray: ptr<function, MeshRay>, met: vec4<f32>) -> bool {
    return met.x != 0.0 && met.y >= (*ray).t_min && met.y <= (*ray).t_max;
}

/// Makes a meeting that reaches the closest hit if it is that; whether it is.
fn takes(ray: ptr<function, MeshRay>, met: vec4<f32>, prim: u32, best: ptr<function, Hit>) -> bool {
    let hit = Hit(met.y * (*ray).t_scale, met.z, met.w, (*ray).instance, prim);
    if (met.y == (*ray).t_max && !comes_before(hit, *best)) {
        return false;
    }
    if (!accepts(hit, (*ray).veiled)) {
        return false;
    }
    *best = hit;
    (*ray).t_max = met.y;
    return true;
}

/// Of hits at the same place the one with the least (instance, triangle) counts.
fn comes_before(a: Hit, b: Hit) -> bool {
    return a.instance < b.instance || (a.instance == b.instance && a.prim < b.prim);
}

/// Whether a walk ends since it met what it cannot judge: one for any hit goes on, since another may settle it.
fn ends_unsettled(any: bool) -> bool {
    return is_unsettled() && !any;
}
