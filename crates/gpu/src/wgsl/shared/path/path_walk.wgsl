// Rays of paths on their first way: what both kernels see. Those that are dear to judge are left, those whose pages are not there wait.
//#include path_queues
//#include path_rays
//#include pool
//#include unsettled

struct Parameters {
    capacity: u32,
    full: u32,
    waiting: u32,
    left: u32,
    again: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> tree: array<u32>;
@group(0) @binding(2) var<storage, read> pool_a: array<u32>;
@group(0) @binding(3) var<storage, read> pool_b: array<u32>;
@group(0) @binding(4) var<storage, read_write> page_table: array<atomic<u32>>;
@group(0) @binding(5) var<storage, read_write> paths: array<u32>;
@group(0) @binding(6) var<storage, read_write> queues: array<u32>;
@group(0) @binding(7) var<storage, read_write> tails: array<atomic<u32>>;
