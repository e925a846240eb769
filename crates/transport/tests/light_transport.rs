//! Direct light, multiple importance sampling, alpha and glass against closed forms.

mod common;

use common::{Build, Picture, assert_close, look_at, orthographic, render, shapes, with_renderer};
use std::f64::consts::PI;
use vastlight_math::{Affine3, Quat, Vec3};
use vastlight_scene::{AlphaMode, ColorInput, Light, LightKind, Material, ScalarInput, Scene};
use vastlight_transport::{DirectSampling, PixelFilter, RenderSettings, Sample};

/// The map that turns +z of a shape to -y and scales it, to `at`: a quad becomes a lamp.
fn facing_down(half: f32, at: Vec3) -> Affine3 {
    Affine3::from_scale_rotation_translation(
        Vec3::splat(half),
        Quat::from_rotation_x(std::f32::consts::FRAC_PI_2),
        at,
    )
}

/// The map that turns +z of a shape to +y and scales it: a quad becomes a floor at height 0.
fn facing_up(half: f32) -> Affine3 {
    Affine3::from_scale_rotation_translation(
        Vec3::splat(half),
        Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2),
        Vec3::ZERO,
    )
}

/// Share of the cosine-weighted hemisphere over the origin that the rectangle [0, a] x [0, b] at height 1 covers.
fn corner_factor(a: f64, b: f64) -> f64 {
    let (ra, rb) = ((1.0 + a * a).sqrt(), (1.0 + b * b).sqrt());
    (a / ra * (b / ra).atan() + b / rb * (a / rb).atan()) / (2.0 * PI)
}

/// The same for the square of half width `half` at height `height`, for a point at (x, z) from below its middle.
fn square_factor(half: f64, height: f64, x: f64, z: f64) -> f64 {
    let (x0, x1) = ((-half - x) / height, (half - x) / height);
    let (z0, z1) = ((-half - z) / height, (half - z) / height);
    corner_factor(x1, z1) - corner_factor(x0, z1) - corner_factor(x1, z0) + corner_factor(x0, z0)
}

fn lamp_over_floor(radiance: f32) -> Scene {
    Build::in_light(Vec3::ZERO)
        .add(shapes::quad(), Material::diffuse("floor", Vec3::splat(0.6)), facing_up(10.0))
        .add(
            shapes::quad(),
            Material::emitter("lamp", Vec3::splat(radiance), false),
            facing_down(0.7, Vec3::new(0.0, 2.0, 0.0)),
        )
        .finish()
}

/// Mean of radiance over its closed form at the very points that were sampled, minus 1, and its standard error.
fn lamp_error(radiance: f32, sampling: DirectSampling) -> (f64, f64) {
    let camera = look_at(Vec3::new(0.5, 1.0, 4.0), Vec3::ZERO, 0.3);
    let settings =
        RenderSettings { max_depth: 2, direct_sampling: sampling, ..RenderSettings::new(camera, 32, 32) };
    let (mut n, mut sum, mut squares) = (0.0, 0.0, 0.0);
    let mut sink = |_: [u32; 2], sample: &Sample| {
        let p = sample.position;
        let expected = 0.6 * 5.0 * square_factor(0.7, 2.0, f64::from(p.x), f64::from(p.z));
        let error = f64::from(sample.radiance.y) / expected - 1.0;
        (n, sum, squares) = (n + 1.0, sum + error, squares + error * error);
    };
    with_renderer(&lamp_over_floor(radiance), settings, |r| {
        r.render_tile(r.settings().region(), 0..64, &mut sink).expect("in memory");
    });
    let mean = sum / n;
    (mean, ((squares / n - mean * mean) / n).sqrt())
}

#[test]
fn a_square_lamp_over_a_floor_has_its_closed_form() {
    for sampling in [DirectSampling::Both, DirectSampling::Light, DirectSampling::Bsdf] {
        let (mean, error) = lamp_error(5.0, sampling);
        assert!(mean.abs() < 4.0 * error + 1e-4 && error < 0.05, "{sampling:?}: {mean} +- {error}");
    }
    let (mean, error) = lamp_error(5.5, DirectSampling::Both);
    assert!(mean.abs() > 4.0 * error, "control: {mean} +- {error}");
}

