// Where things stand in the records of `tables`: as in `vastlight-transport`, `words`.

// Materials.
const MATERIAL_WORDS: u32 = 110u;
const MATERIAL_UV_SETS: u32 = 1u;
const MATERIAL_IOR: u32 = 2u;
const MATERIAL_ATTENUATION: u32 = 3u;
const MATERIAL_CONDUCTOR: u32 = 6u;
const MATERIAL_DISPERSION: u32 = 15u;
const MATERIAL_ANISOTROPY: u32 = 16u;
const MATERIAL_ANISOTROPY_DIRECTION: u32 = 17u;
const MATERIAL_IRIDESCENCE_IOR: u32 = 19u;
const MATERIAL_THICKNESS: u32 = 20u;
const MATERIAL_CUTOFF: u32 = 22u;
const MATERIAL_NORMAL_SCALES: u32 = 23u;
const MATERIAL_INPUTS: u32 = 25u;
const MATERIAL_INPUT_WORDS: u32 = 5u;
const MATERIAL_EXACT: u32 = 256u;
const MATERIAL_ALL_INPUTS: u32 = 17u;

// Bits of a material's first word.
const FLAG_UNLIT: u32 = 1u;
const FLAG_TWO_SIDED: u32 = 2u;
const FLAG_NEEDS_TANGENT: u32 = 4u;
const FLAG_ALPHA: u32 = 8u;
const FLAG_MASK: u32 = 16u;
const FLAG_PANE: u32 = 32u;
const FLAG_THIN: u32 = 64u;
const FLAG_CONDUCTOR: u32 = 128u;
const FLAG_NORMAL_MAP: u32 = 256u;
const FLAG_COAT_NORMAL_MAP: u32 = 512u;
const FLAG_ANISOTROPY_TEXTURE: u32 = 1024u;
const FLAG_THICKNESS_TEXTURE: u32 = 2048u;
const FLAG_CLEAR: u32 = 4096u;

// A material's inputs.
const INPUT_ALPHA: u32 = 0u;
const INPUT_BASE_COLOR: u32 = 1u;
const INPUT_METALLIC: u32 = 2u;
const INPUT_ROUGHNESS: u32 = 3u;
const INPUT_TRANSMISSION: u32 = 4u;
const INPUT_SPECULAR: u32 = 5u;
const INPUT_SPECULAR_COLOR: u32 = 6u;
const INPUT_CLEARCOAT: u32 = 7u;
const INPUT_CLEARCOAT_ROUGHNESS: u32 = 8u;
const INPUT_SHEEN_COLOR: u32 = 9u;
const INPUT_SHEEN_ROUGHNESS: u32 = 10u;
const INPUT_IRIDESCENCE: u32 = 11u;
const INPUT_THICKNESS: u32 = 12u;
const INPUT_ANISOTROPY: u32 = 13u;
const INPUT_NORMAL: u32 = 14u;
const INPUT_COAT_NORMAL: u32 = 15u;
const INPUT_EMISSION: u32 = 16u;

// Textures.
const TEXTURE_WORDS: u32 = 14u;
const TEXTURE_MATRIX: u32 = 0u;
const TEXTURE_TEXELS: u32 = 6u;
const TEXTURE_WRAP: u32 = 7u;
const TEXTURE_NEAREST: u32 = 9u;
const TEXTURE_SRGB: u32 = 10u;
const TEXTURE_UV_SET: u32 = 11u;
const TEXTURE_LEVELS: u32 = 12u;
const TEXTURE_LEVEL_COUNT: u32 = 13u;
const TEXTURE_LEVEL_WORDS: u32 = 5u;

// Meshes and instances.
const GEOMETRY_MESH_WORDS: u32 = 12u;
const GEOMETRY_TRIANGLES: u32 = 0u;
const GEOMETRY_POSITIONS: u32 = 1u;
const GEOMETRY_NORMALS: u32 = 2u;
const GEOMETRY_TANGENTS: u32 = 3u;
const GEOMETRY_COLORS: u32 = 4u;
const GEOMETRY_UVS: u32 = 5u;
const GEOMETRY_PARTS: u32 = 9u;
const GEOMETRY_PART_COUNT: u32 = 10u;
const GEOMETRY_VEILED: u32 = 11u;
const GEOMETRY_INSTANCE_WORDS: u32 = 26u;
const GEOMETRY_MAP: u32 = 0u;
const GEOMETRY_NORMAL_MAP: u32 = 12u;
const GEOMETRY_HANDEDNESS: u32 = 21u;
const GEOMETRY_NORM: u32 = 22u;
const GEOMETRY_MESH: u32 = 25u;

// The camera.
const CAMERA_MAP: u32 = 0u;
const CAMERA_SCALE: u32 = 12u;
const CAMERA_AXIS: u32 = 16u;
const CAMERA_LENS: u32 = 19u;
const CAMERA_ORTHOGRAPHIC: u32 = 21u;
const CAMERA_CONE: u32 = 22u;
const CAMERA_FILTER: u32 = 24u;
