//! Proofs of the whole material: samples follow their density, weights are value over density, energy, reciprocity,
//! and no input gives anything that is not a number.

use super::{Bsdf, BsdfParams, BsdfSample, Metal, Wavelength};
use proptest::prelude::*;
use vastlight_math::stats::{SphereGrid, sphere_chi_square_with};
use vastlight_math::{Rng, Vec2, Vec3, warp};
use vastlight_scene::Conductor;

fn base() -> BsdfParams {
    BsdfParams { specular: 1.0, ..BsdfParams::diffuse(Vec3::ONE) }
}

fn metal(roughness: f32) -> BsdfParams {
    BsdfParams { metallic: 1.0, roughness, ..base() }
}

fn plastic(roughness: f32) -> BsdfParams {
    BsdfParams { roughness, ..base() }
}

fn glass(roughness: f32) -> BsdfParams {
    BsdfParams { roughness, transmission: 1.0, thin: false, ..base() }
}

fn wall(roughness: f32) -> BsdfParams {
    BsdfParams { roughness, transmission: 1.0, thin: true, ..base() }
}

fn coated() -> BsdfParams {
    let tilted = Vec3::new(0.2, -0.1, 1.0).normalize();
    BsdfParams { clearcoat: 0.8, clearcoat_roughness: 0.3, clearcoat_normal: tilted, ..plastic(0.6) }
}

fn cloth() -> BsdfParams {
    BsdfParams { sheen_color: Vec3::new(0.9, 0.5, 0.7), sheen_roughness: 0.4, ..plastic(0.8) }
}

fn brushed() -> BsdfParams {
    BsdfParams { anisotropy: 0.8, anisotropy_direction: Vec2::new(0.6, 0.8), ..metal(0.4) }
}

fn soap() -> BsdfParams {
    BsdfParams { iridescence: 0.9, iridescence_thickness: 350.0, ..plastic(0.3) }
}

fn mixed() -> BsdfParams {
    BsdfParams {
        metallic: 0.3,
        transmission: 0.5,
        clearcoat: 0.5,
        clearcoat_roughness: 0.4,
        sheen_color: Vec3::splat(0.3),
        sheen_roughness: 0.7,
        base_color: Vec3::new(0.8, 0.5, 0.2),
        ..glass(0.5)
    }
}

/// Every kind of material, by name.
fn zoo() -> Vec<(&'static str, BsdfParams)> {
    let gold = Conductor::named("gold").map(Metal::new);
    vec![
        ("diffuse", BsdfParams::diffuse(Vec3::new(0.8, 0.4, 0.2))),
        ("metal", metal(0.4)),
        ("rough metal", metal(1.0)),
        ("gold", BsdfParams { conductor: gold, ..metal(0.5) }),
        ("plastic", plastic(0.5)),
        ("rough plastic", plastic(1.0)),
        ("half metal", BsdfParams { metallic: 0.5, ..plastic(0.6) }),
        ("glass", glass(0.4)),
        ("rough glass", glass(0.9)),
        ("milky glass", BsdfParams { transmission: 0.5, ..glass(0.6) }),
        ("bubble", BsdfParams { ior: 1.0 / 1.5, ..glass(0.6) }),
        ("wall", wall(0.5)),
        ("milky wall", BsdfParams { transmission: 0.4, ..wall(0.7) }),
        ("coated", coated()),
        ("cloth", cloth()),
        ("brushed", brushed()),
        ("soap", soap()),
        ("mixed", mixed()),
        ("tinted", BsdfParams { specular: 0.6, specular_color: Vec3::new(1.0, 0.3, 2.0), ..plastic(0.4) }),
        ("infinite", BsdfParams { ior: 0.0, specular_color: Vec3::new(0.9, 0.6, 0.3), ..plastic(0.5) }),
    ]
}

fn direction(cos: f32, phi: f32) -> Vec3 {
    warp::direction(cos, phi)
}

fn chi_square_p(bsdf: &Bsdf, wo: Vec3, density: impl Fn(Vec3) -> f32) -> (f64, f64) {
    let mut rng = Rng::new(77);
    let grid = SphereGrid { rows: 24, columns: 24, quadrature: 20 };
    let mut sample = |_| bsdf.sample(wo, rng.next_1d(), rng.next_2d()).map(|s| s.wi);
    let test = sphere_chi_square_with(grid, 20_000, &mut sample, density);
    (test.p, test.density_integral)
}

