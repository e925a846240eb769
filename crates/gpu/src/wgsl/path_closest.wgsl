// The closest hit of each path's ray. Rays that meet what is dear to judge are left to `path_closest_settled`; those whose pages are
// not there wait.
//#include path_walk

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    var slot = 0u;
    var is_left = false;
    var is_waiting = false;
    if (id.x < atomicLoad(&tails[parameters.full])) {
        slot = take_path(id.x);
        var known = miss(PATH_FAR);
        if (parameters.again != 0u) {
            take_restart(slot);
            known = known_hit(slot);
            is_waiting = still_waits();
        }
        if (!is_waiting) {
            var hit = walk(path_ray(slot), false, known);
            is_left = is_unsettled();
            if (is_left) {
                // From the start, with nothing found.
                missing = Turn(0u, 0u, 0u);
                found.node = NONE;
                hit = miss(PATH_FAR);
            } else {
                is_waiting = waits(hit);
            }
            put_hit(slot, hit);
            put_restart(slot, missing);
        }
    }
    enqueue(lane, parameters.left, slot, is_left);
    enqueue(lane, parameters.waiting, slot, is_waiting);
}
