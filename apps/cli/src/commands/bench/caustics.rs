//! `vastlight bench caustics`.

use super::build_error;
use crate::arguments::Common;
use crate::exit::Exit;
use crate::values::{self, Resolution};
use clap::Args;
use rayon::prelude::*;
use serde_json::json;
use std::time::Instant;
use vastlight::gpu::Executor;
use vastlight::gpu::path::DeviceRenderer;
use vastlight::math::{Affine3, Vec3};
use vastlight::scene::generate::GenerateOptions;
use vastlight::scene::{Light, LightKind, Scene, SceneDesc, generate};
use vastlight::trace::{Tracer, TracerConfig};
use vastlight::transport::photon::{Photon, PhotonMaps, PhotonPlan, PhotonSettings, SearchKind, bench};
use vastlight::transport::{
    Integrator, Lights, MaterialTable, PixelFilter, RenderSettings, Renderer, Sample, Tile,
};
use vastlight::{CameraChoice, Error, paths_in_flight};

/// Photon-map caustics as published: four passes a frame over metaballs that move, under a point light; on gpu, where no implicit
/// surface is, over a glass ball, by voxels
#[derive(Args, Debug)]
pub(crate) struct Caustics {
    /// Demo scene, lit by a point where its lamp hangs [default: metaballs; on gpu caustic-sphere]
    #[arg(long, value_name = "NAME")]
    demo: Option<String>,
    /// Size of the picture
    #[arg(short, long, value_name = "SIZE", default_value = "1920x1080", value_parser = values::resolution)]
    resolution: Resolution,
    /// Edges of the square grids of photons
    #[arg(long, value_name = "N,N", value_delimiter = ',', default_values_t = [128, 256, 512, 1024], value_parser = clap::value_parser!(u32).range(1..=4096))]
    grids: Vec<u32>,
    /// Search structures; brute for at most 4,096 photons
    #[arg(long, value_name = "NAME,NAME", value_delimiter = ',', default_value = "lexicographic,voxel,planar,rows", value_parser = values::photon_search)]
    search: Vec<SearchKind>,
    /// Radius of gathering, as a part of the scene's longest edge
    #[arg(long, value_name = "PART", default_value_t = 0.004, value_parser = values::positive)]
    radius: f32,
    /// Longest way in segments
    #[arg(long, value_name = "N", default_value_t = 5)]
    max_depth: u32,
    /// Frames, 1/24 s from one to the next
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    frames: u32,
}

/// Photons at most where every photon is looked at.
const MOST_BRUTE: u32 = 4096;
/// Edge of the tiles that threads take.
const TILE: u32 = 64;

pub(crate) fn run(arguments: &Caustics, common: &Common) -> Result<Exit, Error> {
    let mut executor = common.device.adapter().map(|choice| common.executor(choice)).transpose()?;
    let usual = if executor.is_some() { "caustic-sphere" } else { "metaballs" };
    let demo = arguments.demo.as_deref().unwrap_or(usual);
    let frames: Vec<Scene> = (0..arguments.frames).map(|i| scene(demo, i)).collect::<Result<_, _>>()?;
    for &edge in &arguments.grids {
        for &search in &arguments.search {
            let by_device = executor.is_some() && search != SearchKind::Voxel;
            if by_device || search == SearchKind::Brute && edge * edge > MOST_BRUTE {
                continue;
            }
            let times = frames.iter().map(|scene| match &mut executor {
                None => frame(arguments, scene, edge, search),
                Some(executor) => frame_on_device(executor, arguments, scene, edge),
            });
            let times: Vec<Times> = times.collect::<Result<_, _>>()?;
            // The first frame finds cold caches.
            let counted = if times.len() > 1 { &times[1..] } else { &times };
            let mean = |part: fn(&Times) -> f64| counted.iter().map(part).sum::<f64>() / counted.len() as f64;
            let frame_ms = mean(Times::frame_ms);
            let line = json!({
                "bench": "caustics",
                "device": if executor.is_some() { "gpu" } else { "cpu" },
                "adapter": executor.as_ref().map(|executor| executor.adapter().name.as_str()),
                "scene": demo,
                "search": search.name(),
                "photons": edge * edge,
                "landed": counted.last().map(|times| times.landed),
                "build_ms": mean(|times| times.build_ms),
                "trace_ms": mean(|times| times.trace_ms),
                "sort_index_ms": mean(|times| times.sort_index_ms),
                "gather_ms": counted.last().and_then(|times| times.gather_ms),
                "render_ms": mean(|times| times.render_ms),
                "frame_ms": frame_ms,
                "frames_per_s": 1e3 / frame_ms,
                "map_bytes": counted.last().and_then(|times| times.map_bytes),
                "mean_radiance": counted.last().map(|times| times.mean),
                "radius": arguments.radius,
                "threads": rayon::current_num_threads(),
            });
            println!("{line}");
        }
    }
    Ok(Exit::Done)
}

