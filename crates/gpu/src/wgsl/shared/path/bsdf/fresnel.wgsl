// Reflectance of smooth interfaces as in `vastlight-transport`, `bsdf::fresnel`.
//#include real

/// Reflectance of a dielectric; `eta` the index of the far side over this side's. 1 at total internal reflection.
fn fresnel_dielectric(cos_theta: f32, eta: f32) -> f32 {
    let c = clamp(cos_theta, 0.0, 1.0);
    let sin2_t = (1.0 - c * c) / (eta * eta);
    if (sin2_t >= 1.0) {
        return 1.0;
    }
    let cos_t = sqrt(1.0 - sin2_t);
    let s = (c - eta * cos_t) / (c + eta * cos_t);
    let p = (eta * c - cos_t) / (eta * c + cos_t);
    return min(0.5 * (s * s + p * p), 1.0);
}

/// At normal incidence.
fn fresnel_dielectric_f0(eta: f32) -> f32 {
    let r = (eta - 1.0) / (eta + 1.0);
    return r * r;
}

/// Reflectance of a metal per channel.
fn fresnel_conductor(cos_theta: f32, eta: vec3<f32>, k: vec3<f32>) -> vec3<f32> {
    let c = clamp(cos_theta, 0.0, 1.0);
    let cos2 = vec3<f32>(c * c);
    let sin2 = vec3<f32>(1.0) - cos2;
    let eta2 = eta * eta;
    let k2 = k * k;
    let t0 = eta2 - k2 - sin2;
    let a2_plus_b2 = sqrt(t0 * t0 + 4.0 * eta2 * k2);
    let a = sqrt(max(0.5 * (a2_plus_b2 + t0), vec3<f32>(0.0)));
    let t1 = a2_plus_b2 + cos2;
    let t2 = 2.0 * c * a;
    let least = vec3<f32>(REAL_MIN_POSITIVE);
    let s = (t1 - t2) / max(t1 + t2, least);
    let t3 = cos2 * a2_plus_b2 + sin2 * sin2;
    let t4 = t2 * sin2;
    let p = s * (t3 - t4) / max(t3 + t4, least);
    return clamp(0.5 * (s + p), vec3<f32>(0.0), vec3<f32>(1.0));
}

/// Schlick's weight `(1 - cos)^5`.
fn fresnel_schlick_weight(cos_theta: f32) -> f32 {
    let m = clamp(1.0 - cos_theta, 0.0, 1.0);
    let m2 = m * m;
    return m2 * m2 * m;
}

/// The direction `wo` refracted through the microfacet `h` (`wo . h > 0`); zero at total internal reflection.
fn fresnel_refract(wo: vec3<f32>, h: vec3<f32>, eta: f32) -> vec3<f32> {
    let c = dot(wo, h);
    let sin2_t = max(1.0 - c * c, 0.0) / (eta * eta);
    if (sin2_t >= 1.0) {
        return vec3<f32>(0.0);
    }
    let w = h * (c / eta - sqrt(1.0 - sin2_t)) - wo / eta;
    let length_squared = dot(w, w);
    if (length_squared > 0.0 && real_is_finite(length_squared)) {
        return w * (1.0 / sqrt(length_squared));
    }
    return vec3<f32>(0.0);
}
