// The closest hit of each path's ray that `path_closest` leaves; surfaces are there or not by alpha.
//#include group
//#include path_rays
//#include settled
//#include veils

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

/// The key of the ray on its way.
var<private> ray_key: u32;

fn accepts(hit: Hit, veiled: bool) -> bool {
    return !veiled || alpha_is_there(Meeting(hit.t, vec2<f32>(hit.u, hit.v), hit.instance, hit.prim), ray_key);
}

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= tails[parameters.full]) {
        return;
    }
    let slot = queues[parameters.full * parameters.capacity + id.x];
    ray_key = alpha_key(slot, parameters.depth);
    put_hit(slot, walk(path_ray(slot), false));
}