/// A frame of a demo, lit by a point where its lamp hangs.
fn scene(demo: &str, frame: u32) -> Result<Scene, Error> {
    let moves = generate::moves(demo);
    let time = if moves { frame as f32 / 24.0 } else { 0.0 };
    let mut desc = generate::by_name(demo, &GenerateOptions { time, ..GenerateOptions::default() })?;
    let lamp = darken(&mut desc);
    desc.environment = None;
    desc.lights.push(Light {
        name: "point".to_owned(),
        kind: LightKind::Point,
        world_from_light: Affine3::from_translation(lamp),
        intensity: Vec3::splat(60.0),
        range: f32::INFINITY,
        profile: None,
    });
    Ok(Scene::new(desc)?)
}

/// Puts out the lamps of a scene. Gives a place below them.
fn darken(desc: &mut SceneDesc) -> Vec3 {
    let mut place = Vec3::ZERO;
    for instance in &desc.instances {
        let mesh = &desc.meshes[instance.mesh as usize];
        let material = mesh.parts.first().map_or(0, |part| part.material);
        if desc.materials[material as usize].is_emissive() {
            place = mesh.bounds().transformed(&instance.world_from_object).center() - Vec3::Y * 0.05;
        }
    }
    for material in &mut desc.materials {
        material.emission.factor = Vec3::ZERO;
    }
    place
}

/// What the passes of a frame took.
struct Times {
    landed: usize,
    build_ms: f64,
    trace_ms: f64,
    sort_index_ms: f64,
    /// Of `render_ms`, measured apart at the places that the camera sees; not on graphics processors.
    gather_ms: Option<f64>,
    render_ms: f64,
    map_bytes: Option<usize>,
    mean: f64,
}

impl Times {
    /// All but the scene's own structures and the gathering that was measured apart.
    fn frame_ms(&self) -> f64 {
        self.trace_ms + self.sort_index_ms + self.render_ms
    }
}

fn frame(arguments: &Caustics, scene: &Scene, edge: u32, search: SearchKind) -> Result<Times, Error> {
    let (build_ms, tracer) = timed(|| Tracer::new(scene, &TracerConfig::default()));
    let tracer = tracer.map_err(|e| build_error(&e))?;
    let materials = MaterialTable::new(scene);
    let lights = Lights::new(scene, &materials);
    let renderer =
        Renderer::new(scene, &tracer, &materials, &lights, settings(arguments, scene, edge, search)?);
    let Some(plan) = renderer.photon_plan()? else {
        return Err(Error::usage("the renderer sends no photons", "bench caustics", ""));
    };
    let (trace_ms, photons) = timed(|| renderer.photons(&plan, 0));
    let photons = photons?.0;
    let (sort_index_ms, maps) = timed(|| plan.maps(&photons, 0));
    let (render_ms, (places, sum)) = timed(|| picture(&renderer, &maps));
    let (gather_ms, map_bytes) = gather(&plan, &photons, &places);
    let mean = sum / renderer.settings().region().pixels() as f64;
    let landed = photons.len();
    Ok(Times { landed, build_ms, trace_ms, sort_index_ms, gather_ms, render_ms, map_bytes, mean })
}

