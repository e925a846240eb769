// The cuts that a budget grants of those that are wanted: all, or of each the same portion, rounded down.
//#include group
//#include whole_numbers

struct Parameters {
    count: u32,
    most: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> total: array<u32, 1>;
@group(0) @binding(2) var<storage, read_write> cuts: array<u32>;

/// a * b / divisor, rounded down, for a quotient below 256.
fn portion(a: u32, b: u32, divisor: u32) -> u32 {
    let product = u64_of_words(a, b);
    var quotient = 0u;
    for (var bit = 128u; bit > 0u; bit >>= 1u) {
        let tried = u64_of_words(quotient | bit, divisor);
        if (tried.y < product.y || (tried.y == product.y && tried.x <= product.x)) {
            quotient |= bit;
        }
    }
    return quotient;
}

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= parameters.count) {
        return;
    }
    let room = parameters.most - parameters.count;
    if (total[0] > room) {
        cuts[id.x] = portion(cuts[id.x], room, total[0]);
    }
}