/// A glossy and a diffuse surface under two lamps and a sky.
fn mixed_scene(lamp: f32) -> Scene {
    Build::in_light(Vec3::new(0.2, 0.3, 0.4))
        .add(shapes::quad(), Material::diffuse("floor", Vec3::splat(0.6)), facing_up(10.0))
        .add(
            shapes::sphere(3, true),
            Material::metal("ball", Vec3::new(0.9, 0.7, 0.5), 0.4),
            Affine3::from_translation(Vec3::Y),
        )
        .add(
            shapes::quad(),
            Material::emitter("large", Vec3::splat(lamp), false),
            facing_down(1.0, Vec3::new(1.0, 3.0, 0.0)),
        )
        .add(
            shapes::quad(),
            Material::emitter("small", Vec3::splat(20.0), true),
            facing_down(0.2, Vec3::new(-1.5, 2.0, 1.0)),
        )
        .finish()
}

/// Distance of two pictures' averages in standard errors.
fn z_of(a: &Picture, b: &Picture) -> f64 {
    (a.average() - b.average()).abs() / a.standard_error().hypot(b.standard_error())
}

#[test]
fn all_ways_to_sample_direct_light_agree() {
    let picture = |lamp: f32, sampling, samples| {
        let camera = look_at(Vec3::new(0.0, 2.0, 5.0), Vec3::new(0.0, 0.7, 0.0), 0.7);
        let settings =
            RenderSettings { max_depth: 3, direct_sampling: sampling, ..RenderSettings::new(camera, 32, 32) };
        render(&mixed_scene(lamp), &settings, samples)
    };
    let both = picture(4.0, DirectSampling::Both, 128);
    let light = picture(4.0, DirectSampling::Light, 256);
    let bsdf = picture(4.0, DirectSampling::Bsdf, 256);
    assert!(z_of(&both, &light) < 4.0, "light: {} {}", both.average(), light.average());
    assert!(z_of(&both, &bsdf) < 4.0, "bsdf: {} {}", both.average(), bsdf.average());
    assert!(both.standard_error() < light.standard_error() && both.standard_error() < bsdf.standard_error());
    let wrong = picture(4.4, DirectSampling::Both, 128);
    assert!(z_of(&both, &wrong) > 6.0, "control: {} {}", both.average(), wrong.average());
}

/// Straight down through a pane over a lamp: every reflection between both faces counts.
fn pane(color: Vec3) -> [f64; 3] {
    let glass =
        Material { attenuation_color: color, attenuation_distance: 0.5, ..Material::glass("pane", 1.5, 0.0) };
    let scene = Build::in_light(Vec3::ZERO)
        .add(shapes::cube(), glass, Affine3::from_scale(Vec3::new(5.0, 0.25, 5.0)))
        .add(
            shapes::quad(),
            Material::emitter("lamp", Vec3::ONE, true),
            facing_down(5.0, Vec3::new(0.0, -1.0, 0.0)),
        )
        .finish();
    let camera = orthographic(Vec3::new(0.1, 3.0, 0.2), Vec3::new(0.1, 0.0, 0.2), 0.5);
    let settings = RenderSettings { max_depth: 64, ..RenderSettings::new(camera, 8, 8) };
    render(&scene, &settings, 1024).color()
}

#[test]
fn a_pane_transmits_what_fresnel_beer_and_lambert_say() {
    let r: f64 = (0.5_f64 / 2.5).powi(2);
    // The pane is half a unit thick, as long as the attenuation distance.
    for (color, absorbed) in [(Vec3::ONE, [1.0; 3]), (Vec3::new(0.8, 0.5, 0.1), [0.8, 0.5, 0.1])] {
        for (found, a) in pane(color).into_iter().zip(absorbed) {
            let expected = (1.0 - r).powi(2) * a / (1.0 - r * r * a * a);
            assert_close(found, expected, 0.01, &format!("transmittance {a}"));
        }
    }
}

/// A sheet facing up at `height` that covers `alpha` and shines `color`.
fn sheet(build: &mut Build, height: f32, alpha: f32, color: Vec3) {
    let material = Material {
        alpha: ScalarInput::new(alpha),
        alpha_mode: AlphaMode::Blend,
        unlit: true,
        base_color: ColorInput::new(color),
        ..Material::new("sheet")
    };
    build.add(shapes::quad(), material, Affine3::from_translation(Vec3::Y * height) * facing_up(5.0));
}

