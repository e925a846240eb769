//! The stream tracer: the same bits over every structure and however the work is cut, and closed forms.

mod common;

use common::{Build, assert_close, look_at, render, shapes, with_renderer_over};
use rayon::prelude::*;
use std::f32::consts::PI;
use vastlight_math::{Affine3, Vec3};
use vastlight_scene::{AlphaMode, Conductor, Material, ScalarInput, Scene};
use vastlight_transport::{Integrator, PixelFilter, RenderSettings, Sample};

/// Glass, a mirror, something half there, a lamp.
fn scene() -> Scene {
    let half = Material {
        alpha: ScalarInput::new(0.5),
        alpha_mode: AlphaMode::Blend,
        ..Material::diffuse("half", Vec3::X)
    };
    let at = |x: f32, y: f32, z: f32| Affine3::from_translation(Vec3::new(x, y, z));
    Build::in_light(Vec3::new(0.3, 0.5, 0.8))
        .add(shapes::sphere(2, true), Material::glass("glass", 1.5, 0.0), Affine3::IDENTITY)
        .add(shapes::cube(), half, at(2.2, 0.0, 0.0))
        .add(shapes::cube(), Material::metal("mirror", Vec3::splat(0.9), 0.02), at(-2.2, 0.0, 0.0))
        .add(shapes::quad(), Material::diffuse("grey", Vec3::splat(0.5)), at(0.0, 1.5, -2.0))
        .add(shapes::quad(), Material::emitter("lamp", Vec3::splat(5.0), true), at(0.0, 0.0, -3.0))
        .finish()
}

fn whitted(eye: Vec3, target: Vec3, fov: f32, size: u32) -> RenderSettings {
    RenderSettings {
        integrator: Integrator::Whitted,
        filter: PixelFilter::Box,
        ..RenderSettings::new(look_at(eye, target, fov), size, size)
    }
}

/// Bits of every sample over a structure, rendered in tiles of `tile` pixels.
fn bits(accel: &str, settings: &RenderSettings, tile: u32, threads: usize) -> Vec<([u32; 2], [u32; 3])> {
    with_renderer_over(accel, &scene(), settings.clone(), |renderer| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        let render = |tile| {
            let mut found = Vec::new();
            let mut sink =
                |pixel: [u32; 2], s: &Sample| found.push((pixel, s.radiance.to_array().map(f32::to_bits)));
            renderer.render_tile(tile, 0..2, &mut sink).expect("in memory");
            found
        };
        let tiles = renderer.settings().region().split(tile);
        let mut found: Vec<_> = pool.install(|| tiles.into_par_iter().flat_map_iter(render).collect());
        found.sort_by_key(|&(pixel, _)| pixel);
        found
    })
}

#[test]
fn structures_threads_and_tiles_do_not_change_a_bit() {
    let settings = whitted(Vec3::new(1.0, 1.0, 7.0), Vec3::new(0.0, 0.2, 0.0), 0.9, 40);
    let expected = bits("", &settings, 40, 1);
    assert_eq!(expected.len(), 40 * 40 * 2);
    for (accel, tile, threads) in [
        ("kd-threaded", 40, 1),
        ("kd-threaded", 7, 3),
        ("kd-threaded-sah", 16, 2),
        ("kd-stack", 1, 2),
        ("", 9, 5),
    ] {
        assert!(bits(accel, &settings, tile, threads) == expected, "{accel}, {tile}, {threads}");
    }
    let other = RenderSettings { seed: 1, ..settings };
    assert!(bits("kd-threaded", &other, 16, 2) != expected, "another seed is another picture");
}

/// Glass that absorbs nothing shows the light around it, whatever the way through it.
#[test]
fn clear_glass_in_even_light_is_invisible() {
    let scene = Build::in_light(Vec3::ONE)
        .add(shapes::sphere(3, false), Material::glass("glass", 1.5, 0.0), Affine3::IDENTITY)
        .finish();
    let settings = RenderSettings { max_depth: 30, ..whitted(Vec3::Z * 4.0, Vec3::ZERO, 0.4, 24) };
    let picture = render(&scene, &settings, 1);
    assert_close(picture.average(), 1.0, 0.02, "a glass ball");
    assert!(picture.stats.rays > 5 * 24 * 24, "rays are derived: {}", picture.stats.rays);
    let shallow = RenderSettings { max_depth: 2, ..settings };
    assert!(render(&scene, &shallow, 1).average() < 0.2, "the way through needs three segments");
}

