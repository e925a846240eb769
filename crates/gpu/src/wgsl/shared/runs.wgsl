// The elements with which a run of equal keys starts.

struct Parameters {
    count: u32,
    shift: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> keys: array<u32>;

fn selected(i: u32) -> bool {
    return i == 0u || keys[i] >> parameters.shift != keys[max(i, 1u) - 1u] >> parameters.shift;
}
