// Sorting a tile by eight bits in the memory of its workgroup: Satish, Harris, Garland 2009, "Designing efficient
// sorting algorithms for manycore GPUs", with counters of two digits in a word as in Merrill, Grimshaw 2011.
// An item is its digit << 16 | its place in the tile.
//#include group_scan

/// Counters of digits d (low half) and d + 8 (high half) of each invocation; then items; then starts of digits.
var<workgroup> radix_words: array<u32, TILE>;

/// Sorts the tile's items, eight in a row from each invocation, by four bits from `shift` on, stably.
fn sort_by_nibble(lane: u32, shift: u32, items: ptr<function, array<u32, ITEMS>>) {
    for (var d = 0u; d < 8u; d++) {
        radix_words[d * GROUP + lane] = 0u;
    }
    var places: array<u32, ITEMS>;
    for (var k = 0u; k < ITEMS; k++) {
        let digit = ((*items)[k] >> shift) & 15u;
        let word = (digit & 7u) * GROUP + lane;
        let half = (digit >> 3u) * 16u;
        let counted = radix_words[word];
        places[k] = (counted >> half) & 0xffffu;
        radix_words[word] = counted + (1u << half);
    }
    workgroupBarrier();
    var sum = 0u;
    for (var k = 0u; k < ITEMS; k++) {
        sum += radix_words[lane * ITEMS + k];
    }
    let before = group_scan(lane, sum);
    // The digits of the high halves come after all of the low ones.
    var running = before.x + (before.y << 16u);
    for (var k = 0u; k < ITEMS; k++) {
        let counted = radix_words[lane * ITEMS + k];
        radix_words[lane * ITEMS + k] = running;
        running += counted;
    }
    workgroupBarrier();
    for (var k = 0u; k < ITEMS; k++) {
        let digit = ((*items)[k] >> shift) & 15u;
        places[k] += (radix_words[(digit & 7u) * GROUP + lane] >> ((digit >> 3u) * 16u)) & 0xffffu;
    }
    workgroupBarrier();
    for (var k = 0u; k < ITEMS; k++) {
        radix_words[places[k]] = (*items)[k];
    }
    workgroupBarrier();
}

/// Sorts the tile by the digit of its keys. Gives the items k * GROUP + lane in order, and in `places` the place of
/// each among those of its digit.
fn sort_tile(lane: u32, items: ptr<function, array<u32, ITEMS>>, places: ptr<function, array<u32, ITEMS>>) {
    sort_by_nibble(lane, 16u, items);
    for (var k = 0u; k < ITEMS; k++) {
        (*items)[k] = radix_words[lane * ITEMS + k];
    }
    workgroupBarrier();
    sort_by_nibble(lane, 20u, items);
    var first = 0u;
    for (var k = 0u; k < ITEMS; k++) {
        let p = k * GROUP + lane;
        let item = radix_words[p];
        (*items)[k] = item;
        if (p == 0u || radix_words[max(p, 1u) - 1u] >> 16u != item >> 16u) {
            first |= 1u << k;
        }
    }
    workgroupBarrier();
    for (var k = 0u; k < ITEMS; k++) {
        if (((first >> k) & 1u) != 0u) {
            radix_words[(*items)[k] >> 16u] = k * GROUP + lane;
        }
    }
    workgroupBarrier();
    for (var k = 0u; k < ITEMS; k++) {
        (*places)[k] = k * GROUP + lane - radix_words[(*items)[k] >> 16u];
    }
}
