//! Implicit surfaces in light whose radiance is known in closed form.

mod common;

use common::{Build, assert_close, look_at, render, shapes};
use std::sync::Arc;
use vastlight_math::{Affine3, Quat, Vec3};
use vastlight_scene::{ColorInput, ImplicitShape, Julia, Material, Mesh, Metaball, Metaballs};
use vastlight_transport::RenderSettings;

fn surface(shape: ImplicitShape) -> Mesh {
    Mesh { implicit: Some(Arc::new(shape)), ..Mesh::default() }
}

/// Balls of radius 1.5 about the given places on the x axis.
fn balls(places: &[f32]) -> Mesh {
    let ball = |&x: &f32| Metaball { center: Vec3::X * x, radius: 1.5, strength: 1.0 };
    let balls = places.iter().map(ball).collect();
    surface(ImplicitShape::Metaballs(Metaballs { balls, threshold: 0.2 }))
}

fn julia() -> Mesh {
    surface(ImplicitShape::Julia(Julia { c: [-0.2, 0.6, 0.2, 0.2], slice: 0.0, iterations: 8 }))
}

/// A camera that sees little but the shape.
fn from_outside(max_depth: u32) -> RenderSettings {
    let camera = look_at(Vec3::new(1.0, 1.5, 5.0), Vec3::ZERO, 0.3);
    RenderSettings { max_depth, ..RenderSettings::new(camera, 16, 16) }
}

/// Materials that take nothing away cannot be seen in light that is the same from everywhere.
#[test]
fn white_surfaces_vanish_in_a_constant_environment() {
    let metal = |roughness| Material::metal("metal", Vec3::ONE, roughness);
    let glass = |roughness| Material::glass("glass", 1.5, roughness);
    for (name, mesh, material, tolerance) in [
        ("glass ball", balls(&[0.0]), glass(0.0), 5e-3),
        ("two glass balls", balls(&[-0.8, 0.8]), glass(0.0), 5e-3),
        ("two rough glass balls", balls(&[-0.8, 0.8]), glass(0.3), 0.03),
        ("Julia set of mirrors", julia(), metal(0.0), 5e-3),
        ("Julia set of metal", julia(), metal(0.3), 0.03),
        ("white Julia set", julia(), Material::diffuse("white", Vec3::ONE), 0.01),
    ] {
        let scene = Build::in_light(Vec3::ONE).add(mesh, material, Affine3::IDENTITY).finish();
        let picture = render(&scene, &from_outside(256), 32);
        assert_close(picture.average(), 1.0, tolerance, name);
        assert!(picture.material.iter().filter(|m| m.is_some()).count() > 40, "{name} is out of sight");
        assert_eq!(picture.stats.non_finite, 0);
    }
}

/// A convex white body has no light from itself: one bounce gives all, and less if rays met the surface they leave.
#[test]
fn rays_leave_their_own_surface_at_any_scale_and_place() {
    for (scale, offset) in [(1e-3_f32, 0.0_f32), (1.0, 0.0), (1.0, 1e3), (1e4, 1e5)] {
        let place = Affine3::from_scale_rotation_translation(
            Vec3::splat(scale),
            Quat::from_rotation_y(0.7),
            Vec3::new(offset, -offset, 0.5 * offset),
        );
        let at = |x, y, z| place.transform_point3(Vec3::new(x, y, z));
        let camera = look_at(at(1.0, 1.5, 5.0), at(0.0, 0.0, 0.0), 0.1);
        let settings = RenderSettings { max_depth: 2, ..RenderSettings::new(camera, 8, 8) };
        let white = Material::diffuse("white", Vec3::ONE);
        let scene = Build::in_light(Vec3::ONE).add(balls(&[0.0]), white, place).finish();
        let picture = render(&scene, &settings, 64);
        assert!(picture.material.iter().all(|&m| m == Some(0)), "scale {scale}: the ball fills the picture");
        assert_close(picture.average(), 1.0, 0.01, &format!("scale {scale} offset {offset}"));
    }
}

/// A closed wall that emits 0.5 and reflects half of what falls on it, black outside: 1 within, less if light got out.
#[test]
fn no_path_leaves_a_closed_surface() {
    let wall = Material {
        emission: ColorInput::new(Vec3::splat(0.5)),
        double_sided: true,
        ..Material::diffuse("wall", Vec3::splat(0.5))
    };
    let camera = look_at(Vec3::new(0.1, -0.05, 0.2), Vec3::new(0.6, 0.3, -0.5), 1.2);
    let settings =
        RenderSettings { russian_roulette: false, max_depth: 24, ..RenderSettings::new(camera, 8, 8) };
    for (name, mesh) in [("implicit", balls(&[-0.8, 0.8])), ("mesh", shapes::sphere(2, false))] {
        let scene = Build::in_light(Vec3::ZERO).add(mesh, wall.clone(), Affine3::IDENTITY).finish();
        assert_close(render(&scene, &settings, 64).average(), 1.0, 0.02, name);
    }
}
