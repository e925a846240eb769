// Where each cell of a grid starts in the order of sorted codes, whose upper bits are the cells' numbers: for each cell, and for what comes
// behind all, the number of codes below.
//#include group

struct Parameters {
    count: u32,
    cells: u32,
    shift: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> codes: array<u32>;
@group(0) @binding(2) var<storage, read_write> cells: array<u32>;

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x > parameters.cells) {
        return;
    }
    var low = 0u;
    var high = parameters.count;
    while (low < high) {
        let middle = (low + high) / 2u;
        if ((codes[middle] >> parameters.shift) < id.x) {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    cells[id.x] = low;
}
