// Hits by the threaded kd-tree: a ray goes from traversal to intersection and back until its way ends.
//#include accept_all
//#include kd_leaf
//#include settled

struct Parameters {
    count: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read_write> answers: array<u32>;
@group(0) @binding(2) var<storage, read> rays: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> tree: array<u32>;
@group(0) @binding(4) var<storage, read> blocks: array<u32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= parameters.count) {
        return;
    }
    let start = rays[id.x * 2u];
    let along = rays[id.x * 2u + 1u];
    let world = WorldRay(start.xyz, start.w, along.xyz, along.w);
    var best = Hit(along.w, 0.0, 0.0, NONE, NONE);
    var place = kd_start();
    while (kd_advance(world, best.t, &place)) {
        var ray = mesh_ray(world, place.instance, best.t);
        _ = kd_test(&ray, place.leaf, &best);
    }
    let at = id.x * 5u;
    answers[at] = bitcast<u32>(best.t);
    answers[at + 1u] = bitcast<u32>(best.u);
    answers[at + 2u] = bitcast<u32>(best.v);
    answers[at + 3u] = best.instance;
    answers[at + 4u] = best.prim;
}
