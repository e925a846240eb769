// The closest hit of each path's ray that `path_closest` leaves; surfaces are there or not by alpha. Rays whose pages are not there
// wait.
//#include path_walk_settled

/// The key of the ray on its way.
var<private> ray_key: u32;

fn accepts(hit: Hit, veiled: bool) -> bool {
    return !veiled || (alpha_is_there(tested_meeting(hit), ray_key) && !lacks);
}

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    var slot = 0u;
    var is_waiting = false;
    if (id.x < atomicLoad(&tails[parameters.full])) {
        slot = take_path(id.x);
        ray_key = alpha_key(slot, parameters.depth);
        take_restart(slot);
        is_waiting = still_waits();
        if (!is_waiting) {
            let hit = walk(path_ray(slot), false, known_hit(slot));
            is_waiting = waits(hit);
            put_hit(slot, hit);
            put_restart(slot, missing);
        }
    }
    enqueue(lane, parameters.waiting, slot, is_waiting);
}
