// Moves a tile's elements to their places in the order of a digit. Who includes this says by `carry(origin, place)` what goes
// along with a key.
//#include radix
//#include radix_rank

@group(0) @binding(2) var<storage, read> firsts: array<u32>;
@group(0) @binding(3) var<storage, read_write> sorted_keys: array<u32>;

@compute @workgroup_size(GROUP)
fn main(@builtin(workgroup_id) tile: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let start = tile.x * TILE;
    var items: array<u32, ITEMS>;
    for (var k = 0u; k < ITEMS; k++) {
        let place = lane * ITEMS + k;
        // What is beyond the end goes behind all that is not.
        var digit = 255u;
        if (start + place < parameters.count) {
            digit = digit_of(keys[start + place]);
        }
        items[k] = (digit << 16u) | place;
    }
    var places: array<u32, ITEMS>;
    sort_tile(lane, &items, &places);
    for (var k = 0u; k < ITEMS; k++) {
        let origin = start + (items[k] & 0xffffu);
        if (origin < parameters.count) {
            let target_place = firsts[(items[k] >> 16u) * parameters.tiles + tile.x] + places[k];
            sorted_keys[target_place] = keys[origin];
            carry(origin, target_place);
        }
    }
}
