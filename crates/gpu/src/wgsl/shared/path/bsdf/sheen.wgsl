// Sheen of cloth as in `vastlight-transport`, `bsdf::sheen` (Estevez and Kulla 2017), drawn uniformly over the
// hemisphere.
//#include real
//#include bsdf/numbers
//#include bsdf/albedo

/// Roughness below which the lobe would be too thin for its table, cosine below which the fit is not used.
const SHEEN_SMALLEST_ROUGHNESS: f32 = 0.1;
const SHEEN_SMALLEST_COS: f32 = 1e-3;
const SHEEN_NODES: u32 = 16u;

/// A sheen lobe; strength 0 for none.
struct Sheen {
    color: vec3<f32>,
    roughness: f32,
    strength: f32,
}

fn sheen_new(tint: vec3<f32>, roughness: f32) -> Sheen {
    let color = bsdf_color(tint);
    return Sheen(color, max(bsdf_unit(roughness), SHEEN_SMALLEST_ROUGHNESS), bsdf_max3(color));
}

/// Share of light that white sheen reflects before it is limited.
fn sheen_albedo(cos_theta: f32, roughness: f32) -> f32 {
    let x = (roughness - SHEEN_SMALLEST_ROUGHNESS) / (1.0 - SHEEN_SMALLEST_ROUGHNESS);
    let c = albedo_node(sqrt(clamp(cos_theta, 0.0, 1.0)), SHEEN_NODES);
    return albedo_of_plane(ALBEDO_SHEEN, albedo_node(x, SHEEN_NODES), c);
}

/// The paper's fit of Smith's Lambda.
fn sheen_lambda(cos_theta: f32, alpha: f32) -> f32 {
    let c = clamp(cos_theta, SHEEN_SMALLEST_COS, 1.0);
    let t = (1.0 - alpha) * (1.0 - alpha);
    if (c < 0.5) {
        return real_exp(sheen_fit(c, t));
    }
    return real_exp(2.0 * sheen_fit(0.5, t) - sheen_fit(1.0 - c, t));
}

fn sheen_between(rough: f32, fine: f32, t: f32) -> f32 {
    return rough + (fine - rough) * t;
}

fn sheen_fit(x: f32, t: f32) -> f32 {
    let a = sheen_between(21.5473, 25.3245, t);
    let b = sheen_between(3.82987, 3.32435, t);
    let c = sheen_between(0.19823, 0.16801, t);
    let d = sheen_between(-1.9776, -1.27393, t);
    let e = sheen_between(-4.32054, -4.85967, t);
    return a / (1.0 + b * real_pow(x, c)) + d * x + e;
}

/// `f * cos` for directions above the surface; the density is 1 / (2 pi).
fn sheen_evaluate(sheen: Sheen, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    let alpha = sheen.roughness * sheen.roughness;
    let h = bsdf_normalize_or_z(wo + wi);
    let limit = max(max(sheen_albedo(wo.z, sheen.roughness), sheen_albedo(wi.z, sheen.roughness)), 1.0);
    return sheen.color * (sheen_charlie(wo.z, wi.z, h, alpha) / limit);
}

/// `D * G / (4 cos_o)`: the reflection of white fibres times the cosine of `wi`.
fn sheen_charlie(cos_o: f32, cos_i: f32, h: vec3<f32>, alpha: f32) -> f32 {
    let exponent = 1.0 / alpha;
    let sin2 = min(h.x * h.x + h.y * h.y, 1.0);
    let d = (2.0 + exponent) * real_pow(sin2, 0.5 * exponent) * (1.0 / TAU);
    let masked = 1.0 + sheen_lambda(cos_o, alpha) + sheen_lambda(cos_i, alpha);
    return d / (masked * 4.0 * max(cos_o, SHEEN_SMALLEST_COS));
}
