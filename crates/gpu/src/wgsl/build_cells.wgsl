// Where each cluster starts: for each cell of the grid, and for what comes behind all, the number of codes below.
//#include clusters
//#include group

struct Parameters {
    count: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> codes: array<u32>;
@group(0) @binding(2) var<storage, read_write> cells: array<u32>;

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x > CELLS) {
        return;
    }
    var low = 0u;
    var high = parameters.count;
    while (low < high) {
        let middle = (low + high) / 2u;
        if ((codes[middle] >> CLUSTER_SHIFT) < id.x) {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    cells[id.x] = low;
}
