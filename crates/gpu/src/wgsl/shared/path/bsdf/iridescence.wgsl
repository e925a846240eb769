// Interference in a thin film as in `vastlight-transport`, `bsdf::iridescence` (Belcour and Barla 2017).
//#include real
//#include bsdf/numbers
//#include bsdf/fresnel

/// A film on the base; weight 0 for none.
struct Film {
    weight: f32,
    ior: f32,
    /// Metres.
    thickness: f32,
}

/// Thickness in nanometres.
fn film_new(weight: f32, ior: f32, nanometres: f32) -> Film {
    if (nanometres > 0.0 && real_is_finite(nanometres) && real_is_finite(ior)) {
        return Film(bsdf_unit(weight), clamp(ior, 1.0, 4.0), nanometres * 1e-9);
    }
    return Film(0.0, 1.0, 0.0);
}

fn film_schlick(f0: vec3<f32>, cos_theta: f32) -> vec3<f32> {
    return f0 + (vec3<f32>(1.0) - f0) * fresnel_schlick_weight(cos_theta);
}

/// Reflectance of film and base together at the cosine outside; `f0` is the base's own reflectance in air.
fn film_reflectance(film: Film, cos_theta: f32, f0: vec3<f32>) -> vec3<f32> {
    let c = clamp(cos_theta, 0.0, 1.0);
    let sin2_film = (1.0 - c * c) / (film.ior * film.ior);
    let cos_film = sqrt(max(1.0 - sin2_film, 0.0));
    let first = film_schlick(vec3<f32>(fresnel_dielectric_f0(film.ior)), c);
    let root = min(sqrt(f0), vec3<f32>(0.9999));
    let base = (vec3<f32>(1.0) + root) / (vec3<f32>(1.0) - root);
    let contrast = (base - vec3<f32>(film.ior)) / (base + vec3<f32>(film.ior));
    let second = film_schlick(contrast * contrast, cos_film);
    let phase = select(vec3<f32>(PI), vec3<f32>(TAU), base < vec3<f32>(film.ior));
    return film_interference(first, second, 2.0 * film.ior * film.thickness * cos_film, phase);
}

/// The series over reflection orders, cut after the second.
fn film_interference(first: vec3<f32>, second: vec3<f32>, path: f32, phase: vec3<f32>) -> vec3<f32> {
    let through = vec3<f32>(1.0) - first;
    let both = clamp(first * second, vec3<f32>(1e-5), vec3<f32>(0.9999));
    let root = sqrt(both);
    let round_trips = through * through * second / (vec3<f32>(1.0) - both);
    var sum = first + round_trips;
    var order = round_trips - through;
    for (var m = 1u; m <= 2u; m++) {
        order *= root;
        sum += order * film_sensitivity(f32(m) * path, phase * f32(m)) * 2.0;
    }
    return clamp(sum, vec3<f32>(0.0), vec3<f32>(1.0));
}

/// A Gaussian of the eye's sensitivities, transformed: `height` is `value * sqrt(tau * variance) / 1.0685e-7`.
fn film_lobe(k: f32, height: f32, centre: f32, variance: f32, shift: f32) -> f32 {
    return height * real_cos(centre * k + shift) * real_exp(-variance * k * k);
}

/// Fourier transform of the eye's sensitivities at an optical path difference (metres), in linear Rec. 709.
fn film_sensitivity(path: f32, shift: vec3<f32>) -> vec3<f32> {
    let k = TAU * path;
    let x = film_lobe(k, 5.4856e-13 * sqrt(TAU * 4.3278e9) / 1.0685e-7, 1.6810e6, 4.3278e9, shift.x)
        + film_lobe(k, 9.7470e-14 * sqrt(TAU * 4.5282e9) / 1.0685e-7, 2.2399e6, 4.5282e9, shift.x);
    let y = film_lobe(k, 4.4201e-13 * sqrt(TAU * 9.3046e9) / 1.0685e-7, 1.7953e6, 9.3046e9, shift.y);
    let z = film_lobe(k, 5.2481e-13 * sqrt(TAU * 6.6121e9) / 1.0685e-7, 2.2084e6, 6.6121e9, shift.z);
    return vec3<f32>(
        3.2404542 * x - 1.5371385 * y - 0.4985314 * z,
        -0.969266 * x + 1.8760108 * y + 0.041556 * z,
        0.0556434 * x - 0.2040259 * y + 1.0572252 * z,
    );
}
