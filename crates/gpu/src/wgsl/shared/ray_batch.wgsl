// Batches of rays with a scene on the device: what all kernels over them see. Who includes this has the parts `settled` or `unsettled`.
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

/// What a ray meets: the closest hit, or with `any` one of its hits.
fn trace(ray: u32, any: bool) -> Hit {
    let start = rays[ray * 2u];
    let along = rays[ray * 2u + 1u];
    return walk(WorldRay(start.xyz, start.w, along.xyz, along.w), any, miss(along.w));
}
