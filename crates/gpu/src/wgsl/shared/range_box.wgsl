// The box around a run of boxes, from the pyramid over them: at most six boxes of each level. Who includes this has a
// `pyramid: array<Box>`.
//#include boxes

/// Levels above one with at most so many boxes may be missing.
const TOP: u32 = 32u;

/// The box around `first..end` of `count` boxes.
fn range_box(first: u32, end: u32, count: u32) -> Box {
    var around = empty_box();
    var low = first;
    var high = end;
    var start = 0u;
    var length = count;
    while (high > low + 8u && length > TOP) {
        for (; (low & 3u) != 0u; low++) {
            around = join(around, pyramid[start + low]);
        }
        for (; (high & 3u) != 0u; high--) {
            around = join(around, pyramid[start + high - 1u]);
        }
        low >>= 2u;
        high >>= 2u;
        start += length;
        length = (length + 3u) / 4u;
    }
    for (; low < high; low++) {
        around = join(around, pyramid[start + low]);
    }
    return around;
}