/// The same on a graphics processor; gathering is not measured apart.
fn frame_on_device(
    executor: &mut Executor,
    arguments: &Caustics,
    scene: &Scene,
    edge: u32,
) -> Result<Times, Error> {
    let config = TracerConfig { accel: "kd-threaded".into(), ..TracerConfig::default() };
    let (build_ms, tracer) = timed(|| Tracer::new(scene, &config));
    let tracer = tracer.map_err(|e| build_error(&e))?;
    let materials = MaterialTable::new(scene);
    let lights = Lights::new(scene, &materials);
    let settings = settings(arguments, scene, edge, SearchKind::Voxel)?;
    let renderer = Renderer::new(scene, &tracer, &materials, &lights, settings);
    let Some(plan) = renderer.photon_plan()? else {
        return Err(Error::usage("the renderer sends no photons", "bench caustics", ""));
    };
    let capacity = paths_in_flight(executor);
    let mut device = DeviceRenderer::new(executor, &renderer, capacity)?;
    // Kernels are compiled by a first pass.
    device.send_photons(&plan, 0)?;
    let pass = device.send_photons(&plan, 0)?;
    let (region, mut sum) = (renderer.settings().region(), 0.0);
    let mut sink = |_: [u32; 2], sample: &Sample| sum += f64::from(sample.radiance.element_sum()) / 3.0;
    let corner = Tile { min: region.min, max: [region.min[0] + 1, region.min[1] + 1] };
    device.render_tile(corner, 0..1, &mut |_: [u32; 2], _: &Sample| ())?;
    let (render_ms, rendered) = timed(|| device.render_tile(region, 0..1, &mut sink));
    rendered?;
    Ok(Times {
        landed: pass.landed as usize,
        build_ms,
        trace_ms: pass.trace_ms,
        sort_index_ms: pass.index_ms,
        gather_ms: None,
        render_ms,
        map_bytes: None,
        mean: sum / region.pixels() as f64,
    })
}

/// One sample in the middle of each pixel.
fn settings(
    arguments: &Caustics,
    scene: &Scene,
    edge: u32,
    search: SearchKind,
) -> Result<RenderSettings, Error> {
    let camera = CameraChoice::default().resolve(scene)?;
    let (width, height) = arguments.resolution.size(camera.aspect);
    let caustics = PhotonSettings {
        grid: Some([edge; 2]),
        radius: Some(arguments.radius),
        search,
        ..PhotonSettings::default()
    };
    Ok(RenderSettings {
        integrator: Integrator::PhotonCaustics,
        filter: PixelFilter::Box,
        max_depth: arguments.max_depth,
        caustics: Some(caustics),
        ..RenderSettings::new(camera, width, height)
    })
}

/// Renders a picture with all threads. Gives the places that it shows, and the sum of its radiance.
fn picture(renderer: &Renderer<'_>, maps: &PhotonMaps) -> (Vec<Vec3>, f64) {
    let tile = |tile: Tile| {
        let (mut places, mut sum) = (Vec::new(), 0.0);
        let mut sink = |_: [u32; 2], sample: &Sample| {
            sum += f64::from(sample.radiance.element_sum()) / 3.0;
            if sample.coverage > 0.0 {
                places.push(sample.position);
            }
        };
        // The scene is in memory: nothing can be missing.
        let _ = renderer.render_tile_under(Some(maps), tile, 0..1, &mut sink);
        (places, sum)
    };
    let tiles = renderer.settings().region().split(TILE);
    let done: Vec<(Vec<Vec3>, f64)> = tiles.into_par_iter().with_max_len(1).map(tile).collect();
    let sum = done.iter().map(|(_, sum)| sum).sum();
    (done.into_iter().flat_map(|(places, _)| places).collect(), sum)
}

/// Gathering alone: its time, and the bytes of the map.
fn gather(plan: &PhotonPlan, photons: &[Photon], places: &[Vec3]) -> (Option<f64>, Option<usize>) {
    let figures = bench::search(photons, plan.search(), plan.widest_radius(), places, 1);
    (Some(figures.gather_ms), Some(figures.bytes))
}

fn timed<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let start = Instant::now();
    let result = work();
    (start.elapsed().as_secs_f64() * 1e3, result)
}
