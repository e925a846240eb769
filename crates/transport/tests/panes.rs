//! Window panes: shadow rays and paths agree about the light that goes straight through them.

mod common;

use common::{Build, Picture, assert_close, look_at, render, shapes};
use std::f64::consts::PI;
use vastlight_math::{Affine3, Quat, Vec3};
use vastlight_scene::{ColorInput, Light, LightKind, Material, Scene};
use vastlight_transport::{DirectSampling, Integrator, RenderSettings};

const TINT: Vec3 = Vec3::new(0.9, 0.5, 0.2);

/// A quad in a horizontal plane; its front looks up, or down for a negative `side`.
fn horizontal(half: f32, height: f32, side: f32) -> Affine3 {
    let turn = Quat::from_rotation_x(-side * std::f32::consts::FRAC_PI_2);
    Affine3::from_scale_rotation_translation(Vec3::splat(half), turn, Vec3::Y * height)
}

fn pane(ior: f32) -> Material {
    Material { thickness: 0.0, base_color: ColorInput::new(TINT), ..Material::glass("pane", ior, 0.0) }
}

/// A floor under panes of the given material.
fn floor_under(material: &Material, panes: usize) -> Build {
    let mut build = Build::in_light(Vec3::ZERO);
    build.add(shapes::quad(), Material::diffuse("floor", Vec3::splat(0.6)), horizontal(10.0, 0.0, 1.0));
    for i in 0..panes {
        build.add(shapes::quad(), material.clone(), horizontal(10.0, 1.5 + 0.1 * i as f32, 1.0));
    }
    build
}

fn lamp_behind(material: &Material) -> Scene {
    let lamp = Material::emitter("lamp", Vec3::splat(5.0), false);
    floor_under(material, 1).add(shapes::quad(), lamp, horizontal(1.0, 2.5, -1.0)).finish()
}

fn picture(scene: &Scene, integrator: Integrator, sampling: DirectSampling) -> Picture {
    let camera = look_at(Vec3::new(0.5, 1.0, 4.0), Vec3::ZERO, 0.3);
    // Direct light: the pane on its way does not count.
    let settings = RenderSettings {
        max_depth: 2,
        direct_sampling: sampling,
        integrator,
        ..RenderSettings::new(camera, 32, 32)
    };
    render(scene, &settings, 256)
}

#[test]
fn all_strategies_see_a_lamp_through_a_pane() {
    for integrator in [Integrator::Path, Integrator::Direct] {
        let [both, light, bsdf] = [DirectSampling::Both, DirectSampling::Light, DirectSampling::Bsdf]
            .map(|sampling| picture(&lamp_behind(&pane(1.5)), integrator, sampling));
        for other in [&light, &bsdf] {
            let error = (both.standard_error().powi(2) + other.standard_error().powi(2)).sqrt();
            assert!((both.average() - other.average()).abs() < 4.0 * error, "{integrator:?}");
            assert!(error < 0.02 * both.average(), "{integrator:?} {error}");
        }
        let [r, g, b] = both.color();
        assert!(r > 1.5 * g && g > 1.5 * b, "tinted: {r} {g} {b}");
    }
    let opaque =
        picture(&lamp_behind(&Material::diffuse("wall", TINT)), Integrator::Path, DirectSampling::Both);
    assert_eq!(opaque.average(), 0.0, "control");
}

#[test]
fn the_sun_through_panes_has_its_closed_form() {
    for panes in [0, 1, 3] {
        let mut build = floor_under(&pane(1.0), panes);
        build.desc.lights.push(Light {
            name: "sun".into(),
            kind: LightKind::Directional,
            world_from_light: Affine3::from_quat(Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2)),
            intensity: Vec3::splat(2.0),
            range: f32::INFINITY,
            profile: None,
        });
        let scene = build.finish();
        let found = picture(&scene, Integrator::Direct, DirectSampling::Both).color();
        // An index of 1 reflects nothing: what is left is the colour of each pane.
        for (found, tint) in found.into_iter().zip(TINT.to_array()) {
            let passed = f64::from(tint).powi(panes as i32);
            assert_close(found, 0.6 / PI * 2.0 * passed, 0.03, &format!("{panes} panes"));
        }
    }
}
