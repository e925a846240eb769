// The place of codes among sorted ones. Who includes this has `codes: array<u32>`.

/// The first of a stretch of codes that is not below `code`, or its end.
fn place_of(code: u32, start: u32, end: u32) -> u32 {
    var low = start;
    var high = end;
    while (low < high) {
        let middle = (low + high) / 2u;
        if (codes[middle] < code) {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    return low;
}
