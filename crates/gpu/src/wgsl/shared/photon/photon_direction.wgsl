// Unit vectors in few bits, as in `vastlight-transport`, `photon::direction`: two numbers of 14 bits each, and four bits above them.
//#include frame

const DIRECTION_BITS: u32 = 14u;
const DIRECTION_MASK: u32 = 16383u;
/// The greatest of the two numbers.
const DIRECTION_STEPS: f32 = 16382.0;

/// Across the edge of the upper half's square.
fn direction_folded(uv: vec2<f32>) -> vec2<f32> {
    return vec2<f32>(real_copysign(1.0 - abs(uv.y), uv.x), real_copysign(1.0 - abs(uv.x), uv.y));
}

/// The direction, and four bits that `above` ends with.
fn direction_pack(direction: vec3<f32>, above: u32) -> u32 {
    let d = direction / (abs(direction.x) + abs(direction.y) + abs(direction.z));
    let uv = select(direction_folded(d.xy), d.xy, d.z >= 0.0);
    let half = DIRECTION_STEPS * 0.5;
    let number = vec2<u32>(uv * half + (half + 0.5));
    return number.x | (number.y << DIRECTION_BITS) | ((above & 15u) << (2u * DIRECTION_BITS));
}

fn direction_unpack(word: u32) -> vec3<f32> {
    let number = vec2<u32>(word & DIRECTION_MASK, (word >> DIRECTION_BITS) & DIRECTION_MASK);
    let uv = vec2<f32>(number) * (2.0 / DIRECTION_STEPS) - 1.0;
    let z = 1.0 - abs(uv.x) - abs(uv.y);
    return normalize(vec3<f32>(select(direction_folded(uv), uv, z >= 0.0), z));
}
