// The tree over clusters, by the surface-area heuristic over a grid of their cells: Garanzha, Premoze, Bely, Galaktionov 2011,
// "Grid-based SAH BVH construction on a GPU", its TopGrid alone. A task is a node with a region of cells; its
// children go to the next queue. One workgroup takes level after level: it may wait for itself.
//#include cell_sizes
//#include clusters
//#include group
//#include region_cells
//#include splits

struct Parameters {
    count: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> extents: array<u32, 6>;
@group(0) @binding(2) var<storage, read> cells: array<u32>;
/// Two queues of CELLS tasks: a region, and start and end of the elements in it.
@group(0) @binding(3) var<storage, read_write> tasks: array<vec4<u32>>;
/// Where the cluster of each cell that has one goes.
@group(0) @binding(4) var<storage, read_write> places: array<u32>;
@group(0) @binding(5) var<storage, read_write> spans: array<vec2<u32>>;
@group(0) @binding(6) var<storage, read_write> starting: array<atomic<u32>>;

var<workgroup> added: atomic<u32>;
var<workgroup> held: u32;

fn visit_cell(place: vec3<u32>, begin: u32, end: u32) {
    add_cell(place, end - begin);
}

/// Splits a task, and queues its children from `to_queue` on; or places its cluster.
fn work(task: vec4<u32>, sizes: array<u32, 3>, to_queue: u32) {
    var region = refined(unpack_region(task.xy), CLUSTER_LEVEL);
    clear_bins();
    visit_cells(region, CLUSTER_LEVEL);
    var plane = best_plane(task.w - task.z, sizes);
    while (plane.axis == 3u && region.level > CLUSTER_LEVEL) {
        // All is in one cell.
        region = refined(tight_part(region, 0u, 0u, 8u), CLUSTER_LEVEL);
        clear_bins();
        visit_cells(region, CLUSTER_LEVEL);
        plane = best_plane(task.w - task.z, sizes);
    }
    if (plane.axis == 3u) {
        let own = tight_part(region, 0u, 0u, 8u);
        places[cell_number(own.low[0], own.low[1], own.low[2])] = task.z;
        return;
    }
    let middle = task.z + plane.count;
    put_split(task.z, task.w, middle - 1u);
    let left = tight_part(region, plane.axis, 0u, plane.last + 1u);
    let right = tight_part(region, plane.axis, plane.last + 1u, 8u);
    let place = to_queue + atomicAdd(&added, 2u);
    tasks[place] = vec4<u32>(pack_region(left), task.z, middle);
    tasks[place + 1u] = vec4<u32>(pack_region(right), middle, task.w);
}

@compute @workgroup_size(GROUP)
fn main(@builtin(local_invocation_index) lane: u32) {
    let sizes = cell_sizes();
    if (lane == 0u) {
        let whole = Region(array<u32, 3>(0u, 0u, 0u), array<u32, 3>(7u, 7u, 7u), COARSEST);
        tasks[0] = vec4<u32>(pack_region(whole), 0u, parameters.count);
        held = 1u;
        atomicStore(&added, 0u);
    }
    storageBarrier();
    var full = 0u;
    loop {
        let tail = workgroupUniformLoad(&held);
        if (tail == 0u) {
            break;
        }
        for (var i = lane; i < tail; i += GROUP) {
            work(tasks[full + i], sizes, CELLS - full);
        }
        storageBarrier();
        workgroupBarrier();
        if (lane == 0u) {
            held = atomicExchange(&added, 0u);
        }
        full = CELLS - full;
    }
}
