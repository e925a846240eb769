// A pass of the radix sort: the keys, and the digit that it looks at.
//#include group

struct Parameters {
    count: u32,
    shift: u32,
    tiles: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> keys: array<u32>;

fn digit_of(key: u32) -> u32 {
    return (key >> parameters.shift) & 255u;
}
