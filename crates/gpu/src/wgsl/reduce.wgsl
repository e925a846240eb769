// The sum, least or greatest of each tile: Harris 2007, "Optimizing parallel reduction in CUDA".
//#include group

struct Parameters {
    count: u32,
    operation: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> values: array<u32>;
@group(0) @binding(2) var<storage, read_write> results: array<u32>;

var<workgroup> partial: array<u32, GROUP>;

fn identity() -> u32 {
    return select(0u, 0xffffffffu, parameters.operation == 1u);
}

fn combine(a: u32, b: u32) -> u32 {
    switch parameters.operation {
        case 0u: { return a + b; }
        case 1u: { return min(a, b); }
        default: { return max(a, b); }
    }
}

@compute @workgroup_size(GROUP)
fn main(@builtin(workgroup_id) tile: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    var value = identity();
    for (var k = 0u; k < ITEMS; k++) {
        let i = tile.x * TILE + k * GROUP + lane;
        if (i < parameters.count) {
            value = combine(value, values[i]);
        }
    }
    partial[lane] = value;
    workgroupBarrier();
    for (var others = GROUP / 2u; others > 0u; others >>= 1u) {
        if (lane < others) {
            partial[lane] = combine(partial[lane], partial[lane + others]);
        }
        workgroupBarrier();
    }
    if (lane == 0u) {
        results[tile.x] = partial[0];
    }
}
