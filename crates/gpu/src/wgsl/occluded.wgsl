// Whether each ray meets anything in a scene in memory. Rays that meet what single precision does
// not settle are left to `occluded_settled`.
//#include queue
//#include unsettled
//#include pool
//#include walk

struct Parameters {
    count: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> tree: array<u32>;
@group(0) @binding(2) var<storage, read> pool_a: array<u32>;
@group(0) @binding(3) var<storage, read> pool_b: array<u32>;
@group(0) @binding(4) var<storage, read_write> page_table: array<atomic<u32>>;
/// Origin and least t, direction and greatest t.
@group(0) @binding(5) var<storage, read> rays: array<vec4<f32>>;
/// 1 or 0.
@group(0) @binding(6) var<storage, read_write> blocked: array<u32>;
/// The rays that are left.
@group(0) @binding(7) var<storage, read_write> left: array<u32>;
/// How many of them there are.
@group(0) @binding(8) var<storage, read_write> tails: array<atomic<u32>>;

fn put_answer(ray: u32, hit: Hit) {
    blocked[ray] = u32(hit.prim != NONE);
}

fn answer(ray: u32) -> Hit {
    let start = rays[ray * 2u];
    let along = rays[ray * 2u + 1u];
    return walk(WorldRay(start.xyz, start.w, along.xyz, along.w), true, miss(along.w));
}

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    var is_left = false;
    if (id.x < parameters.count) {
        let hit = answer(id.x);
        put_answer(id.x, hit);
        is_left = is_unsettled() && hit.prim == NONE;
    }
    let place = reserve(lane, u32(is_left), 0u);
    if (is_left) {
        left[place] = id.x;
    }
}
