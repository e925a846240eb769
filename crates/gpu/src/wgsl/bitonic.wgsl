// Sorts short stretches of pairs, each in the memory of one workgroup: Batcher 1968, "Sorting networks and their
// applications". Equal keys are told apart by their place, so that the order is that of a stable sort.
//#include group

const LONGEST: u32 = 1024u;

struct Parameters {
    count: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> stretches: array<vec2<u32>>;
@group(0) @binding(2) var<storage, read> keys: array<u32>;
@group(0) @binding(3) var<storage, read> payloads: array<u32>;
@group(0) @binding(4) var<storage, read_write> sorted_keys: array<u32>;
@group(0) @binding(5) var<storage, read_write> sorted_payloads: array<u32>;

var<workgroup> own_keys: array<u32, LONGEST>;
var<workgroup> own_places: array<u32, LONGEST>;

/// Puts two elements in order, or in reverse order.
fn exchange(a: u32, b: u32, ascending: bool) {
    let key_a = own_keys[a];
    let key_b = own_keys[b];
    let place_a = own_places[a];
    let place_b = own_places[b];
    let ordered = key_a < key_b || (key_a == key_b && place_a < place_b);
    if (ordered != ascending) {
        own_keys[a] = key_b;
        own_keys[b] = key_a;
        own_places[a] = place_b;
        own_places[b] = place_a;
    }
}

@compute @workgroup_size(GROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    if (group.x >= parameters.count) {
        return;
    }
    let start = stretches[group.x].x;
    let length = min(stretches[group.x].y, LONGEST);
    for (var i = lane; i < LONGEST; i += GROUP) {
        // What is beyond the end stays there: no key is greater, and its place is behind all others.
        own_keys[i] = 0xffffffffu;
        if (i < length) {
            own_keys[i] = keys[start + i];
        }
        own_places[i] = i;
    }
    workgroupBarrier();
    for (var block = 2u; block <= LONGEST; block <<= 1u) {
        for (var distance = block >> 1u; distance > 0u; distance >>= 1u) {
            for (var pair = lane; pair < LONGEST / 2u; pair += GROUP) {
                let a = pair * 2u - (pair & (distance - 1u));
                exchange(a, a + distance, (a & block) == 0u);
            }
            workgroupBarrier();
        }
    }
    for (var i = lane; i < length; i += GROUP) {
        sorted_keys[start + i] = own_keys[i];
        sorted_payloads[start + i] = payloads[start + own_places[i]];
    }
}