#[test]
fn samples_follow_their_density() {
    for (name, params) in zoo() {
        let bsdf = Bsdf::new(&params);
        for wo in [direction(0.9, 0.4), direction(0.35, 2.0), direction(-0.6, 1.0)] {
            let (p, integral) = chi_square_p(&bsdf, wo, |wi| bsdf.pdf(wo, wi));
            assert!(p > 1e-4, "{name} {wo}: p {p}, integral {integral}");
            assert!(integral < 1.01, "{name} {wo}: density integrates to {integral}");
        }
    }
}

#[test]
fn a_wrong_density_is_found() {
    for (name, params) in [("metal", metal(0.4)), ("glass", glass(0.4)), ("brushed", brushed())] {
        let (bsdf, wrong) =
            (Bsdf::new(&params), Bsdf::new(&BsdfParams { roughness: params.roughness + 0.05, ..params }));
        let wo = direction(0.7, 0.4);
        let (p, _) = chi_square_p(&bsdf, wo, |wi| wrong.pdf(wo, wi));
        assert!(p < 1e-6, "{name}: p {p}");
    }
}

#[test]
fn weights_are_value_over_density() {
    let mut rng = Rng::new(5);
    for (name, params) in zoo() {
        let bsdf = Bsdf::new(&params);
        for _ in 0..500 {
            let wo = warp::uniform_sphere(rng.next_2d());
            let Some(s) = bsdf.sample(wo, rng.next_1d(), rng.next_2d()) else { continue };
            let (f, pdf) = bsdf.eval_pdf(wo, s.wi);
            assert!(!s.delta && (s.wi.length() - 1.0).abs() < 1e-4, "{name}");
            assert!((pdf / s.pdf - 1.0).abs() < 2e-2, "{name}: {pdf} {}", s.pdf);
            assert!(
                (f / pdf - s.weight).abs().max_element() < 2e-2 * s.weight.max_element() + 1e-4,
                "{name}"
            );
            assert_eq!(s.transmitted, s.wi.z * wo.z < 0.0, "{name}");
        }
    }
}

/// Mean share of energy that is scattered, and its standard error; and the largest single weight.
fn furnace(bsdf: &Bsdf, wo: Vec3, n: u32) -> (Vec3, f32, f32) {
    let mut rng = Rng::new(31);
    let (mut sum, mut square, mut largest) = (Vec3::ZERO, 0.0, 0.0_f32);
    for _ in 0..n {
        if let Some(BsdfSample { weight, radiance_scale, .. }) = bsdf.sample(wo, rng.next_1d(), rng.next_2d())
        {
            let energy = weight * radiance_scale;
            sum += energy;
            square += energy.max_element().powi(2);
            largest = largest.max(energy.max_element());
        }
    }
    let mean = sum / n as f32;
    let variance = (square / n as f32 - mean.max_element().powi(2)).max(0.0);
    (mean, (variance / n as f32).sqrt(), largest)
}

/// Directions of all heights on both sides.
fn heights() -> impl Iterator<Item = Vec3> {
    [1.0, 0.7, 0.3, 0.08, -0.9, -0.5, -0.1].into_iter().map(|cos| direction(cos, 0.7))
}

#[test]
fn white_materials_return_what_they_receive() {
    for roughness in [0.0, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0] {
        let white = [
            ("metal", metal(roughness)),
            ("plastic", plastic(roughness)),
            ("glass", glass(roughness)),
            ("wall", wall(roughness)),
        ];
        for (name, params) in white {
            for wo in heights() {
                let (mean, error, _) = furnace(&Bsdf::new(&params), wo, 10_000);
                let tolerance = 0.012 + 3.0 * error;
                assert!((mean.x - 1.0).abs() < tolerance, "{name} {roughness} {wo}: {mean} +- {error}");
            }
        }
    }
}

#[test]
fn a_rough_metal_without_compensation_would_be_found() {
    // What single scattering alone returns, far from the 1 that the material returns.
    assert!(super::albedo::tables().full_average(1.0) < 0.6);
}

#[test]
fn nothing_returns_more_than_it_receives_and_weights_are_small() {
    for (name, params) in zoo() {
        let bsdf = Bsdf::new(&params);
        for wo in heights() {
            let (mean, error, largest) = furnace(&bsdf, wo, 5_000);
            let tolerance = if params.anisotropy > 0.0 { 0.04 } else { 0.012 };
            assert!(mean.max_element() < 1.0 + tolerance + 3.0 * error, "{name} {wo}: {mean} +- {error}");
            assert!(largest < 10.0, "{name} {wo}: weight {largest}");
        }
    }
}

