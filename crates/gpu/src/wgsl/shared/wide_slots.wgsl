// The eight slots of a wide node, by opening the largest box until all are taken: Wald, Benthin, Boulos 2008, "Getting rid of packets".
// Who includes this has `nodes: array<Node>`.
//#include tree_node

/// Sides beyond this count as so long: areas stay finite.
const LONGEST_SIDE: f32 = 1e18;

/// The binary nodes in the slots, and their areas; that of a leaf is less than nothing.
var<private> slots: array<u32, 8>;
var<private> areas: array<f32, 8>;

fn put_slot(slot: u32, node: u32) {
    slots[slot] = node;
    areas[slot] = -1.0;
    if (nodes[node].left != 0u) {
        var b = nodes[node].bounds;
        var sides: array<f32, 3>;
        for (var axis = 0u; axis < 3u; axis++) {
            sides[axis] = min(bitcast<f32>(b[axis + 3u]) - bitcast<f32>(b[axis]), LONGEST_SIDE);
        }
        areas[slot] = sides[0] * sides[1] + sides[1] * sides[2] + sides[2] * sides[0];
    }
}

/// Fills the slots of the wide node that a binary node becomes; gives how many are used.
fn open_slots(node: u32) -> u32 {
    put_slot(0u, nodes[node].left);
    put_slot(1u, nodes[node].left + 1u);
    var used = 2u;
    for (; used < 8u; used++) {
        var largest = 0u;
        for (var slot = 1u; slot < used; slot++) {
            largest = select(largest, slot, areas[slot] > areas[largest]);
        }
        if (areas[largest] < 0.0) {
            break;
        }
        let left = nodes[slots[largest]].left;
        put_slot(largest, left);
        put_slot(used, left + 1u);
    }
    return used;
}
