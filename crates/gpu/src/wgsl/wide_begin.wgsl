// Which nodes of a binary tree are leaves, and the first queue of those that become wide nodes: the root, if it is no leaf.
//#include group
//#include tree_node

struct Parameters {
    most: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> nodes: array<Node>;
@group(0) @binding(2) var<storage, read> pairs: array<u32>;
@group(0) @binding(3) var<storage, read_write> is_leaf: array<u32>;
@group(0) @binding(4) var<storage, read_write> is_wide: array<u32>;
@group(0) @binding(5) var<storage, read_write> queued: array<u32>;
@group(0) @binding(6) var<storage, read_write> tails: array<u32>;

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= parameters.most) {
        return;
    }
    let exists = id.x < 1u + 2u * pairs[0];
    is_leaf[id.x] = select(0u, 1u, exists && nodes[id.x].left == 0u);
    let is_root = id.x == 0u && pairs[0] > 0u;
    is_wide[id.x] = select(0u, 1u, is_root);
    if (id.x == 0u) {
        queued[0] = 0u;
        tails[0] = select(0u, 1u, is_root);
    }
}
