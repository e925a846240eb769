// One level of a build from codes: Garanzha, Pantaleoni, McAllister 2011, "Simpler and faster HLBVH with work queues". A run is split
// where the highest bit that is not the same in all its codes becomes 1, found by binary search; equal codes are halved. Halves that
// are longer than a leaf go to the next queue.
//#include queue
//#include splits

struct Parameters {
    count: u32,
    capacity: u32,
    leaf: u32,
    full: u32,
    next: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> codes: array<u32>;
@group(0) @binding(2) var<storage, read_write> tails: array<atomic<u32>>;
@group(0) @binding(3) var<storage, read> runs: array<vec2<u32>>;
@group(0) @binding(4) var<storage, read_write> next_runs: array<vec2<u32>>;
@group(0) @binding(5) var<storage, read_write> spans: array<vec2<u32>>;
@group(0) @binding(6) var<storage, read_write> starting: array<atomic<u32>>;

/// How many elements of a run, two at least, go left.
fn left_of(run: vec2<u32>) -> u32 {
    let differ = codes[run.x] ^ codes[run.y - 1u];
    if (differ == 0u) {
        return (run.y - run.x) / 2u;
    }
    let bit = 1u << firstLeadingBit(differ);
    var low = run.x;
    var high = run.y;
    while (low < high) {
        let middle = (low + high) / 2u;
        if ((codes[middle] & bit) == 0u) {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    return low - run.x;
}

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let leaf = parameters.leaf;
    var run = vec2<u32>(0u, 0u);
    var middle = 0u;
    if (id.x < min(atomicLoad(&tails[parameters.full]), parameters.capacity)) {
        run = runs[id.x];
        run.y = min(run.y, parameters.count);
        middle = run.y;
        let length = run.y - run.x;
        // The first run may turn out to be no longer than a leaf.
        if (length > leaf) {
            var left = left_of(run);
            if (length <= 2u * leaf) {
                left = clamp(left, length - leaf, leaf);
            }
            middle = run.x + left;
            put_split(run.x, run.y, middle - 1u);
        }
    }
    let goes_left = middle - run.x > leaf;
    let goes_right = run.y - middle > leaf;
    let wanted = select(0u, 1u, goes_left) + select(0u, 1u, goes_right);
    let place = reserve(lane, wanted, parameters.next);
    if (goes_left && place < parameters.capacity) {
        next_runs[place] = vec2<u32>(run.x, middle);
    }
    let right_place = place + select(0u, 1u, goes_left);
    if (goes_right && right_place < parameters.capacity) {
        next_runs[right_place] = vec2<u32>(middle, run.y);
    }
}
