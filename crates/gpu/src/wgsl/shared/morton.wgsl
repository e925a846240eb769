// Morton codes, x highest.

/// The bits of a number below 1024, two places apart from each other.
fn spread(cell: u32) -> u32 {
    var x = (cell | (cell << 16u)) & 0x030000ffu;
    x = (x | (x << 8u)) & 0x0300f00fu;
    x = (x | (x << 4u)) & 0x030c30c3u;
    return (x | (x << 2u)) & 0x09249249u;
}
