// How many cuts make the parts of each box no longer than a portion of the scene: D. K. Bogolepov's thesis, 2014, chapter 4.3.
//#include box_sides
//#include group
//#include quotient

/// 1 / 128: a power of two, so that the product is exact.
const PORTION: f32 = 0.0078125;
/// Below this a width counts as none.
const LEAST: f32 = 1e-37;

struct Parameters {
    count: u32,
    most: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> boxes: array<Box>;
@group(0) @binding(2) var<storage, read> extents: array<Box, 1>;
@group(0) @binding(3) var<storage, read_write> wanted: array<u32>;

fn longest(b: Box) -> f32 {
    let lengths = lengths_of(b);
    return max(max(lengths.x, lengths.y), lengths.z);
}

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= parameters.most) {
        return;
    }
    var cuts = 0u;
    let width = longest(extents[0]) * PORTION;
    if (id.x < parameters.count && width > LEAST) {
        let length = longest(boxes[id.x]);
        if (length >= width) {
            cuts = u32(rounded_quotient(length, width));
        }
    }
    wanted[id.x] = cuts;
}
