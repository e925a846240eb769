// The place of codes among sorted ones. Who includes this has `codes: array<u32>` and their number, `parameters.count`.

/// Where a code, or what is above it, begins.
fn place_of(code: u32) -> u32 {
    var low = 0u;
    var high = parameters.count;
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
