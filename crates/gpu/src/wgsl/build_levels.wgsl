// Four more levels of a pyramid of boxes.
//#include pyramid

struct Parameters {
    first: u32,
    length: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read_write> pyramid: array<Box>;

@compute @workgroup_size(GROUP)
fn main(@builtin(workgroup_id) tile: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let i = tile.x * GROUP + lane;
    var own = empty_box();
    if (i < parameters.length) {
        own = pyramid[parameters.first + i];
    }
    write_levels(lane, tile.x, parameters.first, parameters.length, own);
}
