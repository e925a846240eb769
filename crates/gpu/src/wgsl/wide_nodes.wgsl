// Wide nodes and the runs of leaves, each at its number: that of binary nodes of its kind that come before.
//#include group
//#include wide_slots

/// A slot with nothing in it.
const NOTHING: u32 = 0xffffffffu;
const LEAF_BIT: u32 = 0x80000000u;
/// Bits of an infinite coordinate.
const INFINITE: u32 = 0x7f800000u;

/// Planes of boxes by axis, then lower or upper, then slot; what slots point to; nothing yet.
struct WideNode {
    planes: array<u32, 48>,
    children: array<u32, 8>,
    reserved: array<u32, 8>,
}

struct Parameters {
    most: u32,
    capacity: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> nodes: array<Node>;
@group(0) @binding(2) var<storage, read> wide_numbers: array<u32>;
@group(0) @binding(3) var<storage, read> leaf_numbers: array<u32>;
@group(0) @binding(4) var<storage, read_write> wide_nodes: array<WideNode>;
/// First element and number of elements.
@group(0) @binding(5) var<storage, read_write> leaves: array<vec2<u32>>;

fn emit(number: u32, node: u32) {
    let used = open_slots(node);
    for (var slot = 0u; slot < 8u; slot++) {
        var b = Box(INFINITE, INFINITE, INFINITE, INFINITE | LEAF_BIT, INFINITE | LEAF_BIT, INFINITE | LEAF_BIT);
        var child = NOTHING;
        if (slot < used) {
            let below = slots[slot];
            b = nodes[below].bounds;
            child = select(leaf_numbers[below] | LEAF_BIT, wide_numbers[below], areas[slot] >= 0.0);
        }
        for (var axis = 0u; axis < 3u; axis++) {
            wide_nodes[number].planes[16u * axis + slot] = b[axis];
            wide_nodes[number].planes[16u * axis + 8u + slot] = b[axis + 3u];
        }
        wide_nodes[number].children[slot] = child;
        wide_nodes[number].reserved[slot] = 0u;
    }
}

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= parameters.most) {
        return;
    }
    let leaf = leaf_numbers[id.x];
    if (leaf_numbers[id.x + 1u] > leaf) {
        leaves[leaf] = vec2<u32>(nodes[id.x].first, nodes[id.x].count);
    }
    let number = wide_numbers[id.x];
    if (wide_numbers[id.x + 1u] > number && number < parameters.capacity) {
        emit(number, id.x);
    }
}
