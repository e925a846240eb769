//! A marble head on a plinth, of any number of triangles.
//!
//! The head is an implicit surface: ellipsoids and capsules joined by smooth unions and carvings (Quilez' polynomial
//! smooth minimum). It is star-shaped around a vertical axis, so a coarse chart of radii over height and angle is
//! found once by marching, and every vertex of any resolution is a smooth look-up in that chart plus the chisel's
//! marks. Memory is the mesh.

mod chart;
mod form;

use super::palette::{srgb, stone};
use super::{GenerateOptions, builder::Builder, shape::Assembly, solids, textures};
use crate::{Camera, ColorInput, Encoding, Environment, Material, Mesh, Part, Projection, SceneDesc};
use chart::Chart;
use rayon::prelude::*;
use vastlight_math::{Affine3, Vec2, Vec3};

/// The scene.
pub(super) fn statue(options: &GenerateOptions) -> SceneDesc {
    let mut b = Builder::default();
    let marble = b.material(stone("statuary marble", srgb(0xe9e4da), 0.42));
    let seed = options.seed as u32;
    hall(&mut b, seed);
    let left = options.triangles.unwrap_or(1_000_000).saturating_sub(b.instanced_triangles());
    b.desc.meshes.push(head(left, marble, seed));
    let place = Affine3::from_translation(Vec3::new(0.0, 1.12, 0.0)) * super::shape::turn(0.42);
    b.place((b.desc.meshes.len() - 1) as u32, place);
    b.desc.cameras.push(camera());
    b.desc
}

fn camera() -> Camera {
    let (eye, target) = (Vec3::new(0.3, 1.52, 1.75), Vec3::new(0.02, 1.36, 0.0));
    let fov = 25_f32.to_radians();
    let mut camera = Camera::look_at("gallery", eye, target, fov);
    camera.projection = Projection::Perspective {
        vertical_fov: fov,
        lens_radius: 0.012,
        focus_distance: (target - eye).length() - 0.2,
    };
    camera
}

/// Rows and columns of the head's grid: 2 * columns * (rows - 1) triangles with both poles.
pub(super) fn rows_and_columns(triangles: u64) -> (u32, u32) {
    let rows = ((triangles as f64 * 0.55).sqrt().round() as u64).max(3);
    let columns = ((triangles + rows - 1) / (2 * (rows - 1))).max(3);
    (rows as u32, columns as u32)
}

/// The head: rings from top to bottom, closed by a vertex at each end.
pub(super) fn head(triangles: u64, material: u32, seed: u32) -> Mesh {
    let chart = Chart::shared();
    let (rows, columns) = rows_and_columns(triangles);
    let rings = rows as usize - 1;
    let count = rings * columns as usize + 2;
    let mut mesh = Mesh {
        name: "statue".into(),
        positions: vec![Vec3::ZERO; count],
        normals: vec![Vec3::Y; count],
        triangles: vec![[0; 3]; 2 * columns as usize * rings],
        parts: vec![Part { first_triangle: 0, material }],
        ..Mesh::default()
    };
    let width = columns as usize;
    let inner = mesh.positions[1..count - 1].par_chunks_mut(width);
    let inner = inner.zip(mesh.normals[1..count - 1].par_chunks_mut(width)).enumerate();
    inner.for_each(|(ring, (positions, normals))| {
        for i in 0..width {
            let at = Vec2::new(i as f32 / columns as f32, (ring + 1) as f32 / rows as f32);
            (positions[i], normals[i]) = chart.vertex(at, seed);
        }
    });
    mesh.positions[0] = chart.pole(0.0);
    mesh.positions[count - 1] = chart.pole(1.0);
    mesh.normals[count - 1] = Vec3::NEG_Y;
    fill_triangles(&mut mesh.triangles, rings, columns);
    mesh
}

