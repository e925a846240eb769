// The first kernel of the stream tracer: a camera ray for each sample.
//#include group
//#include path_start
//#include stream_put

struct Parameters {
    capacity: u32,
    count: u32,
    first: u32,
    samples: u32,
    first_sample: u32,
    seed: u32,
    slots: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> tables: array<u32>;
/// Column and row of every pixel.
@group(0) @binding(2) var<storage, read> pixels: array<vec2<u32>>;
@group(0) @binding(3) var<storage, read_write> paths: array<u32>;
@group(0) @binding(4) var<storage, read_write> streams: array<u32>;
@group(0) @binding(5) var<storage, read_write> queues: array<u32>;

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let slot = id.x;
    if (slot >= parameters.count) {
        return;
    }
    start_path(slot);
    let origin = path_vec3(PATH_RAY_ORIGIN, slot);
    let direction = path_vec3(PATH_RAY_DIRECTION, slot);
    let key = path_word(PATH_KEY, slot);
    put_stream_ray(slot, StreamRay(origin, direction, PATH_FAR, vec3<f32>(1.0), slot, 1u, key));
    queues[slot] = slot;
}
