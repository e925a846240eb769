// Whether each ray meets anything in a scene in memory.
//#include accept_all
//#include walk

struct Parameters {
    count: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> tree: array<u32>;
@group(0) @binding(2) var<storage, read> pages: array<u32>;
/// Origin and least t, direction and greatest t.
@group(0) @binding(3) var<storage, read> rays: array<vec4<f32>>;
/// 1 or 0.
@group(0) @binding(4) var<storage, read_write> blocked: array<u32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= parameters.count) {
        return;
    }
    let start = rays[id.x * 2u];
    let along = rays[id.x * 2u + 1u];
    let hit = walk(WorldRay(start.xyz, start.w, along.xyz, along.w), true);
    blocked[id.x] = u32(hit.prim != NONE);
}
