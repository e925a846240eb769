// How a surface scatters light, as in `vastlight-transport`, `bsdf`: everything in the local shading frame, `wo` and
// `wi` unit vectors that point away from the surface. Who includes this has `tables`.
//#include bsdf/lambert
//#include bsdf/layered

/// The scattering of one surface point.
struct Bsdf {
    /// Nothing but Lambert's reflection of this albedo is left.
    lambert: bool,
    diffuse: vec3<f32>,
    layered: Layered,
}

/// There is a sample; it comes from a mirror-like lobe, its direction is on the other side of the surface, its direction
/// depends on the wavelength.
const BSDF_VALID: u32 = 1u;
const BSDF_DELTA: u32 = 2u;
const BSDF_TRANSMITTED: u32 = 4u;
const BSDF_DISPERSED: u32 = 8u;

/// A direction drawn by `bsdf_sample`; without BSDF_VALID the sample ends the path.
struct BsdfSample {
    wi: vec3<f32>,
    /// `f * |cos| / pdf`, for radiance.
    weight: vec3<f32>,
    /// Density over solid angle, of all lobes together; 0 for a mirror-like direction.
    pdf: f32,
    /// `(n_i / n_o)^2`: times `weight` the share of energy.
    radiance_scale: f32,
    flags: u32,
}

/// Prepares the scattering of a point. Numbers out of range are brought into it.
fn bsdf_new(params: BsdfParams) -> Bsdf {
    var p = params;
    var bsdf: Bsdf;
    bsdf.lambert = p.specular <= 0.0
        && p.metallic <= 0.0
        && p.transmission <= 0.0
        && p.clearcoat <= 0.0
        && bsdf_is_black(bsdf_color(p.sheen_color))
        && p.iridescence <= 0.0;
    if (bsdf.lambert) {
        bsdf.diffuse = bsdf_color(p.base_color);
    } else {
        bsdf.layered = layered_new(&p);
    }
    return bsdf;
}

/// `f(wo, wi) * |cos(wi)|` and (w) the density with which `bsdf_sample` draws `wi`, without mirror-like lobes.
fn bsdf_eval_pdf(bsdf: Bsdf, wo: vec3<f32>, wi: vec3<f32>) -> vec4<f32> {
    if (bsdf.lambert) {
        return lambert_evaluate(bsdf.diffuse, wo, wi);
    }
    return layered_eval_pdf(bsdf.layered, wo, wi);
}

/// Draws a direction; `lobe` and `u` uniform in [0, 1).
fn bsdf_sample(bsdf: Bsdf, wo: vec3<f32>, lobe: f32, u: vec2<f32>) -> BsdfSample {
    if (bsdf.lambert) {
        let drawn = lambert_sample(wo, warp_cosine_hemisphere(u));
        return BsdfSample(drawn.xyz, bsdf.diffuse, drawn.w, 1.0, select(0u, BSDF_VALID, drawn.w > 0.0));
    }
    let base = bsdf.layered.base;
    let out = layered_out(bsdf.layered, wo);
    let drawn = layered_sample(bsdf.layered, out, lobe, u);
    let down = drawn.wi.z < 0.0;
    let flags = select(0u, BSDF_VALID, drawn.valid)
        | select(0u, BSDF_DELTA, drawn.is_delta)
        | select(0u, BSDF_TRANSMITTED, down)
        | select(0u, BSDF_DISPERSED, down && base.dispersive);
    return BsdfSample(
        layered_outer(bsdf.layered, drawn.wi, out.mirrored),
        drawn.weight,
        drawn.pdf,
        interface_radiance_scale(base, out.eta, drawn.wi),
        flags,
    );
}

/// Whether the surface is a smooth thin wall that light goes straight through: a window pane.
fn bsdf_is_pane(bsdf: Bsdf) -> bool {
    return !bsdf.lambert && layered_is_pane(bsdf.layered);
}

/// Share of light that goes straight through a pane; zero for any other surface.
fn bsdf_straight(bsdf: Bsdf, wo: vec3<f32>) -> vec3<f32> {
    if (bsdf.lambert) {
        return vec3<f32>(0.0);
    }
    return layered_straight(bsdf.layered, wo);
}

/// Colour for the albedo AOV.
fn bsdf_albedo(bsdf: Bsdf) -> vec3<f32> {
    return select(bsdf.layered.albedo, bsdf.diffuse, bsdf.lambert);
}

/// Whether a lobe of finite width is there, so that sampling the lights is worth it.
fn bsdf_has_nondelta(bsdf: Bsdf) -> bool {
    if (bsdf.lambert) {
        return bsdf_max3(bsdf.diffuse) > 0.0;
    }
    let s = bsdf.layered;
    return !ggx_is_delta(s.base.alpha)
        || s.cosine.any
        || s.sheen.strength > 0.0
        || (s.coat.weight > 0.0 && !ggx_is_delta(s.coat.alpha));
}

/// Whether a lobe of finite width leads through the surface, so that lights behind it are worth sampling.
fn bsdf_transmits(bsdf: Bsdf) -> bool {
    return !bsdf.lambert && interface_transmits(bsdf.layered.base) && !ggx_is_delta(bsdf.layered.base.alpha);
}
