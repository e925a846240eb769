// Shadow rays: what they carry is added where nothing is in the way. Rays that meet what is dear to judge are left to
// `path_shadow_settled`.
//#include path_rays
//#include queue
//#include unsettled

struct Parameters {
    capacity: u32,
    full: u32,
    left: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> tree: array<u32>;
@group(0) @binding(2) var<storage, read> pages: array<u32>;
@group(0) @binding(3) var<storage, read_write> paths: array<u32>;
@group(0) @binding(4) var<storage, read_write> queues: array<u32>;
@group(0) @binding(5) var<storage, read_write> tails: array<atomic<u32>>;

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    var slot = 0u;
    var is_left = false;
    if (id.x < atomicLoad(&tails[parameters.full])) {
        slot = queues[parameters.full * parameters.capacity + id.x];
        let is_free = walk(shadow_ray(slot), true).prim == NONE;
        is_left = is_free && is_unsettled();
        if (is_free && !is_left) {
            add_radiance(slot, path_vec3(PATH_SHADOW_RADIANCE, slot));
        }
    }
    let place = reserve(lane, u32(is_left), parameters.left);
    if (is_left) {
        queues[parameters.left * parameters.capacity + place] = slot;
    }
}
