// New boxes for the nodes of a tree over moved boxes. Every node names the run of elements below it, so that its box follows from the
// pyramid over them and from no other node.
//#include range_box
//#include tree_node
//#include group

struct Parameters {
    nodes: u32,
    count: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> pyramid: array<Box>;
@group(0) @binding(2) var<storage, read> pairs: array<u32>;
@group(0) @binding(3) var<storage, read_write> nodes: array<Node>;

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= min(parameters.nodes, 1u + 2u * pairs[0])) {
        return;
    }
    let first = nodes[id.x].first;
    let end = min(first + nodes[id.x].count, parameters.count);
    nodes[id.x].bounds = coordinates(range_box(first, end, parameters.count));
}
