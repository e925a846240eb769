// The header of the binding `tables`: at these words stand the offsets of its sections, in words. As in
// `vastlight-transport`, `words::tables`.

const TABLES_ALBEDO: u32 = 0u;
const TABLES_MATERIALS: u32 = 1u;
const TABLES_INSTANCES: u32 = 2u;
const TABLES_TEXTURES: u32 = 3u;
const TABLES_MESHES: u32 = 4u;
const TABLES_CAMERA: u32 = 5u;
const TABLES_SRGB: u32 = 6u;
const TABLES_BLOCKS: u32 = 7u;
const TABLES_STARTS: u32 = 8u;
const TABLES_FIRST_ATTRIBUTES: u32 = 9u;
