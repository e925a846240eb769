// The boxes of triangles. Coordinates beyond the limit, infinite ones too, are pulled in; one that is no number makes the box as
// large as may be.
//#include boxes
//#include group

/// The bits of 1e37: sums of two coordinates stay finite.
const LIMIT: u32 = 0x7cf0bdc2u;
const INFINITE: u32 = 0x7f800000u;

struct Parameters {
    count: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> positions: array<u32>;
@group(0) @binding(2) var<storage, read> triangles: array<u32>;
@group(0) @binding(3) var<storage, read_write> boxes: array<Box>;

/// The words of a coordinate as lower and as upper bound.
fn bounds_of(bits: u32) -> vec2<u32> {
    let magnitude = bits & 0x7fffffffu;
    if (magnitude > INFINITE) {
        return vec2<u32>(ordered(LIMIT | 0x80000000u), ordered(LIMIT));
    }
    return vec2<u32>(ordered(min(magnitude, LIMIT) | (bits & 0x80000000u)));
}

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= parameters.count) {
        return;
    }
    var around = empty_box();
    for (var corner = 0u; corner < 3u; corner++) {
        let vertex = 3u * triangles[3u * id.x + corner];
        let x = bounds_of(positions[vertex]);
        let y = bounds_of(positions[vertex + 1u]);
        let z = bounds_of(positions[vertex + 2u]);
        around = join(around, Box(x.x, y.x, z.x, x.y, y.y, z.y));
    }
    boxes[id.x] = around;
}
