// The closest hit of each ray with a scene in memory.
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
/// t, weights of the second and third corner, instance, triangle; all bits of these where there is none.
@group(0) @binding(4) var<storage, read_write> hits: array<u32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= parameters.count) {
        return;
    }
    let start = rays[id.x * 2u];
    let along = rays[id.x * 2u + 1u];
    let hit = walk(WorldRay(start.xyz, start.w, along.xyz, along.w), false);
    let at = id.x * 5u;
    hits[at] = bitcast<u32>(hit.t);
    hits[at + 1u] = bitcast<u32>(hit.u);
    hits[at + 2u] = bitcast<u32>(hit.v);
    hits[at + 3u] = hit.instance;
    hits[at + 4u] = hit.prim;
}
