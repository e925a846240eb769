//! Furnaces: scenes whose radiance is known in closed form.

mod common;

use common::{Build, assert_close, look_at, render, shapes};
use vastlight_math::{Affine3, Quat, Vec3};
use vastlight_scene::{ColorInput, Material, Mesh, ScalarInput, Scene};
use vastlight_transport::RenderSettings;

/// A closed surface that emits `emission` and reflects `albedo` of what falls on it, black outside.
fn closed(mesh: Mesh, emission: f32, albedo: f32, place: Affine3) -> Scene {
    let material = Material {
        emission: ColorInput::new(Vec3::splat(emission)),
        double_sided: true,
        ..Material::diffuse("wall", Vec3::splat(albedo))
    };
    Build::in_light(Vec3::ZERO).add(mesh, material, place).finish()
}

/// A camera inside, near the middle.
fn inside(place: &Affine3) -> RenderSettings {
    let eye = place.transform_point3(Vec3::new(0.1, -0.05, 0.2));
    let target = place.transform_point3(Vec3::new(0.6, 0.3, -0.5));
    RenderSettings { russian_roulette: false, ..RenderSettings::new(look_at(eye, target, 1.2), 8, 8) }
}

/// Le (1 + a + a^2 + ...): exact for every single path, since all samples inside carry the same.
#[test]
fn without_roulette_the_truncated_series_is_met_exactly() {
    for (mesh, name) in [(shapes::sphere(2, false), "sphere"), (shapes::cube(), "cube")] {
        let scene = closed(mesh, 0.7, 0.6, Affine3::IDENTITY);
        for depth in [1, 2, 3, 10] {
            let settings = RenderSettings { max_depth: depth, ..inside(&Affine3::IDENTITY) };
            let found = render(&scene, &settings, 256).average();
            let series: f64 = (0..depth).map(|k| 0.7 * 0.6_f64.powi(k as i32)).sum();
            assert_close(found, series, 0.02, &format!("{name} depth {depth}"));
        }
    }
}

#[test]
fn with_roulette_the_whole_series_is_met_on_average() {
    let scene = closed(shapes::sphere(2, false), 0.5, 0.8, Affine3::IDENTITY);
    let settings = RenderSettings { max_depth: 1000, russian_roulette: true, ..inside(&Affine3::IDENTITY) };
    let picture = render(&scene, &settings, 256);
    assert_close(picture.average(), 0.5 / (1.0 - 0.8), 0.02, "sphere");
    let z = (picture.average() - 2.5).abs() / picture.standard_error();
    assert!(z < 4.0, "z = {z}");
}

#[test]
fn no_path_leaves_a_closed_mesh_at_any_scale_and_place() {
    let turn = Quat::from_euler(vastlight_math::glam::EulerRot::XYZ, 0.3, 1.1, -0.7);
    for scale in [1e-4_f32, 1e-2, 1.0, 1e3, 1e6] {
        for offset in [0.0, 10.0, 1e5] {
            // The whole of a mesh that is smaller than the numbers' spacing there cannot be represented.
            if scale < offset * 1e-3 {
                continue;
            }
            let place = Affine3::from_scale_rotation_translation(
                Vec3::splat(scale),
                turn,
                Vec3::new(offset, -offset, 0.5 * offset),
            );
            let scene = closed(shapes::sphere(2, false), 0.5, 0.5, place);
            let settings = RenderSettings { max_depth: 20, ..inside(&place) };
            let found = render(&scene, &settings, 32).average();
            assert_close(found, 1.0, 0.02, &format!("scale {scale} offset {offset}"));
        }
    }
}

/// A convex body of albedo 1 in a constant environment cannot be told from the environment.
#[test]
fn a_white_diffuse_body_vanishes_in_a_constant_environment() {
    let scene = Build::in_light(Vec3::new(1.0, 2.0, 0.5))
        .add(shapes::sphere(2, false), Material::diffuse("white", Vec3::ONE), Affine3::IDENTITY)
        .finish();
    let settings = RenderSettings {
        max_depth: 100,
        ..RenderSettings::new(look_at(Vec3::new(0.0, 0.0, 3.0), Vec3::ZERO, 1.0), 16, 16)
    };
    let picture = render(&scene, &settings, 64);
    for (found, expected) in picture.color().into_iter().zip([1.0, 2.0, 0.5]) {
        assert_close(found, expected, 5e-3, "mean");
    }
}

/// Materials that take nothing away: in light that is the same from everywhere they cannot be seen.
#[test]
fn white_materials_vanish_in_a_constant_environment() {
    let metal = |roughness| Material::metal("metal", Vec3::ONE, roughness);
    let glass = |roughness| Material::glass("glass", 1.5, roughness);
    let plastic = Material { roughness: ScalarInput::new(0.3), ..Material::diffuse("plastic", Vec3::ONE) };
    let thin = Material { thickness: 0.0, ..glass(0.0) };
    let dispersive = Material { dispersion: 5.0, ..glass(0.0) };
    // What single scattering loses is given back on average; the measure is the whole body. The sphere is fine, since
    // shading normals over coarse faces gain energy of their own (rough glass 3.4 % with a 16th of the faces).
    for (name, material, tolerance) in [
        ("mirror", metal(0.0), 1e-3),
        ("metal 0.3", metal(0.3), 0.02),
        ("metal 1", metal(1.0), 0.03),
        ("plastic", Material { specular: ScalarInput::new(1.0), ..plastic }, 0.03),
        ("glass", glass(0.0), 5e-3),
        ("glass 0.3", glass(0.3), 0.03),
        ("thin glass", thin, 5e-3),
        ("dispersive glass", dispersive, 0.02),
    ] {
        let scene =
            Build::in_light(Vec3::ONE).add(shapes::sphere(5, true), material, Affine3::IDENTITY).finish();
        let settings = RenderSettings {
            max_depth: 64,
            ..RenderSettings::new(look_at(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, 0.35), 16, 16)
        };
        let picture = render(&scene, &settings, 64);
        assert_close(picture.average(), 1.0, tolerance, name);
        assert_eq!(picture.stats.non_finite, 0);
    }
}

/// Normals that disagree with the faces let no light in and leave no pixel black.
#[test]
fn shading_normals_neither_leak_nor_blacken() {
    let mut mesh = shapes::cube();
    mesh.normals = mesh.positions.iter().map(|p| p.normalize()).collect();
    let scene = Build::in_light(Vec3::ONE)
        .add(mesh, Material::diffuse("white", Vec3::ONE), Affine3::IDENTITY)
        .finish();
    let from_inside = RenderSettings { max_depth: 8, ..inside(&Affine3::IDENTITY) };
    assert_eq!(render(&scene, &from_inside, 64).average(), 0.0);
    let from_outside = RenderSettings {
        max_depth: 8,
        ..RenderSettings::new(look_at(Vec3::new(3.0, 2.0, 4.0), Vec3::ZERO, 0.3), 24, 24)
    };
    let picture = render(&scene, &from_outside, 64);
    assert!(picture.mean.iter().flatten().all(|&x| x > 0.5), "a black pixel");
    assert!(picture.average() > 0.8 && picture.average() < 1.01, "{}", picture.average());
}
