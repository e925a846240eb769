// Measured distributions of luminaires, as in `vastlight-transport`, `light::ies`.
//#include light_words
//#include real

/// Rounding of the angle must not darken the pole.
const LIGHT_IES_SLACK: f32 = 1e-2;

/// Two neighbours and the fraction between them; `below` is LIGHT_NONE outside.
struct LightBracket {
    below: u32,
    above: u32,
    fraction: f32,
}

/// How many of the first `count` numbers from `at` on are at most `x`; they ascend.
fn light_partition_f32(at: u32, count: u32, x: f32) -> u32 {
    var first = 0u;
    var end = count;
    while (first < end) {
        let middle = (first + end) / 2u;
        if (light_f32(at + middle) <= x) {
            first = middle + 1u;
        } else {
            end = middle;
        }
    }
    return first;
}

/// The neighbours of `x` in an ascending list of angles.
fn light_bracket(angles: u32, count: u32, x: f32) -> LightBracket {
    let none = LightBracket(LIGHT_NONE, 0u, 0.0);
    if (count == 0u) {
        return none;
    }
    if (x < light_f32(angles) - LIGHT_IES_SLACK || x > light_f32(angles + count - 1u) + LIGHT_IES_SLACK) {
        return none;
    }
    let above = min(clamp(light_partition_f32(angles, count, x), 1u, max(count, 2u) - 1u), count - 1u);
    let below = max(above, 1u) - 1u;
    let low = light_f32(angles + below);
    let width = light_f32(angles + above) - low;
    var fraction = 0.0;
    if (width > 0.0) {
        fraction = clamp((x - low) / width, 0.0, 1.0);
    }
    return LightBracket(below, above, fraction);
}

/// An angle brought into a full turn of degrees.
fn light_full_turn(x: f32) -> f32 {
    return x - 360.0 * floor(x / 360.0);
}

/// `light_bracket` on the circle of 360 degrees.
fn light_bracket_turn(angles: u32, count: u32, x: f32) -> LightBracket {
    if (count == 0u) {
        return LightBracket(0u, 0u, 0.0);
    }
    let first = light_f32(angles);
    let last = light_f32(angles + count - 1u);
    if (x >= first && x <= last) {
        return light_bracket(angles, count, x);
    }
    let gap = first + 360.0 - last;
    var fraction = 0.0;
    if (gap > 0.0) {
        fraction = clamp(light_full_turn(x - last) / gap, 0.0, 1.0);
    }
    return LightBracket(count - 1u, 0u, fraction);
}

/// The value of the profile at the word `profile` for light that leaves along `direction`, a unit vector in the light's
/// frame: how many vertical and horizontal angles, the angles, values by horizontal angle.
fn light_ies(profile: u32, direction: vec3<f32>) -> f32 {
    let verticals = lights[profile];
    let horizontals = lights[profile + 1u];
    let degrees = 57.295776;
    let v = light_bracket(profile + 2u, verticals, real_acos(-direction.z) * degrees);
    if (v.below == LIGHT_NONE) {
        return 0.0;
    }
    let turn = light_full_turn(real_atan2(direction.y, direction.x) * degrees);
    let h = light_bracket_turn(profile + 2u + verticals, horizontals, turn);
    let values = profile + 2u + verticals + horizontals;
    let low = values + h.below * verticals;
    let high = values + h.above * verticals;
    let at_low = light_f32(low + v.below) * (1.0 - v.fraction) + light_f32(low + v.above) * v.fraction;
    let at_high = light_f32(high + v.below) * (1.0 - v.fraction) + light_f32(high + v.above) * v.fraction;
    return at_low * (1.0 - h.fraction) + at_high * h.fraction;
}
