// Parts of triangles: each box is cut into slabs of equal width along its longest side, and each slab's box is tightened to what of the
// triangle is inside. The first part takes the box's place, the others stand behind all boxes.
//
// Single precision clips with a slack of many times its rounding, so that nothing of a triangle is lost.
//#include box_sides
//#include group
//#include quotient

/// Slack in units of the largest coordinate, 2^-18.
const SLACK: f32 = 3.814697265625e-6;
/// A triangle has three corners, and each of six planes adds at most one.
const MAX_CORNERS: u32 = 9u;

struct Parameters {
    count: u32,
    most: u32,
    nothing: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> positions: array<f32>;
@group(0) @binding(2) var<storage, read> triangles: array<u32>;
@group(0) @binding(3) var<storage, read> boxes: array<Box>;
@group(0) @binding(4) var<storage, read> owners: array<u32>;
/// How many cuts come before each box, and how many there are.
@group(0) @binding(5) var<storage, read> before: array<u32>;
@group(0) @binding(6) var<storage, read_write> parts: array<Box>;
@group(0) @binding(7) var<storage, read_write> part_owners: array<u32>;
/// How many parts there are.
@group(0) @binding(8) var<storage, read_write> part_count: array<u32, 1>;

var<private> corners: array<vec3<f32>, MAX_CORNERS>;
var<private> corner_count: u32;

/// Keeps the part of the polygon where sign * (coordinate - plane) is not below 0.
fn cut_polygon(axis: u32, plane: f32, sign: f32) {
    var kept: array<vec3<f32>, MAX_CORNERS>;
    var count = 0u;
    for (var i = 0u; i < corner_count; i++) {
        let p = corners[i];
        let q = corners[select(i + 1u, 0u, i + 1u == corner_count)];
        let height = (p[axis] - plane) * sign;
        let next_height = (q[axis] - plane) * sign;
        if (height >= 0.0 && count < MAX_CORNERS) {
            kept[count] = p;
            count++;
        }
        if ((height < 0.0) != (next_height < 0.0) && count < MAX_CORNERS) {
            kept[count] = p + (q - p) * (height / (height - next_height));
            count++;
        }
    }
    corners = kept;
    corner_count = count;
}

/// The word of a coordinate.
fn word_of(x: f32) -> u32 {
    return ordered(bitcast<u32>(x));
}

/// The box of what of a triangle is in a box; the box itself where nothing is found.
fn clipped(triangle: u32, bounds: Box) -> Box {
    for (var corner = 0u; corner < 3u; corner++) {
        let vertex = 3u * triangles[3u * triangle + corner];
        corners[corner] = vec3<f32>(positions[vertex], positions[vertex + 1u], positions[vertex + 2u]);
    }
    corner_count = 3u;
    let least = min(min(corners[0], corners[1]), corners[2]);
    let most = max(max(corners[0], corners[1]), corners[2]);
    let largest = max(abs(least), abs(most));
    let slack = max(max(largest.x, largest.y), largest.z) * SLACK;
    for (var axis = 0u; axis < 3u; axis++) {
        let side = side_of(bounds, axis);
        if (least[axis] < side.x) {
            cut_polygon(axis, side.x - slack, 1.0);
        }
        if (most[axis] > side.y) {
            cut_polygon(axis, side.y + slack, -1.0);
        }
    }
    if (corner_count == 0u) {
        return bounds;
    }
    var low = corners[0];
    var high = corners[0];
    for (var i = 1u; i < corner_count; i++) {
        low = min(low, corners[i]);
        high = max(high, corners[i]);
    }
    low = max(low - slack, least);
    high = min(high + slack, most);
    var part = bounds;
    for (var axis = 0u; axis < 3u; axis++) {
        part[axis] = max(part[axis], word_of(low[axis]));
        part[axis + 3u] = min(part[axis + 3u], word_of(high[axis]));
        if (part[axis] > part[axis + 3u]) {
            return bounds;
        }
    }
    return part;
}

/// The slab between two of the planes that cut a box into `slabs`.
fn slab_of(b: Box, number: u32, slabs: u32) -> Box {
    let lengths = lengths_of(b);
    let axis = select(select(2u, 1u, lengths.y >= lengths.z), 0u, lengths.x >= lengths.y && lengths.x >= lengths.z);
    let side = side_of(b, axis);
    var slab = b;
    for (var k = 0u; k < 2u; k++) {
        let plane = number + k;
        if (plane > 0u && plane < slabs) {
            let portion = rounded_quotient(f32(plane), f32(slabs));
            // Between the product and the sum stands an operation that no compiler may leave out: both are rounded.
            let offset = bitcast<f32>(bitcast<u32>((side.y - side.x) * portion) ^ parameters.nothing);
            slab[axis + 3u * k] = max(word_of(side.x), min(word_of(side.x + offset), word_of(side.y)));
        }
    }
    return slab;
}

/// The box of which a cut is.
fn box_of(cut: u32) -> u32 {
    var low = 0u;
    var high = parameters.count;
    while (low < high) {
        let middle = (low + high) / 2u;
        if (before[middle + 1u] <= cut) {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    return low;
}

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let count = parameters.count;
    let all = count + before[parameters.most];
    if (id.x == 0u) {
        part_count[0] = all;
    }
    if (id.x >= all) {
        return;
    }
    var whole = id.x;
    var number = 0u;
    if (id.x >= count) {
        whole = box_of(id.x - count);
        number = id.x - count - before[whole] + 1u;
    }
    let owner = owners[whole];
    let cuts = before[whole + 1u] - before[whole];
    var part = boxes[whole];
    if (cuts > 0u) {
        part = clipped(owner, slab_of(part, number, cuts + 1u));
    }
    parts[id.x] = part;
    part_owners[id.x] = owner;
}
