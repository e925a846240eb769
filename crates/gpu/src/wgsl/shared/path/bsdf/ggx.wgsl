// The anisotropic GGX distribution as in `vastlight-transport`, `bsdf::ggx`: widths `alpha` along x and y, directions
// with `z >= 0` on the side that it is seen from.
//#include real
//#include bsdf/numbers

/// Below this width the lobe is a mirror.
const GGX_SMALLEST_ALPHA: f32 = 1e-3;

/// From perceptual roughness and anisotropy, both in [0, 1].
fn ggx_new(roughness: f32, anisotropy: f32) -> vec2<f32> {
    let along_y = roughness * roughness;
    let along_x = along_y + (1.0 - along_y) * anisotropy * anisotropy;
    return max(vec2<f32>(along_x, along_y), vec2<f32>(GGX_SMALLEST_ALPHA));
}

fn ggx_is_delta(alpha: vec2<f32>) -> bool {
    return max(alpha.x, alpha.y) <= GGX_SMALLEST_ALPHA;
}

/// Density of microfacet normals `h`, per steradian of h and per unit of macroscopic area.
fn ggx_d(alpha: vec2<f32>, h: vec3<f32>) -> f32 {
    let s = h.xy / alpha;
    let t = s.x * s.x + s.y * s.y + h.z * h.z;
    return 1.0 / (PI * alpha.x * alpha.y * t * t);
}

/// With it, Smith's Lambda is `(stretch / z - 1) / 2`.
fn ggx_stretch(alpha: vec2<f32>, w: vec3<f32>) -> f32 {
    let s = w.xy * alpha;
    return sqrt(w.z * w.z + s.x * s.x + s.y * s.y);
}

/// Masking and shadowing over the cosines: `G2(wo, wi) / (4 |cos wo| |cos wi|)`.
fn ggx_visibility(alpha: vec2<f32>, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    let sum = abs(wi.z) * ggx_stretch(alpha, wo) + abs(wo.z) * ggx_stretch(alpha, wi);
    return 0.5 / max(sum, REAL_MIN_POSITIVE);
}

/// Perceptual roughness of the isotropic surface that loses about as much light, averaged over directions.
fn ggx_mean_roughness(alpha: vec2<f32>) -> f32 {
    return sqrt(sqrt(0.5 * dot(alpha, alpha)));
}

/// The same as seen from one direction.
fn ggx_roughness_from(alpha: vec2<f32>, w: vec3<f32>) -> f32 {
    let across = w.x * w.x + w.y * w.y;
    if (alpha.x == alpha.y || across < 1e-12) {
        return ggx_mean_roughness(alpha);
    }
    let squared = alpha * alpha;
    let mean = 0.5 * (squared.x + squared.y);
    let half_difference = 0.5 * (squared.x - squared.y);
    let turn = (w.x * w.x - w.y * w.y) / across;
    let strength = clamp(0.45 * sqrt(mean) / max(abs(w.z), 1e-3) - 0.3, -0.3, 1.0);
    let smallest = min(squared.x, squared.y);
    return sqrt(sqrt(max(mean - strength * turn * half_difference, smallest)));
}

/// Density of `ggx_sample` at `h`, per steradian of h, divided by `|wo . h|`.
fn ggx_visible_density(alpha: vec2<f32>, wo: vec3<f32>, h: vec3<f32>) -> f32 {
    return 2.0 * ggx_d(alpha, h) / max(abs(wo.z) + ggx_stretch(alpha, wo), REAL_MIN_POSITIVE);
}

/// A microfacet normal as seen from `wo` (Dupuy and Benyoub 2023).
fn ggx_sample(alpha: vec2<f32>, wo: vec3<f32>, u: vec2<f32>) -> vec3<f32> {
    let scale = vec3<f32>(alpha, 1.0);
    let stretched = bsdf_normalize_or_z(wo * scale);
    let z = (1.0 - u.y) * (1.0 + stretched.z) - stretched.z;
    let r = sqrt(max(1.0 - z * z, 0.0));
    let sc = real_sin_cos(TAU * u.x);
    let h = vec3<f32>(r * sc.y, r * sc.x, z) + stretched;
    return bsdf_normalize_or_z(h * scale);
}
