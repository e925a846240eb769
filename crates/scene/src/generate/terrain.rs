//! Mountains of any number of triangles: ridged noise worn by its own slope, coloured by height and steepness.
//!
//! The surface is a function of the place alone, so that every row of the grid is made by itself: memory is the mesh.

use super::noise::{fbm, noise, ridged, smoothstep};
use super::palette::{srgb, stone};
use super::{GenerateOptions, builder::Builder};
use crate::{Camera, Environment, Mesh, Part, SceneDesc, Sky};
use rayon::prelude::*;
use vastlight_math::{Affine3, Vec2, Vec3, Vec4, real::sin_cos};

/// Edge of the square in metres.
const EDGE: f32 = 6000.0;
/// Highest summit above the valleys, about.
const HEIGHT: f32 = 1500.0;

/// The scene.
pub(super) fn terrain(options: &GenerateOptions) -> SceneDesc {
    let mut b = Builder::default();
    let ground = b.material(stone("ground", Vec3::ONE, 0.85));
    let triangles = options.triangles.unwrap_or(2_000_000);
    b.desc.meshes.push(mesh(triangles, ground, options.seed as u32));
    b.place(0, Affine3::IDENTITY);
    b.desc.environment = Some(Environment::Sky(Sky {
        sun_azimuth: 1.95,
        sun_elevation: 0.40,
        turbidity: 2.6,
        ground_albedo: Vec3::new(0.2, 0.19, 0.17),
        strength: 3.0,
        sun_disc: true,
    }));
    b.desc.cameras.push(camera(options.seed as u32));
    b.desc
}

/// Stands above a slope at the near edge and looks over the valley.
fn camera(seed: u32) -> Camera {
    let at = Vec2::new(valley_line(EDGE * 0.45) + 260.0, EDGE * 0.45);
    let eye = Vec3::new(at.x, height(at, seed, 8) + 230.0, at.y);
    Camera::look_at("overlook", eye, Vec3::new(-60.0, eye.y + 30.0, -1200.0), 36_f32.to_radians())
}

/// Cells along x and z whose product is as near to half the triangles as it gets.
fn cells(triangles: u64) -> (u32, u32) {
    let half = (triangles / 2).max(1);
    let columns = (half as f64).sqrt().round().max(1.0) as u64;
    let rows = ((half + columns / 2) / columns).max(1);
    (columns as u32, rows as u32)
}

fn mesh(triangles: u64, material: u32, seed: u32) -> Mesh {
    let (columns, rows) = cells(triangles);
    let stride = columns as usize + 1;
    let count = stride * (rows as usize + 1);
    let mut mesh = Mesh {
        name: "terrain".into(),
        positions: vec![Vec3::ZERO; count],
        normals: vec![Vec3::ZERO; count],
        colors: vec![Vec4::ZERO; count],
        triangles: vec![[0; 3]; 2 * columns as usize * rows as usize],
        parts: vec![Part { first_triangle: 0, material }],
        ..Mesh::default()
    };
    let step = EDGE / columns.max(rows) as f32;
    let octaves = octaves(step);
    let place = |i: usize, j: usize| {
        let (u, v) = (i as f32 / columns as f32 - 0.5, j as f32 / rows as f32 - 0.5);
        Vec2::new(u * EDGE, v * EDGE)
    };
    mesh.positions.par_chunks_mut(stride).enumerate().for_each(|(j, row)| {
        for (i, p) in row.iter_mut().enumerate() {
            let at = place(i, j);
            *p = Vec3::new(at.x, height(at, seed, octaves), at.y);
        }
    });
    let positions = &mesh.positions;
    let attributes = mesh.normals.par_chunks_mut(stride).zip(mesh.colors.par_chunks_mut(stride));
    attributes.enumerate().for_each(|(j, (normals, colors))| {
        let at = |i: usize, j: usize| positions[j.min(rows as usize) * stride + i.min(columns as usize)];
        for i in 0..stride {
            let along_x = at(i + 1, j) - at(i.saturating_sub(1), j);
            let along_z = at(i, j + 1) - at(i, j.saturating_sub(1));
            normals[i] = along_z.cross(along_x).normalize();
            colors[i] = color(at(i, j), normals[i], seed).extend(1.0);
        }
    });
    let rows_of_triangles = mesh.triangles.par_chunks_mut(2 * columns as usize).enumerate();
    rows_of_triangles.for_each(|(j, row)| {
        for (i, pair) in row.chunks_exact_mut(2).enumerate() {
            let a = (j * stride + i) as u32;
            let below = a + stride as u32;
            pair[0] = [a, below, below + 1];
            pair[1] = [a, below + 1, a + 1];
        }
    });
    mesh
}

/// Octaves whose features a grid of this step can show.
fn octaves(step: f32) -> u32 {
    let finest = EDGE / 3.0 / step.max(1e-3);
    (vastlight_math::real::ln(finest.max(2.0)) / std::f32::consts::LN_2).ceil().clamp(5.0, 14.0) as u32
}

/// Height above the lowest valley in metres.
fn height(at: Vec2, seed: u32, octaves: u32) -> f32 {
    let p = Vec3::new(at.x, 0.0, at.y) / 2100.0;
    let bend = Vec3::new(
        fbm(p * 1.3, 3, 0.5, seed ^ 0xa1),
        0.0,
        fbm(p * 1.3 + Vec3::splat(7.7), 3, 0.5, seed ^ 0xb2),
    );
    let p = p + bend * 0.28 + Vec3::Y * 0.37;
    let massif = massif(at) * (0.82 + 0.3 * noise(p * 0.9, seed ^ 0xc3));
    let crests = ridged(p, octaves, 0.47, seed);
    let valley = 0.06 + 0.05 * fbm(p * 3.0, 4, 0.5, seed ^ 0xd4);
    HEIGHT * (valley + massif * (crests * 1.15 - 0.08).max(0.0))
}

/// How much of a mountain stands here: a valley winds towards the viewer from a wall at its end.
fn massif(at: Vec2) -> f32 {
    let beside = (at.x - valley_line(at.y)).abs();
    let sides = smoothstep(120.0, 1750.0, beside);
    let end = smoothstep(-700.0, -2300.0, at.y);
    sides + end - sides * end
}

/// The valley's middle.
fn valley_line(z: f32) -> f32 {
    420.0 * sin_cos(z / 780.0).0
}

/// Meadow, scree, rock and snow.
fn color(p: Vec3, normal: Vec3, seed: u32) -> Vec3 {
    let patch = fbm(p / 160.0, 4, 0.55, seed ^ 0xe5);
    let h = p.y / HEIGHT + 0.07 * patch;
    let steep = 1.0 - normal.y;
    let strata = 0.5 + 0.5 * noise(Vec3::new(p.x / 900.0, p.y / 26.0, p.z / 900.0), seed ^ 0xf6);
    let rock = srgb(0x7d7064).lerp(srgb(0x544c46), strata) * (1.0 + 0.3 * patch);
    let meadow = srgb(0x5f6a35).lerp(srgb(0x8a7d48), smoothstep(-0.3, 0.4, patch));
    let scree = srgb(0x8f857a);
    let green = smoothstep(0.40, 0.20, h) * smoothstep(0.34, 0.16, steep);
    let loose = smoothstep(0.42, 0.25, steep) * smoothstep(0.2, 0.45, h);
    let snow = smoothstep(0.58, 0.74, h) * smoothstep(0.5, 0.32, steep);
    rock.lerp(scree, loose * 0.6).lerp(meadow, green).lerp(Vec3::splat(0.86), snow)
}
