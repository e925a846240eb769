// How large cells are along each axis. Who includes this has `extents: array<u32, 6>`, the box around twice the centres.
//#include boxes

/// The sizes in whole numbers, the largest from 2048 to 4095, none less than 1: areas of boxes of eight cells a side have 32 bits.
fn cell_sizes() -> array<u32, 3> {
    var sizes: array<f32, 3>;
    var largest = 0.0;
    for (var axis = 0u; axis < 3u; axis++) {
        sizes[axis] = bitcast<f32>(coordinate(extents[axis + 3u])) - bitcast<f32>(coordinate(extents[axis]));
        largest = max(largest, sizes[axis]);
    }
    let exponent = bitcast<u32>(largest) >> 23u;
    if (exponent < 11u) {
        return array<u32, 3>(1u, 1u, 1u);
    }
    // A power of two: the products are exact.
    let scale = bitcast<f32>((265u - exponent) << 23u);
    return array<u32, 3>(
        max(u32(sizes[0] * scale), 1u),
        max(u32(sizes[1] * scale), 1u),
        max(u32(sizes[2] * scale), 1u),
    );
}