#[test]
fn blended_sheets_have_the_closed_form_of_over() {
    let mut build = Build::in_light(Vec3::new(0.1, 0.2, 0.9));
    let sheets = [(2.0, 0.5, Vec3::X), (1.0, 0.25, Vec3::Y), (0.0, 0.7, Vec3::splat(0.5))];
    for (height, alpha, color) in sheets {
        sheet(&mut build, height, alpha, color);
    }
    let camera = orthographic(Vec3::new(0.0, 5.0, 0.0), Vec3::ZERO, 0.5);
    let found = render(&build.finish(), &RenderSettings::new(camera, 16, 16), 256).color();
    let over = |behind: Vec3, (_, alpha, color): &(f32, f32, Vec3)| *color * *alpha + behind * (1.0 - *alpha);
    let expected = sheets.iter().rev().fold(Vec3::new(0.1, 0.2, 0.9), over);
    for (found, expected) in found.into_iter().zip(expected.to_array()) {
        assert_close(found, f64::from(expected), 0.01, "over");
    }
}

/// A floor under a sheet of alpha, lit by a directional light straight from above: mean and what it would be without.
fn shadow_of_sheet(mode: AlphaMode, alpha: f32) -> (f64, f64) {
    let mut build = Build::in_light(Vec3::ZERO);
    build.add(shapes::quad(), Material::diffuse("floor", Vec3::splat(0.5)), facing_up(5.0));
    let material = Material { alpha: ScalarInput::new(alpha), alpha_mode: mode, ..Material::new("sheet") };
    build.add(shapes::quad(), material, Affine3::from_translation(Vec3::Y * 3.0) * facing_up(2.0));
    build.desc.lights.push(Light {
        name: "sun".into(),
        kind: LightKind::Directional,
        world_from_light: Affine3::from_quat(Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2)),
        intensity: Vec3::splat(2.0),
        range: f32::INFINITY,
        profile: None,
    });
    let camera = look_at(Vec3::new(0.0, 2.0, 4.0), Vec3::ZERO, 0.2);
    let settings = RenderSettings { max_depth: 2, ..RenderSettings::new(camera, 16, 16) };
    (render(&build.finish(), &settings, 256).average(), 0.5 / PI * 2.0)
}

#[test]
fn shadows_of_alpha_are_as_deep_as_alpha() {
    let (found, lit) = shadow_of_sheet(AlphaMode::Blend, 0.3);
    assert_close(found, 0.7 * lit, 0.01, "blend");
    let (found, lit) = shadow_of_sheet(AlphaMode::Mask(0.5), 0.3);
    assert_close(found, lit, 1e-4, "mask, hole");
    assert_eq!(shadow_of_sheet(AlphaMode::Mask(0.5), 0.6).0, 0.0);
    assert_eq!(shadow_of_sheet(AlphaMode::Opaque, 0.3).0, 0.0);
}

#[test]
fn a_one_sided_lamp_shines_to_its_front_also_when_mirrored() {
    for mirror in [1.0_f32, -1.0] {
        let place = Affine3::from_scale(Vec3::new(mirror, 1.0, 1.0));
        let scene = Build::in_light(Vec3::ZERO)
            .add(shapes::quad(), Material::emitter("lamp", Vec3::ONE, false), place)
            .finish();
        let seen_from = |z: f32| {
            let camera = look_at(Vec3::new(0.0, 0.0, z), Vec3::ZERO, 0.1);
            render(&scene, &RenderSettings::new(camera, 4, 4), 4).average()
        };
        assert_eq!((seen_from(3.0), seen_from(-3.0)), (1.0, 0.0), "mirror {mirror}");
    }
}

#[test]
fn depth_normal_and_ids_of_the_first_hit_are_right() {
    let scene = mixed_scene(4.0);
    let camera = look_at(Vec3::new(0.0, 1.0, 5.0), Vec3::new(0.0, 1.0, 0.0), 0.2);
    let settings = RenderSettings { filter: PixelFilter::Box, ..RenderSettings::new(camera, 9, 9) };
    let mut middle = None;
    let mut sink = |pixel: [u32; 2], s: &Sample| {
        if pixel == [4, 4] {
            middle = Some(*s);
        }
    };
    with_renderer(&scene, settings, |r| {
        r.render_tile(r.settings().region(), 0..1, &mut sink).expect("in memory")
    });
    let s = middle.expect("a sample of the middle pixel");
    assert_eq!((s.object, s.material, s.coverage), (1, 1, 1.0));
    assert!((s.depth - 4.0).abs() < 0.02 && s.normal.z > 0.98 && (s.position.z - 1.0).abs() < 0.02, "{s:?}");
}
