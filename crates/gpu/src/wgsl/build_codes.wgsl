// Morton codes of the centres of boxes, in 1024 cells along each side of the box around the centres, x highest, and the boxes'
// numbers. Every step is exact or rounded as WGSL prescribes, the division by integers: codes are the same on all devices.
//#include doubled_centre
//#include group
//#include morton

struct Parameters {
    count: u32,
    cut: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> boxes: array<Box>;
@group(0) @binding(2) var<storage, read> extents: array<u32, 6>;
@group(0) @binding(3) var<storage, read_write> codes: array<u32>;
@group(0) @binding(4) var<storage, read_write> numbers: array<u32>;

/// Behind all codes.
const NOTHING: u32 = 0xffffffffu;

/// Where cells start along an axis, and how many there are in a unit.
var<workgroup> cells: array<vec2<f32>, 3>;

/// 1024 / x rounded to the nearest; 0 where that is not finite.
fn cells_by(x: f32) -> f32 {
    let bits = bitcast<u32>(x);
    if (!(x > 0.0) || bits <= 0x04800000u) {
        return 0.0;
    }
    let exponent = bits >> 23u;
    let mantissa = (bits & 0x7fffffu) | 0x800000u;
    if (mantissa == 0x800000u) {
        return bitcast<f32>((264u - exponent) << 23u);
    }
    // 2^47 / mantissa by hand, which has 24 digits.
    var rest = 0x800000u;
    var digits = 0u;
    for (var i = 0u; i < 24u; i++) {
        rest <<= 1u;
        digits <<= 1u;
        if (rest >= mantissa) {
            rest -= mantissa;
            digits |= 1u;
        }
    }
    digits += select(0u, 1u, 2u * rest > mantissa || (2u * rest == mantissa && (digits & 1u) != 0u));
    return bitcast<f32>(((263u - exponent) << 23u) + (digits - 0x800000u));
}

@compute @workgroup_size(GROUP)
fn main(@builtin(workgroup_id) tile: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    if (lane < 3u) {
        let start = bitcast<f32>(coordinate(extents[lane]));
        let end = bitcast<f32>(coordinate(extents[lane + 3u]));
        cells[lane] = vec2<f32>(start, cells_by(end - start));
    }
    workgroupBarrier();
    for (var k = 0u; k < ITEMS; k++) {
        let i = tile.x * TILE + k * GROUP + lane;
        if (i < parameters.count) {
            let b = boxes[i];
            var code = 0u;
            for (var axis = 0u; axis < 3u; axis++) {
                let x = min((doubled_centre(b, axis) - cells[axis].x) * cells[axis].y, 1023.0);
                // To the nearest of half a cell less is the cell below, but for its last thousandth.
                let cell = select(round(x - 0.499), x, parameters.cut != 0u);
                code |= spread(u32(max(cell, 0.0))) << (2u - axis);
            }
            codes[i] = code;
            numbers[i] = i;
        } else if (i < arrayLength(&codes)) {
            codes[i] = NOTHING;
            numbers[i] = i;
        }
    }
}