#[test]
fn stretched_metals_conserve_energy_on_average() {
    for (roughness, anisotropy) in [(0.4, 0.8), (0.2, 0.5), (0.6, 0.6), (0.1, 1.0), (0.05, 0.3)] {
        let bsdf = Bsdf::new(&BsdfParams { anisotropy, ..metal(roughness) });
        let mut rng = Rng::new(8);
        let (mut sum, n) = (0.0, 20_000);
        for _ in 0..n {
            let wo = warp::cosine_hemisphere(rng.next_2d());
            sum += bsdf.sample(wo, rng.next_1d(), rng.next_2d()).map_or(0.0, |s| s.weight.x);
        }
        let mean = sum / n as f32;
        assert!((0.95..1.03).contains(&mean), "{roughness} {anisotropy}: {mean}");
    }
}

#[test]
fn scattering_is_reciprocal() {
    let mut rng = Rng::new(13);
    for (name, params) in zoo() {
        // A coat with its own normal measures cosines against that normal: reciprocal only without.
        let params = BsdfParams { clearcoat_normal: Vec3::Z, ..params };
        let bsdf = Bsdf::new(&params);
        for _ in 0..300 {
            let (a, b) = (warp::uniform_sphere(rng.next_2d()), warp::uniform_sphere(rng.next_2d()));
            if a.z.abs() < 0.02 || b.z.abs() < 0.02 {
                continue;
            }
            let forward = bsdf.eval(a, b) / b.z.abs();
            let mut backward = bsdf.eval(b, a) / a.z.abs();
            if params.transmission > 0.0 && !params.thin && a.z * b.z < 0.0 {
                let eta2 = params.ior * params.ior;
                backward *= if a.z > 0.0 { 1.0 / eta2 } else { eta2 };
            }
            let tolerance = 2e-3 * forward.max_element().max(backward.max_element()) + 1e-5;
            assert!(
                (forward - backward).abs().max_element() < tolerance,
                "{name} {a} {b}: {forward} {backward}"
            );
        }
    }
}

#[test]
fn smooth_surfaces_follow_fresnel_and_snell() {
    let bsdf = Bsdf::new(&glass(0.0));
    assert!(!bsdf.has_nondelta() && !bsdf.transmits());
    let wo = Vec3::new(0.6, 0.0, 0.8);
    let reflectance = super::fresnel::dielectric(0.8, 1.5);
    let reflected = bsdf.sample(wo, 0.5 * reflectance, Vec2::ZERO).expect("reflects");
    assert!(
        reflected.delta
            && !reflected.transmitted
            && (reflected.wi - Vec3::new(-0.6, 0.0, 0.8)).length() < 1e-6
    );
    assert!((reflected.weight - Vec3::ONE).length() < 1e-5);
    let refracted = bsdf.sample(wo, 0.99, Vec2::ZERO).expect("refracts");
    assert!(refracted.transmitted && (refracted.wi.x + 0.4).abs() < 1e-5 && refracted.wi.z < 0.0);
    assert!((refracted.weight * 2.25 - Vec3::ONE).length() < 1e-4 && refracted.radiance_scale == 2.25);
    // And back out, with the inverse factor; past the critical angle only reflection is left.
    let back = bsdf.sample(refracted.wi, 0.99, Vec2::ZERO).expect("leaves");
    assert!((back.wi - wo).length() < 1e-5 && (back.weight - 2.25).length() < 1e-3);
    let grazing = bsdf.sample(direction(-0.5, 0.0), 0.999, Vec2::ZERO).expect("total reflection");
    assert!(!grazing.transmitted && (grazing.weight - Vec3::ONE).length() < 1e-5);
    // A thin wall does not bend light.
    let through = Bsdf::new(&wall(0.0)).sample(wo, 0.99, Vec2::ZERO).expect("passes");
    assert!((through.wi + wo).length() < 1e-6 && through.radiance_scale == 1.0);
}

#[test]
fn dispersion_bends_blue_more_and_says_so() {
    let wo = Vec3::new(0.6, 0.0, 0.8);
    let refract = |u: f32, chosen: bool| {
        let mut params = BsdfParams { dispersion: 1.0, ..glass(0.0) };
        Wavelength::new(u, chosen).apply(&mut params);
        Bsdf::new(&params).sample(wo, 0.99, Vec2::ZERO).expect("refracts")
    };
    let (blue, red) = (refract(0.05, false), refract(0.95, false));
    assert!(blue.dispersed && blue.wi.x.abs() < red.wi.x.abs());
    assert!(blue.weight.z > 2.0 * blue.weight.x && red.weight.x > 2.0 * red.weight.z);
    let later = refract(0.05, true);
    assert!((later.weight.x - later.weight.z).abs() < 1e-6);
    assert!(!Bsdf::new(&glass(0.0)).sample(wo, 0.99, Vec2::ZERO).expect("refracts").dispersed);
}