fn fill_triangles(triangles: &mut [[u32; 3]], rings: usize, columns: u32) {
    let width = columns as usize;
    let last = (rings * width + 1) as u32;
    let ring_vertex = |ring: usize, i: u32| 1 + ring as u32 * columns + i % columns;
    let (caps, body) = triangles.split_at_mut(2 * width);
    for i in 0..columns {
        caps[i as usize] = [0, ring_vertex(0, i), ring_vertex(0, i + 1)];
        caps[width + i as usize] = [last, ring_vertex(rings - 1, i + 1), ring_vertex(rings - 1, i)];
    }
    body.par_chunks_mut(2 * width).enumerate().for_each(|(ring, row)| {
        for (i, pair) in (0..columns).zip(row.chunks_exact_mut(2)) {
            let (a, b) = (ring_vertex(ring, i), ring_vertex(ring + 1, i));
            let (c, d) = (ring_vertex(ring + 1, i + 1), ring_vertex(ring, i + 1));
            pair[0] = [a, b, c];
            pair[1] = [a, c, d];
        }
    });
}

/// What plinths are made of.
pub(super) fn dark_marble(b: &mut Builder, seed: u32) -> u32 {
    let dark = textures::marble("dark marble", srgb(0x2c3330), srgb(0x8d9a92), seed ^ 21);
    let dark = b.texture(dark, Encoding::Srgb, Vec2::splat(0.9));
    b.material(Material {
        base_color: ColorInput { factor: Vec3::ONE, texture: Some(dark) },
        ..stone("dark marble", Vec3::ONE, 0.18)
    })
}

/// Plinth, floor, back wall, a soft skylight and a small spot.
fn hall(b: &mut Builder, seed: u32) {
    let dark = dark_marble(b, seed);
    let mut plinth = Assembly::default();
    plinth.add(dark, &solids::beveled_box(Vec3::new(0.46, 0.98, 0.46), 0.008).at(0.0, 0.55, 0.0));
    plinth.add(dark, &solids::beveled_box(Vec3::new(0.54, 0.06, 0.54), 0.012).at(0.0, 0.03, 0.0));
    plinth.add(dark, &solids::beveled_box(Vec3::new(0.50, 0.08, 0.50), 0.02).at(0.0, 1.08, 0.0));
    b.assembled("plinth", plinth);
    let oak = textures::planks("floor boards", srgb(0x9a7650), srgb(0x6d4d30), 6, seed ^ 22);
    let oak = b.texture(oak, Encoding::Srgb, Vec2::new(2.4, 0.9));
    let oak = b.material(Material {
        base_color: ColorInput { factor: Vec3::ONE, texture: Some(oak) },
        ..stone("floor boards", Vec3::ONE, 0.3)
    });
    b.object("floor", oak, &solids::floor(9.0, 9.0));
    let wall = b.material(stone("wall", srgb(0x5b2f2b), 0.9));
    let back = solids::cuboid(Vec3::new(9.0, 5.0, 0.2)).at(0.0, 2.5, -2.4);
    b.object("wall", wall, &back);
    let rail = solids::beveled_box(Vec3::new(9.0, 0.16, 0.05), 0.012).at(0.0, 0.08, -2.28);
    let white = b.material(stone("skirting", srgb(0xe6e0d4), 0.5));
    b.object("skirting", white, &rail);
    let key = b.material(crate::Material::emitter("skylight", Vec3::new(1.0, 0.95, 0.88) * 44.0, false));
    let lamp = super::caustic_sphere::square_lamp(Vec3::new(-1.9, 3.3, 1.2), Vec3::new(0.0, 1.4, 0.0), 1.0);
    b.object("skylight", key, &lamp);
    let rim = b.material(crate::Material::emitter("rim light", Vec3::new(1.0, 0.78, 0.55) * 44.0, false));
    let lamp = super::caustic_sphere::square_lamp(Vec3::new(1.9, 2.5, -1.5), Vec3::new(0.0, 1.5, 0.0), 0.5);
    b.object("rim light", rim, &lamp);
    b.desc.environment = Some(Environment::Constant(Vec3::new(0.055, 0.06, 0.07)));
}
