// What the base interface reflects at an angle, as in `vastlight-transport`, `bsdf::reflectance`.
//#include bsdf_params
//#include bsdf/numbers
//#include bsdf/fresnel
//#include bsdf/iridescence

struct Reflectance {
    metallic: f32,
    metal_f0: vec3<f32>,
    /// A measured metal: its complex index and its mean reflectance.
    measured: bool,
    eta: vec3<f32>,
    k: vec3<f32>,
    average: vec3<f32>,
    f0: vec3<f32>,
    f90: f32,
    /// An infinite index: Schlick's curve takes the place of Fresnel's.
    infinite: bool,
    film: Film,
}

/// What happens to light that meets a microfacet: reflected, and passed into the dielectric.
struct Split {
    reflected: vec3<f32>,
    passed: f32,
}

fn reflectance_new(p: ptr<function, BsdfParams>) -> Reflectance {
    var r: Reflectance;
    r.infinite = !((*p).ior > 0.0);
    var normal = 1.0;
    if (!r.infinite) {
        normal = fresnel_dielectric_f0(min((*p).ior, 4.0));
    }
    r.metallic = bsdf_unit((*p).metallic);
    r.metal_f0 = bsdf_color((*p).base_color);
    r.measured = (*p).conductor && r.metallic > 0.0;
    r.eta = (*p).conductor_eta;
    r.k = (*p).conductor_k;
    r.average = (*p).conductor_average;
    if ((*p).conductor) {
        r.metal_f0 = fresnel_conductor(1.0, r.eta, r.k);
    }
    r.f0 = bsdf_color((*p).specular_color * normal) * bsdf_unit((*p).specular);
    r.f90 = bsdf_unit((*p).specular);
    r.film = film_new((*p).iridescence, (*p).iridescence_ior, (*p).iridescence_thickness);
    return r;
}

/// At the cosine to a microfacet; `eta` is the index of the far side over the near side's.
fn reflectance_at(r: Reflectance, cos_theta: f32, eta: f32) -> Split {
    var split = Split(vec3<f32>(0.0), 0.0);
    if (r.metallic > 0.0) {
        split.reflected = reflectance_metal(r, cos_theta) * r.metallic;
    }
    if (r.metallic < 1.0) {
        let f = reflectance_dielectric(r, cos_theta, eta);
        split.reflected += f * (1.0 - r.metallic);
        split.passed = (1.0 - r.metallic) * max(1.0 - bsdf_max3(f), 0.0);
    }
    return split;
}

fn reflectance_metal(r: Reflectance, cos_theta: f32) -> vec3<f32> {
    var bare = r.metal_f0 + (vec3<f32>(1.0) - r.metal_f0) * fresnel_schlick_weight(cos_theta);
    if (r.measured) {
        bare = fresnel_conductor(cos_theta, r.eta, r.k);
    }
    return reflectance_with_film(r, bare, r.metal_f0, cos_theta);
}

fn reflectance_dielectric(r: Reflectance, cos_theta: f32, eta: f32) -> vec3<f32> {
    let whole = fresnel_dielectric(cos_theta, eta);
    if (whole >= 1.0 && eta < 1.0) {
        return vec3<f32>(1.0);
    }
    var rise = fresnel_schlick_weight(cos_theta);
    if (!r.infinite) {
        let f0 = fresnel_dielectric_f0(eta);
        rise = clamp((whole - f0) / (1.0 - f0), 0.0, 1.0);
    }
    let bare = r.f0 + (vec3<f32>(r.f90) - r.f0) * rise;
    // The film knows the angle outside.
    var outside = cos_theta;
    if (eta < 1.0) {
        outside = sqrt(max(1.0 - (1.0 - cos_theta * cos_theta) / (eta * eta), 0.0));
    }
    return reflectance_with_film(r, bare, r.f0, outside);
}

fn reflectance_with_film(r: Reflectance, bare: vec3<f32>, f0: vec3<f32>, cos_theta: f32) -> vec3<f32> {
    if (r.film.weight > 0.0) {
        return bare + (film_reflectance(r.film, cos_theta, f0) - bare) * r.film.weight;
    }
    return bare;
}

/// The dielectric as the two ends of a rising curve that is nowhere below its reflectance: at normal incidence, and at
/// grazing (w).
fn reflectance_dielectric_ends(r: Reflectance, eta: f32) -> vec4<f32> {
    if (r.film.weight <= 0.0) {
        return vec4<f32>(r.f0, r.f90);
    }
    let f90 = r.f90 + (1.0 - r.f90) * r.film.weight;
    var bound = vec3<f32>(0.0);
    for (var i = 0u; i < 6u; i++) {
        let c = 1.0 - 0.15 * f32(i);
        let rise = fresnel_schlick_weight(c);
        let seen = reflectance_dielectric(r, c, max(eta, 1.0));
        bound = max(bound, (seen - vec3<f32>(f90 * rise)) / (1.0 - rise));
    }
    return vec4<f32>(clamp(bound, vec3<f32>(0.0), vec3<f32>(1.0)), f90);
}

/// The index whose Fresnel curve rises like this reflectance.
fn reflectance_table_ior(r: Reflectance, ior: f32) -> f32 {
    if (r.infinite) {
        return 1.5;
    }
    if (r.film.weight > 0.0) {
        return max(max(ior, 1.0 / ior), 1.5);
    }
    return ior;
}

/// 1 where the dielectric reflects what its index says, 0 where something else decides.
fn reflectance_plainness(r: Reflectance) -> f32 {
    return select(1.0 - r.film.weight, 0.0, r.infinite);
}

/// Mean reflectance of the metal over the hemisphere.
fn reflectance_metal_average(r: Reflectance) -> vec3<f32> {
    if (r.film.weight > 0.0) {
        return reflectance_metal(r, 0.65);
    }
    if (r.measured) {
        return r.average;
    }
    return r.metal_f0 + (vec3<f32>(1.0) - r.metal_f0) / 21.0;
}
