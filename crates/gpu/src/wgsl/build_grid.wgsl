// One level of a tree by the surface-area heuristic over grids: Garanzha, Premoze, Bely, Galaktionov 2011, "Grid-based SAH BVH
// construction on a GPU". A task is a node with a region of cells of one level of detail. What is in them is counted by bins, and the region
// is split at the cheapest plane; both parts are tasks of the next level, or leaves.
//#include cell_sizes
//#include queue
//#include region_codes
//#include splits

struct Parameters {
    count: u32,
    table: u32,
    leaf: u32,
    capacity: u32,
    full: u32,
    next: u32,
    leaves: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> extents: array<u32, 6>;
@group(0) @binding(2) var<storage, read> codes: array<u32>;
@group(0) @binding(3) var<storage, read> cells: array<u32>;
@group(0) @binding(4) var<storage, read_write> tails: array<atomic<u32>>;
/// Two queues of tasks: a region, and start and end of the elements in it.
@group(0) @binding(5) var<storage, read_write> tasks: array<vec4<u32>>;
@group(0) @binding(6) var<storage, read_write> leaf_tasks: array<vec4<u32>>;
@group(0) @binding(7) var<storage, read_write> spans: array<vec2<u32>>;
@group(0) @binding(8) var<storage, read_write> starting: array<atomic<u32>>;

/// The parts of a task: none, two, or itself alone where all is in one cell of the finest level, or it is no longer than a leaf.
var<private> parts: array<vec4<u32>, 2>;
var<private> used: u32;

fn visit_cell(place: vec3<u32>, begin: u32, end: u32) {
    add_cell(place, end - begin);
}

fn divide(queued: vec4<u32>) {
    // The first task may turn out to have fewer elements than there is room for.
    var task = queued;
    task.w = min(task.w, parameters.count);
    if (task.w - task.z <= parameters.leaf) {
        parts[0] = task;
        used = 1u;
        return;
    }
    let sizes = cell_sizes();
    var region = unpack_region(task.xy);
    var plane = Plane(3u, 0u, 0u);
    loop {
        region = refined(region, 0u);
        clear_bins();
        visit_region(region, parameters.table);
        plane = best_plane(task.w - task.z, sizes);
        if (plane.axis < 3u || region.level == 0u) {
            break;
        }
        // All is in one cell.
        region = tight_part(region, 0u, 0u, 8u);
    }
    if (plane.axis == 3u) {
        parts[0] = vec4<u32>(pack_region(tight_part(region, 0u, 0u, 8u)), task.zw);
        used = 1u;
        return;
    }
    let middle = task.z + plane.count;
    put_split(task.z, task.w, middle - 1u);
    let left = tight_part(region, plane.axis, 0u, plane.last + 1u);
    let right = tight_part(region, plane.axis, plane.last + 1u, 8u);
    parts[0] = vec4<u32>(pack_region(left), task.z, middle);
    parts[1] = vec4<u32>(pack_region(right), middle, task.w);
    used = 2u;
}

fn is_leaf(part: u32) -> bool {
    return used == 1u || parts[part].w - parts[part].z <= parameters.leaf;
}

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    used = 0u;
    if (id.x < min(atomicLoad(&tails[parameters.full]), parameters.capacity)) {
        divide(tasks[parameters.full * parameters.capacity + id.x]);
    }
    var leaves = 0u;
    for (var part = 0u; part < used; part++) {
        leaves += select(0u, 1u, is_leaf(part));
    }
    var place = reserve(lane, used - leaves, parameters.next);
    var leaf_place = reserve(lane, leaves, parameters.leaves);
    for (var part = 0u; part < used; part++) {
        if (is_leaf(part)) {
            leaf_tasks[leaf_place] = parts[part];
            leaf_place++;
        } else if (place < parameters.capacity) {
            tasks[parameters.next * parameters.capacity + place] = parts[part];
            place++;
        }
    }
}
