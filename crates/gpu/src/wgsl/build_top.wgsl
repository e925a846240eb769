// The tree over clusters, by the surface-area heuristic over a grid of their cells: Garanzha, Premoze, Bely, Galaktionov 2011,
// "Grid-based SAH BVH construction on a GPU", its TopGrid alone. A task is a node with a region of cells; its
// children go to the next queue. One workgroup takes level after level: it may wait for itself.
//#include clusters
//#include doubled_centre
//#include group
//#include region
//#include splits

struct Parameters {
    count: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> extents: array<u32, 6>;
@group(0) @binding(2) var<storage, read> cells: array<u32>;
/// Two queues of CELLS tasks: a region, and start and end of the elements in it.
@group(0) @binding(3) var<storage, read_write> tasks: array<vec3<u32>>;
/// Where the cluster of each cell that has one goes.
@group(0) @binding(4) var<storage, read_write> places: array<u32>;
@group(0) @binding(5) var<storage, read_write> spans: array<vec2<u32>>;
@group(0) @binding(6) var<storage, read_write> starting: array<atomic<u32>>;

var<workgroup> added: atomic<u32>;
var<workgroup> held: u32;

/// The sizes of cells in whole numbers, the largest from 512 to 1023; all 1 where there is no size.
fn cell_sizes() -> array<u32, 3> {
    var sizes: array<f32, 3>;
    var largest = 0.0;
    for (var axis = 0u; axis < 3u; axis++) {
        sizes[axis] = bitcast<f32>(coordinate(extents[axis + 3u])) - bitcast<f32>(coordinate(extents[axis]));
        largest = max(largest, sizes[axis]);
    }
    let exponent = bitcast<u32>(largest) >> 23u;
    if (exponent < 10u) {
        return array<u32, 3>(1u, 1u, 1u);
    }
    // A power of two: the products are exact.
    let scale = bitcast<f32>((263u - exponent) << 23u);
    return array<u32, 3>(u32(sizes[0] * scale), u32(sizes[1] * scale), u32(sizes[2] * scale));
}

/// Splits a task, and queues its children from `to_queue` on; or places its cluster.
fn work(task: vec3<u32>, sizes: array<u32, 3>, to_queue: u32) {
    var region = refined(unpack_region(task.x));
    fill_bins(region);
    var plane = best_plane(task.z - task.y, sizes);
    while (plane.axis == 3u && region.level > 0u) {
        // All is in one cell.
        region = refined(tight_part(region, 0u, 0u, 8u));
        fill_bins(region);
        plane = best_plane(task.z - task.y, sizes);
    }
    if (plane.axis == 3u) {
        let own = tight_part(region, 0u, 0u, 8u);
        places[cell_number(own.low[0], own.low[1], own.low[2], 0u)] = task.y;
        return;
    }
    let middle = task.y + plane.count;
    put_split(task.y, task.z, middle - 1u);
    let left = tight_part(region, plane.axis, 0u, plane.last + 1u);
    let right = tight_part(region, plane.axis, plane.last + 1u, 8u);
    let place = to_queue + atomicAdd(&added, 2u);
    tasks[place] = vec3<u32>(pack_region(left), task.y, middle);
    tasks[place + 1u] = vec3<u32>(pack_region(right), middle, task.z);
}

@compute @workgroup_size(GROUP)
fn main(@builtin(local_invocation_index) lane: u32) {
    let sizes = cell_sizes();
    if (lane == 0u) {
        let whole = Region(array<u32, 3>(0u, 0u, 0u), array<u32, 3>(7u, 7u, 7u), COARSEST);
        tasks[0] = vec3<u32>(pack_region(whole), 0u, parameters.count);
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
