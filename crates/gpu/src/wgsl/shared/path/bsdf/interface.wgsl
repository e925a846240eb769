// The base interface as in `vastlight-transport`, `bsdf::interface`: microfacets that reflect, and refract into a volume
// or let light straight through a thin wall.
//#include bsdf/ggx
//#include bsdf/reflectance

/// Smallest difference of the indices on both sides of a volume's surface that f32 can refract by.
const INTERFACE_SMALLEST_STEP: f32 = 2e-3;

struct Interface {
    alpha: vec2<f32>,
    reflectance: Reflectance,
    /// What light that passes the dielectric is multiplied with before it leaves on the other side.
    transmitted: vec3<f32>,
    /// Of the inside against the outside.
    ior: f32,
    thin: bool,
    dispersive: bool,
}

/// A direction; `weight` is the share of energy over the probability of the choice, for a mirror-like interface.
struct InterfaceDrawn {
    valid: bool,
    wi: vec3<f32>,
    weight: vec3<f32>,
}

fn interface_new(p: ptr<function, BsdfParams>) -> Interface {
    var base: Interface;
    let transmission = bsdf_unit((*p).transmission);
    var tint = vec3<f32>(0.0);
    if (transmission * (1.0 - bsdf_unit((*p).metallic)) > 0.0) {
        tint = bsdf_positive((*p).transmission_tint);
    }
    // An infinite index (0) cannot refract: only its reflection is infinite.
    base.ior = 1.5;
    if ((*p).ior > 0.0) {
        base.ior = clamp((*p).ior, 0.25, 4.0);
    }
    base.thin = (*p).thin;
    if (!base.thin && abs(base.ior - 1.0) < INTERFACE_SMALLEST_STEP) {
        base.ior = 1.0 + INTERFACE_SMALLEST_STEP;
    }
    base.alpha = ggx_new(bsdf_unit((*p).roughness), bsdf_unit((*p).anisotropy));
    base.reflectance = reflectance_new(p);
    base.transmitted = bsdf_color((*p).base_color) * tint * transmission;
    base.dispersive = (*p).dispersion > 0.0 && !base.thin;
    return base;
}

/// Whether light passes to the other side.
fn interface_transmits(base: Interface) -> bool {
    return !bsdf_is_black(base.transmitted);
}

/// Whether the surface bounds a volume: its two sides differ.
fn interface_refracts(base: Interface) -> bool {
    return !base.thin && interface_transmits(base);
}

/// Index of the far side over the near side's.
fn interface_eta(base: Interface, inside: bool) -> f32 {
    if (inside) {
        return 1.0 / base.ior;
    }
    return base.ior;
}

/// `(n_far / n_near)^2` for a direction on the far side of a volume's surface, else 1.
fn interface_radiance_scale(base: Interface, eta: f32, wi: vec3<f32>) -> f32 {
    return select(1.0, eta * eta, wi.z < 0.0 && !base.thin);
}

/// Share of light that a smooth interface lets pass into the dielectric.
fn interface_passed_to_base(base: Interface, cos_theta: f32, inside: bool) -> f32 {
    let dielectric = 1.0 - base.reflectance.metallic;
    if (dielectric > 0.0) {
        return reflectance_at(base.reflectance, cos_theta, interface_eta(base, inside)).passed / dielectric;
    }
    return 0.0;
}

/// Probability of reflection at a microfacet.
fn interface_choice(reflected: vec3<f32>, transmitted: vec3<f32>) -> f32 {
    let r = bsdf_mean3(reflected);
    return r / max(r + bsdf_mean3(transmitted), REAL_MIN_POSITIVE);
}

/// `f * cos` and (w) the density of `interface_sample`; `wo.z > 0`. Reflection, the way through a wall (the mirror image
/// of the reflection) and refraction in one.
fn interface_evaluate(base: Interface, wo: vec3<f32>, wi: vec3<f32>, eta: f32) -> vec4<f32> {
    let up = wi.z > 0.0;
    if (ggx_is_delta(base.alpha) || (!up && !interface_transmits(base))) {
        return vec4<f32>(0.0);
    }
    let bent = !up && !base.thin;
    let seen = select(vec3<f32>(wi.xy, abs(wi.z)), wi, bent);
    var h = bsdf_normalize_or_z(wo + seen * select(1.0, eta, bent));
    if (bent && h.z < 0.0) {
        h = -h;
    }
    let cos_o = dot(wo, h);
    let cos_i = dot(seen, h);
    if (bent && (cos_o <= 0.0 || cos_i >= 0.0)) {
        return vec4<f32>(0.0);
    }
    let split = reflectance_at(base.reflectance, cos_o, eta);
    let transmitted = base.transmitted * split.passed;
    let choice = interface_choice(split.reflected, transmitted);
    let value = ggx_d(base.alpha, h) * ggx_visibility(base.alpha, wo, seen) * abs(wi.z);
    let density = ggx_visible_density(base.alpha, wo, h);
    if (up) {
        return vec4<f32>(split.reflected * value, 0.25 * density * choice);
    }
    if (!bent) {
        return vec4<f32>(transmitted * value, 0.25 * density * (1.0 - choice));
    }
    let denominator = cos_o + eta * cos_i;
    let squared = denominator * denominator;
    if (!(squared > 0.0)) {
        return vec4<f32>(0.0);
    }
    let jacobian = -cos_i / squared;
    if (!real_is_finite(jacobian)) {
        return vec4<f32>(0.0);
    }
    return vec4<f32>(
        transmitted * (4.0 * value * cos_o * jacobian),
        density * cos_o * jacobian * eta * eta * (1.0 - choice),
    );
}

/// A reflected or transmitted direction; not valid where shadowing ends the path. `u_choice` in [0, 1).
fn interface_sample(base: Interface, wo: vec3<f32>, eta: f32, u_choice: f32, u: vec2<f32>) -> InterfaceDrawn {
    var h = vec3<f32>(0.0, 0.0, 1.0);
    if (!ggx_is_delta(base.alpha)) {
        h = ggx_sample(base.alpha, wo, u);
    }
    let cos_o = dot(wo, h);
    let split = reflectance_at(base.reflectance, cos_o, eta);
    let transmitted = base.transmitted * split.passed;
    let choice = interface_choice(split.reflected, transmitted);
    let mirror = h * (2.0 * cos_o) - wo;
    if (u_choice < choice) {
        return InterfaceDrawn(mirror.z > 0.0, bsdf_normalize_or_z(mirror), split.reflected / choice);
    }
    if (!(choice < 1.0)) {
        return InterfaceDrawn(false, vec3<f32>(0.0), vec3<f32>(0.0));
    }
    let weight = transmitted / (1.0 - choice);
    if (base.thin) {
        let through = vec3<f32>(mirror.xy, -mirror.z);
        return InterfaceDrawn(mirror.z > 0.0, bsdf_normalize_or_z(through), weight);
    }
    let wi = fresnel_refract(wo, h, eta);
    return InterfaceDrawn(wi.z < 0.0, wi, weight / interface_radiance_scale(base, eta, wi));
}
