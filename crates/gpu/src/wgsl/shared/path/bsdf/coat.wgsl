// The clear coat as in `vastlight-transport`, `bsdf::coat`: a thin layer of varnish with an index of 1.5.
//#include frame
//#include bsdf/albedo
//#include bsdf/fresnel
//#include bsdf/ggx

const COAT_IOR: f32 = 1.5;

/// A clear coat over everything else; weight 0 for none.
struct Coat {
    weight: f32,
    roughness: f32,
    alpha: vec2<f32>,
    normal: vec3<f32>,
}

fn coat_new(weight: f32, roughness: f32, normal: vec3<f32>) -> Coat {
    var n = bsdf_normalize_or_z(normal);
    if (!(n.z > 0.0)) {
        n = vec3<f32>(0.0, 0.0, 1.0);
    }
    let rough = bsdf_unit(roughness);
    return Coat(bsdf_unit(weight), rough, ggx_new(rough, 0.0), n);
}

/// Share of the light of this direction that the coat reflects.
fn coat_reflected(coat: Coat, w: vec3<f32>) -> f32 {
    if (!(coat.weight > 0.0)) {
        return 0.0;
    }
    let c = abs(dot(w, coat.normal));
    if (ggx_is_delta(coat.alpha)) {
        return coat.weight * fresnel_dielectric(c, COAT_IOR);
    }
    let f0 = fresnel_dielectric_f0(COAT_IOR);
    let full = albedo_full(c, coat.roughness);
    let rise = albedo_bounce(false, albedo_contrast(COAT_IOR), c, coat.roughness).x;
    return coat.weight * (f0 * (full - rise) + rise);
}

fn coat_is_straight(coat: Coat) -> bool {
    return coat.normal.x == 0.0 && coat.normal.y == 0.0 && coat.normal.z == 1.0;
}

fn coat_local(coat: Coat, w: vec3<f32>) -> vec3<f32> {
    if (coat_is_straight(coat)) {
        return w;
    }
    return frame_to_local(frame_from_z(coat.normal), w);
}

/// `f * cos` and the density of `coat_sample`, for directions above the surface.
fn coat_evaluate(coat: Coat, above_wo: vec3<f32>, above_wi: vec3<f32>) -> vec2<f32> {
    let wo = coat_local(coat, above_wo);
    let wi = coat_local(coat, above_wi);
    if (ggx_is_delta(coat.alpha) || wo.z <= 0.0 || wi.z <= 0.0) {
        return vec2<f32>(0.0);
    }
    let h = bsdf_normalize_or_z(wo + wi);
    let f = coat.weight * fresnel_dielectric(dot(wo, h), COAT_IOR);
    return vec2<f32>(
        f * ggx_d(coat.alpha, h) * ggx_visibility(coat.alpha, wo, wi) * wi.z,
        0.25 * ggx_visible_density(coat.alpha, wo, h),
    );
}

/// A reflected direction; for a smooth coat the mirror direction. May point below the surface; zero where there is none.
fn coat_sample(coat: Coat, wo: vec3<f32>, u: vec2<f32>) -> vec3<f32> {
    let local = coat_local(coat, wo);
    if (local.z <= 0.0) {
        return vec3<f32>(0.0);
    }
    var h = vec3<f32>(0.0, 0.0, 1.0);
    if (!ggx_is_delta(coat.alpha)) {
        h = ggx_sample(coat.alpha, local, u);
    }
    let wi = h * (2.0 * dot(local, h)) - local;
    if (coat_is_straight(coat)) {
        return wi;
    }
    return frame_to_outer(frame_from_z(coat.normal), wi);
}
