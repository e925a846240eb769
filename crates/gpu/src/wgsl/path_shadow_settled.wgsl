// Shadow rays that `path_shadow` leaves: surfaces are there or not by alpha, and window panes let a share of each channel
// through, as in `vastlight-transport`, `pane`. Rays whose pages are not there wait.
//#include path_walk_settled
//#include vertex

/// Of the ray on its way: its key, its direction, the channels that are blocked.
var<private> ray_key: u32;
var<private> ray_direction: vec3<f32>;
var<private> blocked: vec3<bool>;

fn accepts(hit: Hit, veiled: bool) -> bool {
    if (!veiled) {
        return true;
    }
    let met = tested_meeting(hit);
    if (!alpha_is_there(met, ray_key) || lacks) {
        return false;
    }
    let material = material_of(material_of_triangle(mesh_record(hit.instance), hit.prim));
    if ((tables[material] & FLAG_PANE) == 0u) {
        return true;
    }
    let vertex = vertex_at(met, ray_direction, Cone(0.0, 0.0));
    if (lacks) {
        return false;
    }
    let passed = bsdf_straight(bsdf_new(vertex.evaluated.params), frame_to_local(vertex.frame, vertex.wo));
    // Another number than the one that decides about alpha.
    let chance = vec3<f32>(hash_to_unit(~ray_key, hit.instance, hit.prim));
    blocked = blocked | (chance >= passed);
    return all(blocked);
}

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    var slot = 0u;
    var is_waiting = false;
    if (id.x < atomicLoad(&tails[parameters.full])) {
        slot = take_path(id.x);
        ray_key = shadow_key(slot, parameters.depth);
        ray_direction = path_vec3(PATH_SHADOW_DIRECTION, slot);
        blocked = (vec3<u32>(path_word(PATH_BLOCKED, slot)) & vec3<u32>(1u, 2u, 4u)) != vec3<u32>(0u);
        take_restart(slot);
        is_waiting = still_waits();
        let ray = shadow_ray(slot);
        if (!is_waiting && walk(ray, true, miss(ray.t_max)).prim == NONE) {
            is_waiting = waits(miss(ray.t_max));
            put_restart(slot, missing);
            let bits = select(vec3<u32>(0u), vec3<u32>(1u, 2u, 4u), blocked);
            put_word(PATH_BLOCKED, slot, bits.x | bits.y | bits.z);
            if (!is_waiting) {
                add_radiance(slot, select(path_vec3(PATH_SHADOW_RADIANCE, slot), vec3<f32>(0.0), blocked));
            }
        }
    }
    enqueue(lane, parameters.waiting, slot, is_waiting);
}
