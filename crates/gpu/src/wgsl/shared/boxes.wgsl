// Boxes as six words, lower corner and upper corner, whose order as unsigned numbers is that of the coordinates. Least and greatest
// of them are exact and one and the same in any order, and no compiler may take a coordinate for something else.

alias Box = array<u32, 6>;

/// The word of a coordinate.
fn ordered(bits: u32) -> u32 {
    return select(bits | 0x80000000u, ~bits, (bits >> 31u) != 0u);
}

/// The bits of the coordinate behind a word.
fn coordinate(word: u32) -> u32 {
    return select(~word, word ^ 0x80000000u, (word >> 31u) != 0u);
}

/// The box that contains nothing.
fn empty_box() -> Box {
    return Box(0xffffffffu, 0xffffffffu, 0xffffffffu, 0u, 0u, 0u);
}

/// The smallest box around both.
fn join(a: Box, b: Box) -> Box {
    return Box(
        min(a[0], b[0]), min(a[1], b[1]), min(a[2], b[2]),
        max(a[3], b[3]), max(a[4], b[4]), max(a[5], b[5]),
    );
}

/// The same with coordinates in place of their words.
fn coordinates(b: Box) -> Box {
    return Box(
        coordinate(b[0]), coordinate(b[1]), coordinate(b[2]),
        coordinate(b[3]), coordinate(b[4]), coordinate(b[5]),
    );
}
