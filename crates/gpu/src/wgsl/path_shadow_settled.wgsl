// Shadow rays that `path_shadow` leaves: surfaces are there or not by alpha, and window panes let a share of each channel
// through, as in `vastlight-transport`, `pane`.
//#include group
//#include path_rays
//#include settled
//#include veils
//#include vertex

struct Parameters {
    capacity: u32,
    full: u32,
    depth: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> tree: array<u32>;
@group(0) @binding(2) var<storage, read> pages: array<u32>;
@group(0) @binding(3) var<storage, read> tables: array<u32>;
@group(0) @binding(4) var<storage, read> corners: array<u32>;
@group(0) @binding(5) var<storage, read> texels: array<u32>;
@group(0) @binding(6) var<storage, read_write> paths: array<u32>;
@group(0) @binding(7) var<storage, read> queues: array<u32>;
@group(0) @binding(8) var<storage, read> tails: array<u32>;

/// Of the ray on its way: its key, its direction, the channels that are blocked.
var<private> ray_key: u32;
var<private> ray_direction: vec3<f32>;
var<private> blocked: vec3<bool>;

fn accepts(hit: Hit, veiled: bool) -> bool {
    if (!veiled) {
        return true;
    }
    let met = Meeting(hit.t, vec2<f32>(hit.u, hit.v), hit.instance, hit.prim);
    if (!alpha_is_there(met, ray_key)) {
        return false;
    }
    let material = material_of(material_of_triangle(mesh_record(hit.instance), hit.prim));
    if ((tables[material] & FLAG_PANE) == 0u) {
        return true;
    }
    let vertex = vertex_at(met, ray_direction, Cone(0.0, 0.0));
    let passed = bsdf_straight(bsdf_new(vertex.evaluated.params), frame_to_local(vertex.frame, vertex.wo));
    // Another number than the one that decides about alpha.
    let chance = vec3<f32>(hash_to_unit(~ray_key, hit.instance, hit.prim));
    blocked = blocked | (chance >= passed);
    return all(blocked);
}

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= tails[parameters.full]) {
        return;
    }
    let slot = queues[parameters.full * parameters.capacity + id.x];
    ray_key = shadow_key(slot, parameters.depth);
    ray_direction = path_vec3(PATH_SHADOW_DIRECTION, slot);
    blocked = vec3<bool>(false);
    if (walk(shadow_ray(slot), true).prim == NONE) {
        add_radiance(slot, select(path_vec3(PATH_SHADOW_RADIANCE, slot), vec3<f32>(0.0), blocked));
    }
}
