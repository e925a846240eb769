// Starts a path for each sample.
//#include group
//#include path_start

struct Parameters {
    capacity: u32,
    count: u32,
    first: u32,
    samples: u32,
    first_sample: u32,
    seed: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> tables: array<u32>;
/// Column and row of every pixel.
@group(0) @binding(2) var<storage, read> pixels: array<vec2<u32>>;
@group(0) @binding(3) var<storage, read_write> paths: array<u32>;
@group(0) @binding(4) var<storage, read_write> queues: array<u32>;

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let slot = id.x;
    if (slot >= parameters.count) {
        return;
    }
    start_path(slot);
    queues[slot] = slot;
}
