// The lowest levels of a pyramid of boxes: the boxes in the order of a tree's leaves, and four levels above.
//#include pyramid

struct Parameters {
    count: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> boxes: array<Box>;
@group(0) @binding(2) var<storage, read> order: array<u32>;
@group(0) @binding(3) var<storage, read_write> pyramid: array<Box>;

@compute @workgroup_size(GROUP)
fn main(@builtin(workgroup_id) tile: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let i = tile.x * GROUP + lane;
    var own = empty_box();
    if (i < parameters.count) {
        own = boxes[order[i]];
        pyramid[i] = own;
    }
    write_levels(lane, tile.x, 0u, parameters.count, own);
}
