// The words in which all lights lie: see `vastlight-transport`, `light::words`. Who includes this has `lights`.

/// Words of the header.
const LIGHT_TREE: u32 = 0u;
const LIGHT_TRAILS: u32 = 2u;
const LIGHT_SURFACES: u32 = 3u;
const LIGHT_SURFACE_COUNT: u32 = 4u;
const LIGHT_PUNCTUAL: u32 = 5u;
const LIGHT_MESHES: u32 = 6u;
const LIGHT_MESH_COUNT: u32 = 7u;
const LIGHT_BACKGROUND: u32 = 8u;
const LIGHT_BACKGROUND_KIND: u32 = 9u;
const LIGHT_MEANS: u32 = 10u;
const LIGHT_SUN: u32 = 12u;
const LIGHT_DIRECTIONAL: u32 = 13u;
const LIGHT_DIRECTIONAL_COUNT: u32 = 14u;

/// A number that names nothing.
const LIGHT_NONE: u32 = 0xffffffffu;
/// The largest number below 1.
const LIGHT_BELOW_ONE: f32 = 0.99999994;
/// The distance of lights at infinity.
const LIGHT_FAR: f32 = 1e30;

fn light_f32(at: u32) -> f32 {
    return bitcast<f32>(lights[at]);
}

fn light_vec2(at: u32) -> vec2<f32> {
    return vec2<f32>(light_f32(at), light_f32(at + 1u));
}

fn light_vec3(at: u32) -> vec3<f32> {
    return vec3<f32>(light_f32(at), light_f32(at + 1u), light_f32(at + 2u));
}

fn light_is_zero(v: vec3<f32>) -> bool {
    return v.x == 0.0 && v.y == 0.0 && v.z == 0.0;
}
