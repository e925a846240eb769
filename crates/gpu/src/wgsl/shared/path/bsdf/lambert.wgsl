// Ideal diffuse reflection as in `vastlight-transport`, `bsdf::lambert`, the same on both sides of the surface.
//#include warp

/// `f * cos` and (w) its density; zero for directions on different sides.
fn lambert_evaluate(albedo: vec3<f32>, wo: vec3<f32>, wi: vec3<f32>) -> vec4<f32> {
    if (wo.z * wi.z <= 0.0) {
        return vec4<f32>(0.0);
    }
    let pdf = warp_cosine_hemisphere_pdf(abs(wi.z));
    return vec4<f32>(albedo * pdf, pdf);
}

/// The direction `cosine` on the side of `wo`, and (w) its density; 0 on the horizon.
fn lambert_sample(wo: vec3<f32>, cosine: vec3<f32>) -> vec4<f32> {
    let pdf = warp_cosine_hemisphere_pdf(cosine.z);
    return vec4<f32>(cosine.xy, real_copysign(cosine.z, wo.z), select(0.0, pdf, wo.z != 0.0));
}
