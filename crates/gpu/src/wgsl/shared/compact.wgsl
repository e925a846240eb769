// The elements whose flag is set.

struct Parameters {
    count: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> flags: array<u32>;

fn selected(i: u32) -> bool {
    return flags[i] != 0u;
}
