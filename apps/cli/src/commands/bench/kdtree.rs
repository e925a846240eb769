//! `vastlight bench kdtree SCENE`.

use super::build_error;
use crate::arguments::{Common, SceneArguments};
use crate::exit::Exit;
use clap::Args;
use rayon::prelude::*;
use serde_json::json;
use std::time::Instant;
use vastlight::gpu::Executor;
use vastlight::gpu::path::DeviceRenderer;
use vastlight::scene::Scene;
use vastlight::trace::{Tracer, TracerConfig};
use vastlight::transport::{
    Integrator, Lights, MaterialTable, PixelFilter, RenderSettings, RenderStats, Renderer, Sample, Tile,
};
use vastlight::{CameraChoice, Error, paths_in_flight};

/// Render with the stream tracer over threaded kd-trees, over the same trees with a stack, and over the default
/// structure; on gpu over threaded kd-trees alone
#[derive(Args, Debug)]
pub(crate) struct Kdtree {
    #[command(flatten)]
    scene: SceneArguments,
    /// Longest way in segments
    #[arg(long, value_name = "N", default_value_t = 6)]
    max_depth: u32,
    /// Edges of the square pictures
    #[arg(long, value_name = "N,N", value_delimiter = ',', default_values_t = [256, 512], value_parser = clap::value_parser!(u32).range(1..=1 << 14))]
    resolution: Vec<u32>,
    /// Times each picture is rendered; the best counts
    #[arg(long, value_name = "N", default_value_t = 3)]
    repeat: u32,
}

/// Kernel, cuts, name of the structure.
const KERNELS: [(&str, &str, &str); 5] = [
    ("threaded", "median", "kd-threaded"),
    ("stack", "median", "kd-stack"),
    ("threaded", "sah", "kd-threaded-sah"),
    ("stack", "sah", "kd-stack-sah"),
    ("bvh", "", ""),
];

/// Edge of the tiles that threads take.
const TILE: u32 = 64;

pub(crate) fn run(arguments: &Kdtree, common: &Common) -> Result<Exit, Error> {
    let scene = arguments.scene.load(common)?;
    let materials = MaterialTable::new(&scene);
    let lights = Lights::new(&scene, &materials);
    let mut executor = common.device.adapter().map(|choice| common.executor(choice)).transpose()?;
    for (kernel, cuts, accel) in KERNELS {
        if executor.is_some() && kernel != "threaded" {
            continue;
        }
        let config = TracerConfig { accel: accel.into(), ..TracerConfig::default() };
        let tracer = Tracer::new(&scene, &config).map_err(|e| build_error(&e))?;
        for &resolution in &arguments.resolution {
            let settings = settings(&scene, resolution, arguments.max_depth)?;
            let renderer = Renderer::new(&scene, &tracer, &materials, &lights, settings);
            let frame = match &mut executor {
                Some(executor) => Frame::best_on_device(executor, &renderer, arguments.repeat)?,
                None => Frame::best(arguments.repeat, || Ok(Frame::render(&renderer)))?,
            };
            let report = tracer.report();
            let rays = frame.stats.rays + frame.stats.shadow_rays;
            let adapter = executor.as_ref().map(|executor| executor.adapter().name.as_str());
            let line = json!({
                "bench": "kdtree",
                "device": if adapter.is_some() { "gpu" } else { "cpu" },
                "adapter": adapter,
                "kernel": kernel,
                "cuts": cuts,
                "accel": report.accel,
                "kernels": if tracer.has_stream_kernels() { "apart" } else { "joined" },
                "resolution": resolution,
                "frame_ms": frame.ms,
                "build_ms": report.build_ms,
                "rays": rays,
                "mrays_per_s": rays as f64 / frame.ms / 1e3,
                "triangles": report.triangles,
                "references": report.references,
                "bytes_per_triangle": report.bytes as f64 / report.triangles.max(1) as f64,
                "threads": rayon::current_num_threads(),
                "simd": tracer.level().name(),
                "picture": format!("{:016x}", frame.picture),
            });
            println!("{line}");
        }
    }
    Ok(Exit::Done)
}

/// One sample in the middle of each pixel of a square picture.
fn settings(scene: &Scene, resolution: u32, max_depth: u32) -> Result<RenderSettings, Error> {
    let camera = CameraChoice::default().resolve(scene)?;
    Ok(RenderSettings {
        integrator: Integrator::Whitted,
        filter: PixelFilter::Box,
        max_depth,
        ..RenderSettings::new(camera, resolution, resolution)
    })
}

/// A picture, rendered and forgotten.
#[derive(Clone, Copy, Debug, Default)]
struct Frame {
    ms: f64,
    stats: RenderStats,
    /// A hash of the picture's bits.
    picture: u64,
}

impl Frame {
    /// The fastest of some, at least one.
    fn best(repeat: u32, mut render: impl FnMut() -> Result<Self, Error>) -> Result<Self, Error> {
        let mut best = render()?;
        for _ in 1..repeat {
            let frame = render()?;
            if frame.ms < best.ms {
                best = frame;
            }
        }
        Ok(best)
    }

    /// The fastest of some on a graphics processor, after one that compiles kernels.
    fn best_on_device(executor: &mut Executor, renderer: &Renderer<'_>, repeat: u32) -> Result<Self, Error> {
        let capacity = paths_in_flight(executor);
        let mut device = DeviceRenderer::new(executor, renderer, capacity)?;
        let mut render = || {
            let start = Instant::now();
            let (mut bits, tile) = (0, renderer.settings().region());
            let stats = device.render_tile(tile, 0..1, &mut hashing(&mut bits))?;
            Ok(Self { ms: start.elapsed().as_secs_f64() * 1e3, stats, picture: bits })
        };
        render()?;
        Self::best(repeat, render)
    }

    /// Renders with the threads of the current pool.
    fn render(renderer: &Renderer<'_>) -> Self {
        let start = Instant::now();
        let tiles = renderer.settings().region().split(TILE);
        let done: Vec<(RenderStats, u64)> =
            tiles.into_par_iter().with_max_len(1).map(|tile| render_tile(renderer, tile)).collect();
        let ms = start.elapsed().as_secs_f64() * 1e3;
        let mut frame = Self { ms, ..Self::default() };
        for (stats, bits) in done {
            frame.stats += stats;
            frame.picture = mix(frame.picture, bits);
        }
        frame
    }
}

fn render_tile(renderer: &Renderer<'_>, tile: Tile) -> (RenderStats, u64) {
    let mut bits = 0;
    let stats = renderer.render_tile(tile, 0..1, &mut hashing(&mut bits)).unwrap_or_default();
    (stats, bits)
}

/// Takes samples and hashes their bits.
fn hashing(bits: &mut u64) -> impl FnMut([u32; 2], &Sample) {
    |_, sample| {
        *bits = sample.radiance.to_array().iter().fold(*bits, |bits, x| mix(bits, u64::from(x.to_bits())));
    }
}

/// Hashes one word more.
fn mix(bits: u64, word: u64) -> u64 {
    vastlight::math::rng::hash_u64(bits.rotate_left(23) ^ word)
}
