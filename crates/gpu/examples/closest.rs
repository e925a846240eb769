//! Rays a second on a device over a bumpy sheet of a million triangles:
//! `cargo run --release -p vastlight-gpu --example closest -- [ADAPTER]`.

use std::time::Instant;
use vastlight_gpu::trace::{DeviceTracer, hits_of_words, ray_words, record_closest};
use vastlight_gpu::{DeviceChoice, Executor, Recording};
use vastlight_math::{Affine3, FAR, Ray, Vec3};
use vastlight_scene::{Instance, Mesh, Scene, SceneDesc};
use vastlight_trace::{Layout, Tracer, TracerConfig};

/// Vertices along an edge of the sheet.
const SIDE: usize = 708;
/// Rays along an edge of the picture.
const PICTURE: usize = 512;
/// Runs of each batch; the best counts.
const REPEATS: u32 = 3;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let adapter = std::env::args().nth(1).and_then(|text| text.parse().ok());
    let choice = adapter.map_or(DeviceChoice::Any, DeviceChoice::Index);
    let mut executor = Executor::open(choice, None)?;
    let scene = Scene::new(sheet())?;
    let config = TracerConfig { layout: Layout::Compact, ..TracerConfig::default() };
    let tracer = DeviceTracer::new(&mut executor, &Tracer::new(&scene, &config)?.words()?)?;
    let triangles = scene.meshes()[0].triangles.len();
    let bytes = executor.held_bytes();
    show(format!("{}, {triangles} triangles, {bytes} bytes", executor.adapter().name));
    for (name, ray) in [("picture", picture_ray as fn(usize) -> _), ("random", random_ray)] {
        let rays: Vec<Ray> = (0..PICTURE * PICTURE).map(ray).collect();
        measure(&mut executor, &tracer, name, &rays)?;
    }
    Ok(())
}

/// Runs of the kernel alone: the rays are brought and the hits fetched once, outside of the time.
fn measure(
    executor: &mut Executor,
    tracer: &DeviceTracer,
    name: &str,
    rays: &[Ray],
) -> Result<(), Box<dyn std::error::Error>> {
    let words: Vec<[f32; 8]> = rays.iter().map(ray_words).collect();
    let (count, room) = (rays.len() as u32, executor.keep("rays", &words)?);

    let mut recording = Recording::new();
    let input = recording.resident("rays", room);
    let hits = record_closest(&mut recording, tracer, input, count)?;
    let mut times = Vec::new();
    for _ in 0..REPEATS {
        let start = Instant::now();
        executor.run(&recording)?;
        times.push(start.elapsed().as_secs_f64());
    }
    let download = recording.download(hits, 5 * u64::from(count));
    let hits = hits_of_words(&executor.run(&recording)?.words(download));
    let best = times.iter().copied().fold(f64::INFINITY, f64::min);
    let met = hits.iter().filter(|hit| hit.is_hit()).count();
    let rate = rays.len() as f64 / best / 1e6;
    show(format!("{name}: {rate:.3} Mrays/s, {met} hits of {count}, first {:.0} ms", times[0] * 1e3));
    executor.release(room);
    Ok(())
}

/// Numbers in [0, 1).
fn noise(i: usize, salt: u64) -> f32 {
    let mut x = (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ salt.wrapping_mul(0xd134_2543_de82_ef95);
    x = (x ^ x >> 31).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    (x >> 40) as f32 / 16_777_216.0
}

/// From -1 to 1 along x and z, up to an eighth high, on a lattice.
fn sheet() -> SceneDesc {
    let at = |i: usize| (i as f32 - SIDE as f32 / 2.0) / 512.0;
    let height = |i: usize| {
        let (x, z) = (i % SIDE / 24, i / SIDE / 24);
        ((noise(z * SIDE + x, 1) * 48.0).floor() + (noise(i, 2) * 4.0).floor()) / 512.0
    };
    let quad = |i: usize| {
        let a = (i / (SIDE - 1) * SIDE + i % (SIDE - 1)) as u32;
        let (b, c) = (a + 1, a + SIDE as u32);
        [[a, b, c], [b, c + 1, c]]
    };
    let positions = (0..SIDE * SIDE).map(|i| Vec3::new(at(i % SIDE), height(i), at(i / SIDE))).collect();
    let triangles = (0..(SIDE - 1) * (SIDE - 1)).flat_map(quad).collect();
    let meshes = vec![Mesh { positions, triangles, ..Mesh::default() }];
    let instances = vec![Instance { world_from_object: Affine3::IDENTITY, mesh: 0, name: 0 }];
    SceneDesc { meshes, instances, names: vec![String::new()], ..SceneDesc::default() }
}

/// Rays of a picture from above, row by row.
fn picture_ray(i: usize) -> Ray {
    let place = |i: usize| i as f32 / PICTURE as f32 - 0.5;
    ray(Vec3::new(0.0, 1.2, 0.9), Vec3::new(place(i % PICTURE), -1.0, place(i / PICTURE) - 0.7))
}

/// Rays from anywhere above the sheet into any direction.
fn random_ray(i: usize) -> Ray {
    let point = |salt| Vec3::new(noise(i, salt), noise(i, salt + 1), noise(i, salt + 2)) * 2.0 - 1.0;
    ray(point(3) * Vec3::new(0.6, 0.1, 0.6) + Vec3::Y * 0.2, point(6))
}

fn ray(origin: Vec3, direction: Vec3) -> Ray {
    Ray { origin, t_min: 0.0, direction, t_max: FAR, time: 0.0 }
}

#[expect(clippy::print_stdout, reason = "an example's result")]
fn show(line: String) {
    println!("{line}");
}
