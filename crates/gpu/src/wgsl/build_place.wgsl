// Codes and elements in the order of the tree over their clusters.
//#include clusters
//#include group

struct Parameters {
    count: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> codes: array<u32>;
@group(0) @binding(2) var<storage, read> order: array<u32>;
@group(0) @binding(3) var<storage, read> cells: array<u32>;
@group(0) @binding(4) var<storage, read> places: array<u32>;
@group(0) @binding(5) var<storage, read_write> placed_codes: array<u32>;
@group(0) @binding(6) var<storage, read_write> placed_order: array<u32>;

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= parameters.count) {
        return;
    }
    let code = codes[id.x];
    let cluster = code >> CLUSTER_SHIFT;
    let place = places[cluster] + id.x - cells[cluster];
    placed_codes[place] = code;
    placed_order[place] = order[id.x];
}
