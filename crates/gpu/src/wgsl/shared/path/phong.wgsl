// Phong's and Whitted's models from a metallic-roughness material, as in `vastlight-transport`, `stream::phong`.
//#include bsdf/fresnel
//#include vertex

/// Surfaces with this roughness mirror nothing.
const PHONG_NO_MIRROR: f32 = 0.4;

/// A surface's colours in Phong's and Whitted's models.
struct Phong {
    diffuse: vec3<f32>,
    /// Reflectance at normal incidence.
    specular: vec3<f32>,
    exponent: f32,
    /// Share of the reflectance that is mirrored.
    smoothness: f32,
    transmitted: vec3<f32>,
    /// Index of refraction of the inside; 1 for a thin wall.
    ior: f32,
}

/// Weights of the mirrored and the refracted ray, and where the latter goes.
struct Parting {
    mirrored: vec3<f32>,
    refracted: vec3<f32>,
    direction: vec3<f32>,
    /// Whether there is a refracted ray.
    refracts: bool,
}

fn phong_new(evaluated: Evaluated) -> Phong {
    let none = vec3<f32>(0.0);
    if ((evaluated.flags & FLAG_UNLIT) != 0u) {
        return Phong(none, none, 1.0, 0.0, none, 1.0);
    }
    let p = evaluated.params;
    let dielectric = min(p.specular_color * (fresnel_dielectric_f0(p.ior) * p.specular), vec3<f32>(1.0));
    var metal = p.base_color;
    if (p.conductor) {
        metal = fresnel_conductor(1.0, p.conductor_eta, p.conductor_k);
    }
    let alpha = clamp(p.roughness * p.roughness, 0.02, 1.0);
    let smoothness = max(1.0 - p.roughness / PHONG_NO_MIRROR, 0.0);
    return Phong(
        p.base_color * ((1.0 - p.metallic) * (1.0 - p.transmission)),
        dielectric + (metal - dielectric) * p.metallic,
        // The width of a microfacet highlight, seen from its middle.
        max(0.5 / (alpha * alpha) - 0.5, 1.0),
        smoothness * smoothness,
        p.base_color * ((1.0 - p.metallic) * p.transmission),
        select(p.ior, 1.0, p.thin || p.ior <= 0.0),
    );
}

/// Radiance towards the viewer for radiance 1 from a light, per solid angle and before the light's cosine; `highlight` is the
/// cosine between the mirrored view and the light, `is_point` tells of a light without surface.
fn phong_local(phong: Phong, highlight: f32, is_point: bool) -> vec3<f32> {
    let share = select(1.0 - phong.smoothness, 1.0, is_point);
    let lobe = (phong.exponent + 2.0) * (0.5 / PI) * real_pow(clamp(highlight, 0.0, 1.0), phong.exponent);
    return phong.diffuse * (1.0 / PI) + phong.specular * (lobe * share);
}

fn phong_schlick(phong: Phong, cos_theta: f32) -> vec3<f32> {
    // Reflectances of nothing stay nothing.
    if (all(phong.specular == vec3<f32>(0.0))) {
        return phong.specular;
    }
    return phong.specular + (vec3<f32>(1.0) - phong.specular) * fresnel_schlick_weight(cos_theta);
}

/// What of the light is mirrored and refracted at a surface with normal `normal`, on the side of the viewer in the direction
/// `wo`. `outside` tells whether that side is the outside.
fn phong_part(phong: Phong, wo: vec3<f32>, normal: vec3<f32>, outside: bool) -> Parting {
    let eta = select(phong.ior, 1.0 / phong.ior, outside);
    let cos_theta = clamp(dot(wo, normal), 0.0, 1.0);
    let squared = 1.0 - eta * eta * (1.0 - cos_theta * cos_theta);
    let clear = any(phong.transmitted > vec3<f32>(0.0));
    if (squared <= 0.0) {
        let mirrored = select(phong_schlick(phong, cos_theta), vec3<f32>(1.0), clear);
        return Parting(mirrored * phong.smoothness, vec3<f32>(0.0), wo, false);
    }
    let behind = sqrt(squared);
    // Schlick's approximation wants the angle on the thinner side.
    let reflected = phong_schlick(phong, select(cos_theta, behind, eta > 1.0));
    let direction = normalize_or(normal * (eta * cos_theta - behind) - wo * eta, -wo);
    let refracted = (vec3<f32>(1.0) - reflected) * phong.transmitted;
    return Parting(reflected * phong.smoothness, refracted, direction, clear);
}
