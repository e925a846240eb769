// One level of a build without keys: a range (start, end) longer than a leaf is cut in the middle, and its halves go to
// the next queue; others go to the leaves.
//#include queue

struct Parameters {
    capacity: u32,
    leaf: u32,
    full: u32,
    next: u32,
    leaves: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read_write> tails: array<atomic<u32>>;
@group(0) @binding(2) var<storage, read> ranges: array<vec2<u32>>;
@group(0) @binding(3) var<storage, read_write> next_ranges: array<vec2<u32>>;
@group(0) @binding(4) var<storage, read_write> leaves: array<vec2<u32>>;

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let there = id.x < min(atomicLoad(&tails[parameters.full]), parameters.capacity);
    var range = vec2<u32>(0u, 0u);
    if (there) {
        range = ranges[id.x];
    }
    let cut = there && range.y - range.x > parameters.leaf;
    let place = reserve(lane, select(0u, 2u, cut), parameters.next);
    let leaf_place = reserve(lane, select(0u, 1u, there && !cut), parameters.leaves);
    let middle = range.x + (range.y - range.x) / 2u;
    if (cut && place < parameters.capacity) {
        next_ranges[place] = vec2<u32>(range.x, middle);
    }
    if (cut && place + 1u < parameters.capacity) {
        next_ranges[place + 1u] = vec2<u32>(middle, range.y);
    }
    if (there && !cut && leaf_place < parameters.capacity) {
        leaves[leaf_place] = range;
    }
}