/// Numbers as they come from files: ordinary ones, the ends of their range, and what is no number at all.
fn wild() -> impl Strategy<Value = f32> {
    prop_oneof![
        6 => 0.0_f32..1.0,
        2 => Just(0.0_f32),
        2 => Just(1.0_f32),
        1 => prop_oneof![Just(f32::NAN), Just(f32::INFINITY), Just(-1.0_f32), Just(1e30_f32), Just(1e-30_f32)],
    ]
}

fn wild_params() -> impl Strategy<Value = BsdfParams> {
    (prop::collection::vec(wild(), 27), any::<bool>()).prop_map(|(v, thin)| BsdfParams {
        base_color: Vec3::new(v[0], v[1], v[2]),
        metallic: v[3],
        roughness: v[4],
        conductor: Conductor::named("gold").filter(|_| v[5] > 0.5).map(Metal::new),
        ior: 0.4 + 1.6 * v[6],
        specular: v[7],
        specular_color: Vec3::new(v[8], v[9], v[10]),
        transmission: v[11],
        transmission_tint: Vec3::new(v[12], v[13], v[14]),
        thin,
        dispersion: v[15],
        clearcoat: v[16],
        clearcoat_roughness: v[17],
        clearcoat_normal: Vec3::new(v[18] - 0.5, v[19] - 0.5, v[20]),
        sheen_color: Vec3::new(v[21], v[21], v[22]),
        sheen_roughness: v[23],
        anisotropy: v[24],
        anisotropy_direction: Vec2::new(v[18], v[19]),
        iridescence: v[25],
        iridescence_ior: 1.0 + v[26],
        iridescence_thickness: 1000.0 * v[22],
    })
}

/// Directions, often on the horizon or on the normal.
fn wild_direction() -> impl Strategy<Value = Vec3> {
    let z = prop_oneof![4 => -1.0_f32..1.0, 1 => -1e-4_f32..1e-4, 1 => Just(0.0_f32), 1 => Just(1.0_f32), 1 => Just(-1.0_f32)];
    (z, 0.0_f32..6.0).prop_map(|(z, phi)| warp::direction(z, phi))
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 1000,
        failure_persistence: None,
        rng_seed: proptest::test_runner::RngSeed::Fixed(2026),
        ..ProptestConfig::default()
    })]

    #[test]
    fn every_answer_is_a_number(params in wild_params(), wo in wild_direction(), wi in wild_direction(), seed in any::<u64>()) {
        let bsdf = Bsdf::new(&params);
        let (f, pdf) = bsdf.eval_pdf(wo, wi);
        prop_assert!(f.is_finite() && f.min_element() >= 0.0, "f {f} {params:?} {wo} {wi}");
        prop_assert!(pdf.is_finite() && pdf >= 0.0, "pdf {pdf} {params:?} {wo} {wi}");
        let albedo = bsdf.albedo();
        prop_assert!(albedo.min_element() >= 0.0 && albedo.max_element() <= 1.0);
        let mut rng = Rng::new(seed);
        for _ in 0..8 {
            if let Some(s) = bsdf.sample(wo, rng.next_1d(), rng.next_2d()) {
                prop_assert!(s.weight.is_finite() && s.weight.min_element() >= 0.0, "{s:?} {params:?} {wo}");
                prop_assert!((s.wi.length() - 1.0).abs() < 1e-3, "{s:?} {params:?} {wo}");
                prop_assert!(s.pdf.is_finite() && (s.pdf > 0.0) != s.delta, "{s:?} {params:?} {wo}");
                prop_assert!(s.transmitted == (s.wi.z * wo.z < 0.0) || s.wi.z == 0.0, "{s:?} {params:?} {wo}");
            }
        }
    }

    #[test]
    fn no_material_makes_light(params in wild_params(), wo in wild_direction()) {
        // At the horizon itself the tables of near mirrors are coarse.
        prop_assume!(wo.z.abs() > 0.02);
        let params = BsdfParams { transmission_tint: Vec3::ONE, ..params };
        let (mean, error, _) = furnace(&Bsdf::new(&params), wo, 300);
        // At single directions of extremely stretched highlights the compensation is rough.
        let tolerance = 0.03 + if params.anisotropy > 0.0 { 0.1 + 0.3 * params.anisotropy.min(1.0) } else { 0.0 };
        prop_assert!(mean.max_element() < 1.0 + tolerance + 4.0 * error, "{mean} +- {error} {params:?} {wo}");
    }
}
