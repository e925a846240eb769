// A node of a binary tree, as on the CPU.
//#include boxes

struct Node {
    bounds: Box,
    left: u32,
    first: u32,
    count: u32,
}
