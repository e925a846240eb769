//! The Cornell box and Veach's plates against pictures that Tungsten rendered.
//!
//! The scenes are B. Bitterli's ("Rendering resources", 2016), written down again from their Mitsuba files; pictures
//! and files stay outside the repository. Pictures are compared at reduced size: means over blocks of the reference
//! against ours through a box filter.

#![allow(clippy::print_stderr, reason = "figures are shown with --nocapture")]

mod common;

use common::reference::{Comparison, Reference, model, soak};
use common::{Build, render, shapes};
use vastlight_math::{Affine3, Vec3};
use vastlight_scene::{Camera, Conductor, Material, Mesh, Projection, ScalarInput, Scene};
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

fn veach_plates() -> Scene {
    let mut build = Build::in_light(Vec3::ZERO);
    // Theirs reflects 0.3 of what the metal does: ours is 0.3 metal, the rest black.
    let metal = |alpha: f32| Material {
        conductor: Some(Conductor {
            eta: Vec3::new(0.200_438, 0.924_033, 1.102_21),
            k: Vec3::new(3.912_95, 2.452_85, 2.142_19),
        }),
        metallic: ScalarInput::new(0.3),
        roughness: ScalarInput::new(alpha.sqrt()),
        ..Material::diffuse("plate", Vec3::ZERO)
    };
    let mut plate = |alpha: f32, x: [f32; 2], y: [f32; 2], at: [f32; 2]| {
        let m = [[x[0], x[1], 0.0, at[0]], [y[0], y[1], 0.0, at[1]], [0.0, 0.0, 4.0, 0.0]];
        build.add(shapes::cube(), metal(alpha), rows(m));
    };
    plate(0.01, [0.805_757, 0.096_177_5], [-0.673_242, 0.115_108], [0.264_069, 4.098_01]);
    plate(0.05, [0.972_057, 0.056_713_4], [-0.396_994, 0.138_865], [3.061_63, 2.717_02]);
    plate(0.1, [1.031_91, 0.027_725_2], [-0.194_077, 0.147_415], [7.099_81, 1.818_91]);
    plate(0.25, [1.042_17, 0.018_283_1], [-0.127_982, 0.148_882], [10.676_9, 1.233_76]);
    let grey = Material::diffuse("grey", Vec3::splat(0.5));
    let floor = [[9.9, 0.0, 0.0, 4.9], [0.0, 0.0, 9.9, 0.0], [0.0, -23.76, 0.0, 0.0]];
    let wall = [[0.0, 0.0, 9.9, -5.0], [-9.9, 0.0, 0.0, 9.9], [0.0, -23.76, 0.0, 0.0]];
    build.add(shapes::quad(), grey.clone(), rows(floor));
    build.add(shapes::quad(), grey, rows(wall));
    for (radius, z, radiance) in [(1.0, -2.8, 7.599_09), (0.5, 0.0, 30.396_4), (0.05, 2.7, 3039.64)] {
        let light = Material::emitter("light", Vec3::splat(radiance), false);
        build.add(ball(), light, place(radius, Vec3::new(0.0, 6.5, z)));
    }
    build.finish()
}

/// A sphere of triangles with the area of the round one, so that its power is right.
fn ball() -> Mesh {
    let mut mesh = shapes::sphere(3, false);
    let area: f32 = (0..mesh.triangles.len() as u32)
        .map(|t| mesh.corners(t))
        .map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length())
        .sum();
    let scale = (4.0 * std::f32::consts::PI / area).sqrt();
    mesh.positions.iter_mut().for_each(|p| *p *= scale);
    mesh
}

fn place(scale: f32, at: Vec3) -> Affine3 {
    Affine3::from_scale_rotation_translation(Vec3::splat(scale), Default::default(), at)
}

#[test]
fn veach_plates_have_tungstens_radiance() {
    let Some(file) = model("bitterli/veach-mis/TungstenRender.exr") else { return };
    let (factor, samples) = if soak() { (5, 1024) } else { (16, 128) };
    let reference = Reference::read(&file).reduced(factor);
    let (width, height) = (reference.width, reference.height);
    let view = camera(Vec3::new(28.2792, 3.5, 0.0), Vec3::NEG_X, 35.0, 16.0 / 9.0);
    let picture = render(&veach_plates(), &settings(view, width as u32, height as u32, 2), samples);
    // The picture has direct light alone, whatever its scene file says: Mitsuba agrees at depth 2, not at 5.
    // Walls and floor are the materials 4 and 5. The plates' own pixels differ: our facets follow GGX, theirs Beckmann.
    let grey = |i: usize| matches!(picture.material[i], Some(4 | 5));
    let found = Comparison::new(&picture, &reference, 0.03, grey);
    let plates = Comparison::new(&picture, &reference, 0.03, |i| matches!(picture.material[i], Some(0..=3)));
    eprintln!("veach plates {width}x{height}, {samples} samples: walls {found:?}\n  plates {plates:?}");
    assert!((found.mean_ratio - 1.0).abs() < 0.015, "{found:?}");
    assert!((plates.mean_ratio - 1.0).abs() < 0.15, "{plates:?}");
    let wrong = Comparison::new(&picture, &reference.scaled(1.05), 0.03, grey);
    assert!((wrong.mean_ratio - 1.0).abs() > 0.015, "control: {wrong:?}");
}
