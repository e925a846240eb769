// Tables of directional albedo as in `vastlight-transport`, `bsdf::albedo` and `bsdf::sheen`, which
// `words::put_albedo` writes. Who includes this has `tables`.
//#include tables

const ALBEDO_COSINES: u32 = 16u;
const ALBEDO_ROUGHNESSES: u32 = 16u;
const ALBEDO_INDICES: u32 = 8u;
/// `(n - 1) / (n + 1)` of the last node.
const ALBEDO_LARGEST_CONTRAST: f32 = 0.6;
/// Where in the section the tables start: full reflection and its means; bounces, two words each, and their means; sheen.
const ALBEDO_FULL_AVERAGES: u32 = ALBEDO_COSINES * ALBEDO_ROUGHNESSES;
const ALBEDO_BOUNCES: u32 = ALBEDO_FULL_AVERAGES + ALBEDO_ROUGHNESSES;
const ALBEDO_BOUNCE_PLANE: u32 = 2u * ALBEDO_COSINES * ALBEDO_ROUGHNESSES;
const ALBEDO_BOUNCE_AVERAGES: u32 = ALBEDO_BOUNCES + 2u * ALBEDO_INDICES * ALBEDO_BOUNCE_PLANE;
const ALBEDO_SHEEN: u32 = ALBEDO_BOUNCE_AVERAGES + 4u * ALBEDO_INDICES * ALBEDO_ROUGHNESSES;

/// The node below a number in [0, 1] and the fraction beyond it.
struct AlbedoNode {
    below: u32,
    beyond: f32,
}

fn albedo_node(x: f32, nodes: u32) -> AlbedoNode {
    let t = clamp(x, 0.0, 1.0) * f32(nodes - 1u);
    let below = min(u32(t), nodes - 2u);
    return AlbedoNode(below, t - f32(below));
}

fn albedo_number(at: u32) -> f32 {
    return bitcast<f32>(tables[tables[TABLES_ALBEDO] + at]);
}

/// Between this number and the next.
fn albedo_between(at: u32, beyond: f32) -> f32 {
    let a = albedo_number(at);
    return a + (albedo_number(at + 1u) - a) * beyond;
}

/// Between four numbers of a plane with rows of 16.
fn albedo_of_plane(plane: u32, row: AlbedoNode, column: AlbedoNode) -> f32 {
    let at = plane + row.below * ALBEDO_COSINES + column.below;
    let a = albedo_between(at, column.beyond);
    return a + (albedo_between(at + ALBEDO_COSINES, column.beyond) - a) * row.beyond;
}

/// Share of light reflected in one bounce by microfacets that absorb nothing.
fn albedo_full(cos_theta: f32, roughness: f32) -> f32 {
    let r = albedo_node(roughness, ALBEDO_ROUGHNESSES);
    return albedo_of_plane(0u, r, albedo_node(sqrt(cos_theta), ALBEDO_COSINES));
}

/// Its cosine-weighted mean over the hemisphere.
fn albedo_full_average(roughness: f32) -> f32 {
    let r = albedo_node(roughness, ALBEDO_ROUGHNESSES);
    return albedo_between(ALBEDO_FULL_AVERAGES + r.below, r.beyond);
}

/// The table axis of an index of refraction.
fn albedo_contrast(ior: f32) -> f32 {
    return abs(ior - 1.0) / (ior + 1.0);
}

/// Rise and loss between two bounces that follow each other.
fn albedo_bounce_between(at: u32, beyond: f32) -> vec2<f32> {
    let a = vec2<f32>(albedo_number(at), albedo_number(at + 1u));
    return a + (vec2<f32>(albedo_number(at + 2u), albedo_number(at + 3u)) - a) * beyond;
}

/// One bounce at a dielectric, from a direction outside or inside: rise (x) and loss (y).
fn albedo_bounce(inside: bool, contrast: f32, cos_theta: f32, roughness: f32) -> vec2<f32> {
    let i = albedo_node(contrast * (1.0 / ALBEDO_LARGEST_CONTRAST), ALBEDO_INDICES);
    let r = albedo_node(roughness, ALBEDO_ROUGHNESSES);
    let c = albedo_node(sqrt(cos_theta), ALBEDO_COSINES);
    let side = ALBEDO_BOUNCES + select(0u, ALBEDO_INDICES * ALBEDO_BOUNCE_PLANE, inside);
    let at = side + i.below * ALBEDO_BOUNCE_PLANE + 2u * (r.below * ALBEDO_COSINES + c.below);
    let row = 2u * ALBEDO_COSINES;
    let a = albedo_bounce_between(at, c.beyond);
    let b = albedo_bounce_between(at + row, c.beyond);
    let next = at + ALBEDO_BOUNCE_PLANE;
    let d = albedo_bounce_between(next, c.beyond);
    let e = albedo_bounce_between(next + row, c.beyond);
    let low = a + (b - a) * r.beyond;
    return low + (d + (e - d) * r.beyond - low) * i.beyond;
}

/// Its cosine-weighted mean over the hemisphere.
fn albedo_bounce_average(inside: bool, contrast: f32, roughness: f32) -> vec2<f32> {
    let i = albedo_node(contrast * (1.0 / ALBEDO_LARGEST_CONTRAST), ALBEDO_INDICES);
    let r = albedo_node(roughness, ALBEDO_ROUGHNESSES);
    let index = i.below + select(0u, ALBEDO_INDICES, inside);
    let at = ALBEDO_BOUNCE_AVERAGES + 2u * (index * ALBEDO_ROUGHNESSES + r.below);
    let low = albedo_bounce_between(at, r.beyond);
    return low + (albedo_bounce_between(at + 2u * ALBEDO_ROUGHNESSES, r.beyond) - low) * i.beyond;
}
