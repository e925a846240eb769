// One level of a collapse to wide nodes: what stands in the slots of a wide node and is no leaf becomes one.
//#include queue
//#include wide_slots

struct Parameters {
    capacity: u32,
    full: u32,
    next: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> nodes: array<Node>;
@group(0) @binding(2) var<storage, read_write> tails: array<atomic<u32>>;
@group(0) @binding(3) var<storage, read> queued: array<u32>;
@group(0) @binding(4) var<storage, read_write> next_queued: array<u32>;
@group(0) @binding(5) var<storage, read_write> is_wide: array<u32>;

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    var used = 0u;
    var wanted = 0u;
    if (id.x < min(atomicLoad(&tails[parameters.full]), parameters.capacity)) {
        used = open_slots(queued[id.x]);
        for (var slot = 0u; slot < used; slot++) {
            wanted += select(0u, 1u, areas[slot] >= 0.0);
        }
    }
    var place = reserve(lane, wanted, parameters.next);
    for (var slot = 0u; slot < used; slot++) {
        if (areas[slot] >= 0.0) {
            is_wide[slots[slot]] = 1u;
            if (place < parameters.capacity) {
                next_queued[place] = slots[slot];
            }
            place++;
        }
    }
}
