// How work is cut: a workgroup of GROUP invocations takes a tile of TILE elements.
const GROUP: u32 = 256u;
const ITEMS: u32 = 8u;
const TILE: u32 = GROUP * ITEMS;
