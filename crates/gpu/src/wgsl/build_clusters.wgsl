// The boxes of clusters over those of their triangles.
//#include boxes
//#include group

struct Parameters {
    count: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> triangles: array<Box>;
@group(0) @binding(2) var<storage, read> first: array<u32>;
@group(0) @binding(3) var<storage, read> order: array<u32>;
@group(0) @binding(4) var<storage, read_write> clusters: array<Box>;

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= parameters.count) {
        return;
    }
    var around = empty_box();
    let end = first[id.x + 1u];
    for (var i = first[id.x]; i < end; i++) {
        around = join(around, triangles[order[i]]);
    }
    clusters[id.x] = around;
}
