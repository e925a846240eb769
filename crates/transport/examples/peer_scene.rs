//! Renders a mesh on a floor under a square lamp and a constant sky: the scene in which whole renderers are compared.
//!
//!     cargo run --release -p vastlight-transport --example peer_scene -- MESH OUT.exr [SPP] [WIDTH HEIGHT] [REPEAT]
//!
//! Prints one JSON line; times are of rendering alone, by all threads. `tests/compare_mitsuba.py` compares the picture.
#![allow(clippy::print_stdout, reason = "the result is a line on stdout")]

use rayon::prelude::*;
use std::time::Instant;
use vastlight_import::LoadOptions;
use vastlight_math::{Affine3, Quat, Vec3};
use vastlight_scene::{Camera, Environment, Instance, Material, Mesh, Part, Scene, SceneDesc};
use vastlight_trace::{Tracer, TracerConfig};
use vastlight_transport::{
    Lights, MaterialTable, PixelFilter, RenderSettings, RenderStats, Renderer, Sample,
};

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [mesh, out, rest @ ..] = arguments.as_slice() else {
        return Err("usage: peer_scene MESH OUT.exr [SPP] [WIDTH HEIGHT] [REPEAT]".into());
    };
    let number = |i: usize, default: u32| rest.get(i).map_or(Ok(default), |s| s.parse::<u32>());
    let (samples, width, height, repeat) = (number(0, 16)?, number(1, 640)?, number(2, 480)?, number(3, 1)?);

    let scene = peer_scene(mesh)?;
    let tracer = Tracer::new(&scene, &TracerConfig::default())?;
    let materials = MaterialTable::new(&scene);
    let lights = Lights::new(&scene, &materials);
    let camera =
        Camera::look_at("peer", Vec3::new(1.5, 1.15, 1.9), Vec3::new(0.0, 0.38, 0.0), 40_f32.to_radians());
    let settings = RenderSettings {
        max_depth: 4,
        russian_roulette: false,
        filter: PixelFilter::Box,
        ..RenderSettings::new(camera, width, height)
    };
    let renderer = Renderer::new(&scene, &tracer, &materials, &lights, settings);
    let mut best = f64::INFINITY;
    let mut picture = Vec::new();
    let mut stats = RenderStats::default();
    for _ in 0..repeat.max(1) {
        let start = Instant::now();
        (picture, stats) = render(&renderer, samples);
        best = best.min(start.elapsed().as_secs_f64());
    }
    let mean = picture.iter().flatten().map(|&x| f64::from(x)).sum::<f64>() / (3 * picture.len()) as f64;
    let rate = f64::from(width) * f64::from(height) * f64::from(samples) / best / 1e6;
    exr::prelude::write_rgb_file(out, width as usize, height as usize, |x, y| {
        let [r, g, b] = picture[y * width as usize + x];
        (r, g, b)
    })?;
    let per_sample = |n: u64| n as f64 / stats.samples as f64;
    println!(
        "{{\"samples\":{samples},\"width\":{width},\"height\":{height},\"seconds\":{best:.4},\
         \"msamples_per_s\":{rate:.3},\"mean\":{mean},\
         \"rays_per_sample\":{:.3},\"shadow_rays_per_sample\":{:.3}}}",
        per_sample(stats.rays),
        per_sample(stats.shadow_rays),
    );
    Ok(())
}

/// Mean radiance of every pixel.
fn render(renderer: &Renderer<'_>, samples: u32) -> (Vec<[f32; 3]>, RenderStats) {
    let region = renderer.settings().region();
    let width = region.width();
    let render_tile = |tile| {
        let mut found = Vec::new();
        let mut sink = |pixel: [u32; 2], s: &Sample| found.push((pixel, s.radiance));
        let stats = renderer.render_tile(tile, 0..samples, &mut sink).expect("in memory");
        (found, stats)
    };
    let tiles: Vec<_> = region.split(16).into_par_iter().map(render_tile).collect();
    let mut sums = vec![Vec3::ZERO; region.pixels() as usize];
    let mut total = RenderStats::default();
    for (found, stats) in tiles {
        total += stats;
        for (pixel, radiance) in found {
            sums[(pixel[1] * width + pixel[0]) as usize] += radiance;
        }
    }
    (sums.into_iter().map(|s| (s / samples as f32).to_array()).collect(), total)
}

/// The floor and the lamp are squares; the mesh is grey and seen from both sides.
fn peer_scene(mesh: &str) -> Result<Scene, Failure> {
    let mut desc = vastlight_import::load(mesh.as_ref(), &LoadOptions::default())?;
    let grey = |albedo: f32| Material::diffuse("grey", Vec3::splat(albedo));
    desc.materials = vec![grey(0.6), grey(0.4), Material::emitter("lamp", Vec3::splat(8.0), false)];
    for mesh in &mut desc.meshes {
        mesh.parts = vec![Part { first_triangle: 0, material: 0 }];
        mesh.normals.clear();
    }
    let quarter = std::f32::consts::FRAC_PI_2;
    square(&mut desc, 1, 10.0, -quarter, -0.45);
    square(&mut desc, 2, 0.7, quarter, 2.6);
    desc.cameras.clear();
    desc.lights.clear();
    desc.environment = Some(Environment::Constant(Vec3::splat(0.5)));
    Ok(Scene::new(desc)?)
}

/// Adds a square of half width `half` in the plane at `height`, +z turned about the x axis by `angle`.
fn square(desc: &mut SceneDesc, material: u32, half: f32, angle: f32, height: f32) {
    let corners = [[-half, -half], [half, -half], [half, half], [-half, half]];
    desc.instances.push(Instance {
        world_from_object: Affine3::from_rotation_translation(
            Quat::from_rotation_x(angle),
            Vec3::new(0.0, height, 0.0),
        ),
        mesh: desc.meshes.len() as u32,
        name: 0,
    });
    desc.meshes.push(Mesh {
        name: "square".into(),
        positions: corners.iter().map(|c| Vec3::new(c[0], c[1], 0.0)).collect(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        parts: vec![Part { first_triangle: 0, material }],
        ..Mesh::default()
    });
}
