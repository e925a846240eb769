// Morton codes, x highest.

/// The bits of a number below 1024, two places apart from each other.
fn spread(cell: u32) -> u32 {
    var x = (cell | (cell << 16u)) & 0x030000ffu;
    x = (x | (x << 8u)) & 0x0300f00fu;
    x = (x | (x << 4u)) & 0x030c30c3u;
    return (x | (x << 2u)) & 0x09249249u;
}

/// The number of which every third bit is one of these, from the lowest on.
fn gathered(code: u32) -> u32 {
    var x = code & 0x09249249u;
    x = (x | (x >> 2u)) & 0x030c30c3u;
    x = (x | (x >> 4u)) & 0x0300f00fu;
    x = (x | (x >> 8u)) & 0x030000ffu;
    return (x | (x >> 16u)) & 1023u;
}
