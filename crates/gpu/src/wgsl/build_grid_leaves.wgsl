// The elements of leaves, gathered from their cells. Where a leaf is one cell with more in it than a leaf may have, its place is noted at the
// start of its run of codes instead.
//#include group
//#include region_codes

struct Parameters {
    table: u32,
    leaf: u32,
    capacity: u32,
    leaves: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> codes: array<u32>;
@group(0) @binding(2) var<storage, read> order: array<u32>;
@group(0) @binding(3) var<storage, read> cells: array<u32>;
@group(0) @binding(4) var<storage, read> tails: array<u32>;
@group(0) @binding(5) var<storage, read> leaf_tasks: array<vec4<u32>>;
@group(0) @binding(6) var<storage, read_write> placed_order: array<u32>;
@group(0) @binding(7) var<storage, read_write> places: array<u32>;

var<private> next_place: u32;
var<private> is_long: bool;

fn visit_cell(place: vec3<u32>, begin: u32, end: u32) {
    if (is_long) {
        places[begin] = next_place;
        return;
    }
    for (var i = begin; i < end; i++) {
        placed_order[next_place] = order[i];
        next_place++;
    }
}

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= min(tails[parameters.leaves], parameters.capacity)) {
        return;
    }
    let task = leaf_tasks[id.x];
    next_place = task.z;
    is_long = task.w - task.z > parameters.leaf;
    visit_region(unpack_region(task.xy), parameters.table);
}
