// The numbers of a material at one point, and what a wavelength does to them, as in `vastlight-transport`, `bsdf`.
//#include real

struct BsdfParams {
    /// Diffuse and transmission albedo of the dielectric, normal reflectance of the metal.
    base_color: vec3<f32>,
    /// 0 dielectric, 1 metal.
    metallic: f32,
    /// Perceptual.
    roughness: f32,
    /// Index of the inside against the outside; 0 means infinite.
    ior: f32,
    /// Strength of the dielectric reflection, and its colour at normal incidence.
    specular: f32,
    specular_color: vec3<f32>,
    /// Fraction of the dielectric that transmits, and what multiplies transmitted light.
    transmission: f32,
    transmission_tint: vec3<f32>,
    /// An infinitely thin wall.
    thin: bool,
    /// 20 / Abbe number; 0 for none.
    dispersion: f32,
    clearcoat: f32,
    clearcoat_roughness: f32,
    /// In the local frame.
    clearcoat_normal: vec3<f32>,
    sheen_color: vec3<f32>,
    sheen_roughness: f32,
    /// Stretch of the highlight, and its direction in the local frame's x and y.
    anisotropy: f32,
    anisotropy_direction: vec2<f32>,
    iridescence: f32,
    iridescence_ior: f32,
    /// Nanometres.
    iridescence_thickness: f32,
    /// A measured metal replaces the base colour in the metal's reflectance: its complex index, and its mean reflectance
    /// over the hemisphere (`bsdf::Metal::index`, `bsdf::Metal::average`).
    conductor: bool,
    conductor_eta: vec3<f32>,
    conductor_k: vec3<f32>,
    conductor_average: vec3<f32>,
}

/// A diffuse reflector.
fn bsdf_params_diffuse(albedo: vec3<f32>) -> BsdfParams {
    var params: BsdfParams;
    params.base_color = albedo;
    params.roughness = 1.0;
    params.ior = 1.5;
    params.specular_color = vec3<f32>(1.0);
    params.transmission_tint = vec3<f32>(1.0);
    params.thin = true;
    params.clearcoat_normal = vec3<f32>(0.0, 0.0, 1.0);
    params.anisotropy_direction = vec2<f32>(1.0, 0.0);
    params.iridescence_ior = 1.3;
    params.iridescence_thickness = 400.0;
    return params;
}

/// Shortest and longest wavelength drawn, nanometres.
const WAVELENGTH_SHORTEST: f32 = 420.0;
const WAVELENGTH_LONGEST: f32 = 680.0;
/// Where blue, green and red are pure.
const WAVELENGTH_BLUE: f32 = 450.0;
const WAVELENGTH_GREEN: f32 = 540.0;
const WAVELENGTH_RED: f32 = 620.0;

/// Sets the index of refraction for the wavelength of `u` in [0, 1) where the material disperses, and the colour of
/// transmitted light: the wavelength's RGB weight the first time, white once the path has `already_dispersed`.
fn wavelength_apply(u: f32, already_dispersed: bool, params: ptr<function, BsdfParams>) {
    if ((*params).dispersion > 0.0 && !(*params).thin && (*params).ior > 0.0) {
        let nanometres = WAVELENGTH_SHORTEST + (WAVELENGTH_LONGEST - WAVELENGTH_SHORTEST) * u;
        (*params).ior = wavelength_cauchy((*params).ior, (*params).dispersion, nanometres);
        (*params).transmission_tint = vec3<f32>(1.0);
        if (!already_dispersed) {
            (*params).transmission_tint = wavelength_rgb_weight(nanometres);
        }
    }
}

/// Index at a wavelength from that at 587.6 nm and 20 / Abbe number: Cauchy's equation with two terms.
fn wavelength_cauchy(ior: f32, dispersion: f32, nanometres: f32) -> f32 {
    let slope = (ior - 1.0) * dispersion / 20.0;
    let bent = ior + slope * (523655.0 / (nanometres * nanometres) - 1.5168);
    return select(1.0, bent, bent > 1.0);
}

/// Colour of light of one wavelength; the mean over all drawn wavelengths is white.
fn wavelength_rgb_weight(nanometres: f32) -> vec3<f32> {
    let width = WAVELENGTH_LONGEST - WAVELENGTH_SHORTEST;
    let blue_mean = (0.5 * (WAVELENGTH_BLUE + WAVELENGTH_GREEN) - WAVELENGTH_SHORTEST) / width;
    let green_mean = 0.5 * (WAVELENGTH_RED - WAVELENGTH_BLUE) / width;
    let red_mean = (WAVELENGTH_LONGEST - 0.5 * (WAVELENGTH_GREEN + WAVELENGTH_RED)) / width;
    let to_green = wavelength_step(nanometres, WAVELENGTH_BLUE, WAVELENGTH_GREEN);
    let to_red = wavelength_step(nanometres, WAVELENGTH_GREEN, WAVELENGTH_RED);
    return vec3<f32>(to_red / red_mean, (to_green - to_red) / green_mean, (1.0 - to_green) / blue_mean);
}

fn wavelength_step(nanometres: f32, a: f32, b: f32) -> f32 {
    return 0.5 - 0.5 * real_cos(PI * clamp((nanometres - a) / (b - a), 0.0, 1.0));
}