/// A lamp seen over two mirrors has its radiance times both reflectances.
#[test]
fn mirrors_multiply_their_reflectances() {
    let tilted = |y: f32, angle: f32| {
        Affine3::from_translation(Vec3::new(0.0, y, 0.0)) * Affine3::from_rotation_x(angle)
    };
    let mirror = |r: f32| Material::metal("mirror", Vec3::splat(r), 0.0);
    // The view along -z turns up at the first mirror and back to +z at the second, where the lamp is.
    let scene = Build::in_light(Vec3::ZERO)
        .add(shapes::quad(), mirror(0.8), tilted(0.0, -PI / 4.0))
        .add(shapes::quad(), mirror(0.5), tilted(3.0, PI / 4.0))
        .add(
            shapes::quad(),
            Material::emitter("lamp", Vec3::splat(2.0), true),
            Affine3::from_translation(Vec3::new(0.0, 3.0, 6.0)),
        )
        .finish();
    let settings = whitted(Vec3::Z * 4.0, Vec3::ZERO, 0.01, 4);
    let schlick = |r: f64| r + (1.0 - r) * (1.0 - 0.5_f64.sqrt()).powi(5);
    let expected = 2.0 * schlick(0.8) * schlick(0.5);
    assert_close(render(&scene, &settings, 1).average(), expected, 1e-3, "two mirrors");
    let short = RenderSettings { max_depth: 2, ..settings };
    assert_eq!(render(&scene, &short, 1).average(), 0.0);
}

/// Mean radiance of a floor under a lamp at its side, with a slab between the two.
fn lit_past(slab: Option<Material>) -> f64 {
    let at = |x: f32, y: f32, z: f32| Affine3::from_translation(Vec3::new(x, y, z));
    let lamp = Material::emitter("lamp", Vec3::splat(9.0), true);
    let mut build = Build::in_light(Vec3::ZERO);
    build.add(shapes::quad(), Material::diffuse("floor", Vec3::splat(0.6)), at(0.0, 0.0, 0.0)).add(
        shapes::quad(),
        lamp,
        at(4.0, 0.0, 3.0),
    );
    if let Some(material) = slab {
        build.add(shapes::cube(), material, at(2.5, 0.0, 1.7));
    }
    render(&build.finish(), &whitted(Vec3::new(-1.0, 0.0, 4.0), Vec3::ZERO, 0.1, 8), 4).average()
}

#[test]
fn shadow_rays_pass_clear_glass_and_nothing_else() {
    let free = lit_past(None);
    assert!(free > 0.0);
    assert_eq!(lit_past(Some(Material::glass("clear", 1.5, 0.0))), free);
    let opaque = lit_past(Some(Material::diffuse("wall", Vec3::ONE)));
    assert!(opaque < 0.5 * free, "{opaque} {free}");
}

#[test]
fn measured_metals_mirror_their_own_colour() {
    let gold = Conductor { eta: Vec3::new(0.14, 0.37, 1.44), k: Vec3::new(3.98, 2.39, 1.60) };
    let metal = Material { conductor: Some(gold), ..Material::metal("gold", Vec3::ONE, 0.0) };
    let scene = Build::in_light(Vec3::ONE).add(shapes::quad(), metal, Affine3::IDENTITY).finish();
    let seen = render(&scene, &whitted(Vec3::Z * 4.0, Vec3::ZERO, 0.01, 2), 1).color();
    let k2 = gold.k * gold.k;
    let (minus, plus) = (gold.eta - Vec3::ONE, gold.eta + Vec3::ONE);
    let expected = (minus * minus + k2) / (plus * plus + k2);
    for (seen, expected) in seen.into_iter().zip(expected.to_array()) {
        assert_close(seen, f64::from(expected), 1e-3, "gold");
    }
}

/// Diffuse surfaces look as direct light in the path tracer.
#[test]
fn diffuse_surfaces_have_the_path_tracers_direct_light() {
    let at = |x: f32, y: f32, z: f32| Affine3::from_translation(Vec3::new(x, y, z));
    let scene = Build::in_light(Vec3::splat(0.2))
        .add(shapes::sphere(3, true), Material::diffuse("red", Vec3::new(0.8, 0.2, 0.2)), at(0.0, 0.0, 0.0))
        .add(shapes::cube(), Material::diffuse("grey", Vec3::splat(0.6)), at(1.5, 0.0, 1.0))
        .add(shapes::quad(), Material::emitter("lamp", Vec3::splat(9.0), true), at(0.0, 0.0, 4.0))
        .finish();
    let settings = whitted(Vec3::new(3.0, 2.0, 6.0), Vec3::ZERO, 0.5, 24);
    let stream = render(&scene, &settings, 256);
    let path = render(&scene, &RenderSettings { integrator: Integrator::Direct, ..settings }, 256);
    let error = (stream.standard_error().powi(2) + path.standard_error().powi(2)).sqrt();
    let (a, b) = (stream.average(), path.average());
    assert!((a - b).abs() < 4.0 * error && error < 0.01 * b, "{a} {b} +- {error}");
    assert!((1.1 * a - b).abs() > 4.0 * error, "control: 10 % more is seen");
}
