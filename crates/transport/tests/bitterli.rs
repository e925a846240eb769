//! The Cornell box against a picture that Tungsten rendered.
//!
//! The scene is B. Bitterli's ("Rendering resources", 2016), written down again from its Mitsuba file; picture
//! and file stay outside the repository. Pictures are compared at reduced size: means over blocks of the reference
//! against ours through a box filter.

#![allow(clippy::print_stderr, reason = "figures are shown with --nocapture")]

mod common;

use common::reference::{Comparison, Reference, model, soak};
use common::{Build, render, shapes};
use vastlight_math::{Affine3, Vec3};
use vastlight_scene::{Camera, Material, Projection, Scene};
use vastlight_transport::{PixelFilter, RenderSettings};

/// An affine map from the first three rows of a row-major 4x4 matrix.
fn rows(m: [[f32; 4]; 3]) -> Affine3 {
    let column = |i: usize| Vec3::new(m[0][i], m[1][i], m[2][i]);
    Affine3::from_cols(column(0), column(1), column(2), column(3))
}

/// A camera at `eye` along `forward`, with a horizontal angle of view in degrees.
fn camera(eye: Vec3, forward: Vec3, horizontal_degrees: f32, aspect: f32) -> Camera {
    let vertical_fov = 2.0 * ((horizontal_degrees.to_radians() * 0.5).tan() / aspect).atan();
    let camera = Camera::look_at("reference", eye, eye + forward, vertical_fov);
    Camera {
        projection: Projection::Perspective { vertical_fov, lens_radius: 0.0, focus_distance: 1.0 },
        ..camera
    }
}

fn settings(camera: Camera, width: u32, height: u32, max_depth: u32) -> RenderSettings {
    RenderSettings { max_depth, filter: PixelFilter::Box, ..RenderSettings::new(camera, width, height) }
}

fn cornell_box() -> Scene {
    let e = 4.371_14e-8;
    let f = 8.742_28e-8;
    let mut build = Build::in_light(Vec3::ZERO);
    let white = Material::diffuse("white", Vec3::new(0.725, 0.71, 0.68));
    let left = Material::diffuse("left", Vec3::new(0.63, 0.065, 0.05));
    let right = Material::diffuse("right", Vec3::new(0.14, 0.45, 0.091));
    let light = Material::emitter("light", Vec3::new(17.0, 12.0, 4.0), false);
    let mut wall = |material: &Material, m: [[f32; 4]; 3]| {
        build.add(shapes::quad(), material.clone(), rows(m));
    };
    wall(&white, [[-e, 1.0, e, 0.0], [0.0, -f, 2.0, 0.0], [1.0, e, 0.0, 0.0]]);
    wall(&white, [[-1.0, 0.0, -1.748_46e-7, 0.0], [f, f, -2.0, 2.0], [0.0, -1.0, -e, 0.0]]);
    wall(&white, [[0.0, 1.0, 1.311_34e-7, 0.0], [1.0, 0.0, -f, 1.0], [-e, 1.311_34e-7, -2.0, -1.0]]);
    wall(&right, [[e, -1.748_46e-7, 2.0, 1.0], [1.0, 0.0, -f, 1.0], [0.0, 1.0, 2.185_57e-7, 0.0]]);
    wall(&left, [[-e, f, -2.0, -1.0], [1.0, 0.0, -f, 1.0], [0.0, -1.0, -e, 0.0]]);
    wall(&light, [[0.235, 0.0, 0.0, -0.005], [0.0, 0.0, -0.0893, 1.98], [0.0, 0.19, 0.0, -0.03]]);
    let mut block = |m: [[f32; 4]; 3]| {
        build.add(shapes::cube(), white.clone(), rows(m));
    };
    block([
        [0.085_164_3, 0.289_542, 1.311_34e-8, 0.328_631],
        [3.722_65e-9, 1.265_63e-8, -0.3, 0.3],
        [-0.284_951, 0.086_536_3, 0.0, 0.374_592],
    ]);
    block([
        [0.286_776, 0.098_229, 0.0, -0.335_439],
        [-4.362_33e-9, 1.232_38e-8, -0.6, 0.6],
        [-0.099_798_4, 0.282_266, 2.622_68e-8, -0.291_415],
    ]);
    build.finish()
}

#[test]
fn cornell_box_has_tungstens_radiance() {
    let Some(file) = model("bitterli/cornell-box/TungstenRender.exr") else { return };
    let (size, samples) = if soak() { (256, 1024) } else { (64, 128) };
    let full = Reference::read(&file);
    let reference = full.reduced(full.width / size);
    let view = camera(Vec3::new(0.0, 1.0, 6.8), Vec3::NEG_Z, 19.5, 1.0);
    let settings = settings(view, size as u32, size as u32, 65);
    let picture = render(&cornell_box(), &settings, samples);
    let found = Comparison::new(&picture, &reference, 0.02, |_| true);
    eprintln!("cornell box {size}x{size}, {samples} samples: {found:?}");
    assert!((found.mean_ratio - 1.0).abs() < 0.01, "{found:?}");
    assert!(found.mean_z.abs() < 0.3 && found.outliers < 0.02, "{found:?}");
    let wrong = Comparison::new(&picture, &reference.scaled(1.05), 0.02, |_| true);
    assert!((wrong.mean_ratio - 1.0).abs() > 0.01 && wrong.mean_z.abs() > 0.3, "control: {wrong:?}");
}
