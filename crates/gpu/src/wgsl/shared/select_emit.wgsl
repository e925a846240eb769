// Placing chosen elements: Blelloch 1990, "Prefix sums and their applications", packing.
// Who includes this says by `selected(i)` which elements are chosen and by `emit(i, place)` where they go.
//#include group_scan

/// Hands each chosen element of the tile its place, from `first` on.
fn emit_selected(lane: u32, tile: u32, count: u32, first: u32) {
    let start = tile * TILE + lane * ITEMS;
    var chosen = 0u;
    for (var k = 0u; k < ITEMS; k++) {
        if (start + k < count && selected(start + k)) {
            chosen |= 1u << k;
        }
    }
    var place = first + group_scan(lane, countOneBits(chosen)).x;
    for (var k = 0u; k < ITEMS; k++) {
        if (((chosen >> k) & 1u) != 0u) {
            emit(start + k, place);
            place++;
        }
    }
}
