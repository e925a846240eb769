// Cells of the finest level with more elements than a leaf may have: these go where the cell's place is, and are halved, as the
// paper has it. Each element finds the node that has it as the last one on the left.
//#include group
//#include place_of
//#include splits

struct Parameters {
    count: u32,
    leaf: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> codes: array<u32>;
@group(0) @binding(2) var<storage, read> order: array<u32>;
@group(0) @binding(3) var<storage, read> places: array<u32>;
@group(0) @binding(4) var<storage, read_write> placed_order: array<u32>;
@group(0) @binding(5) var<storage, read_write> spans: array<vec2<u32>>;
@group(0) @binding(6) var<storage, read_write> starting: array<atomic<u32>>;

/// Notes the node of a run from `place` on in which the element `i` of the run is the last one on the left, if there is one.
fn halve(place: u32, length: u32, i: u32) {
    var low = 0u;
    var rest = length;
    while (rest > parameters.leaf) {
        let middle = low + rest / 2u;
        if (middle == i + 1u) {
            put_split(place + low, place + low + rest, place + i);
            return;
        }
        if (middle > i) {
            rest /= 2u;
        } else {
            low = middle;
            rest -= rest / 2u;
        }
    }
}

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= parameters.count) {
        return;
    }
    let code = codes[i];
    let is_first = i == 0u || codes[max(i, 1u) - 1u] != code;
    let is_last = i + 1u == parameters.count || codes[min(i + 1u, parameters.count - 1u)] != code;
    if (is_first && is_last) {
        return;
    }
    let start = place_of(code, 0u, parameters.count);
    let length = place_of(code + 1u, start, parameters.count) - start;
    if (length > parameters.leaf) {
        let place = places[start];
        placed_order[place + i - start] = order[i];
        halve(place, length, i - start);
    }
}
