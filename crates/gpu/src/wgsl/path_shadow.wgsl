// Shadow rays: what they carry is added where nothing is in the way. Rays that meet what is dear to judge are left to
// `path_shadow_settled`; those whose pages are not there wait.
//#include path_walk

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    var slot = 0u;
    var is_left = false;
    var is_waiting = false;
    if (id.x < atomicLoad(&tails[parameters.full])) {
        slot = take_path(id.x);
        if (parameters.again != 0u) {
            take_restart(slot);
            is_waiting = still_waits();
        }
        let ray = shadow_ray(slot);
        if (!is_waiting && walk(ray, true, miss(ray.t_max)).prim == NONE) {
            is_left = is_unsettled();
            is_waiting = !is_left && waits(miss(ray.t_max));
            if (is_left) {
                missing = Turn(0u, 0u, 0u);
                put_word(PATH_BLOCKED, slot, 0u);
            }
            put_restart(slot, missing);
            if (!is_left && !is_waiting) {
                add_radiance(slot, path_vec3(PATH_SHADOW_RADIANCE, slot));
            }
        }
    }
    enqueue(lane, parameters.left, slot, is_left);
    enqueue(lane, parameters.waiting, slot, is_waiting);
}
