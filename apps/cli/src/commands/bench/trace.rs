//! `vastlight bench trace SCENE --rays FILE`.

use super::{Structure, build_error};
use crate::arguments::{Common, SceneArguments};
use crate::exit::Exit;
use clap::{Args, ValueEnum};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::Duration;
use vastlight::gpu::trace::DeviceTracer;
use vastlight::gpu::{self, DeviceChoice};
use vastlight::math::Ray;
use vastlight::scene::Scene;
use vastlight::simd::Level;
use vastlight::trace::bench::{self, TraceFigures};
use vastlight::trace::sort::SortRays;
use vastlight::trace::{Layout, Tracer, TracerConfig};
use vastlight::{Error, peak_rss_bytes};

/// Trace the rays of a file: closest hits, or occlusion
#[derive(Args, Debug)]
pub(crate) struct Trace {
    #[command(flatten)]
    scene: SceneArguments,
    /// Rays, eight little-endian f32 each: ox oy oz tmin dx dy dz tmax
    #[arg(long, value_name = "FILE")]
    rays: PathBuf,
    /// Ask whether anything is hit, not what
    #[arg(long)]
    occluded: bool,
    #[command(flatten)]
    structure: Structure,
    /// Whether rays that go the same way share their walk
    #[arg(long, value_name = "on|off", default_value = "on")]
    batch: Batch,
    /// Whether rays are sorted before they are traced; `both` prints a line for each way
    #[arg(long, value_name = "auto|on|off|both", default_value = "auto")]
    sort_rays: Sort,
    /// Instructions of the processor [default: the widest that it has]
    #[arg(long, value_name = "NAME", value_parser = Level::available().iter().map(|level| level.name()).collect::<Vec<_>>())]
    simd: Option<String>,
    /// Times the rays are traced; the best counts
    #[arg(long, value_name = "N", default_value_t = 3)]
    repeat: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Batch {
    On,
    Off,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Sort {
    Auto,
    On,
    Off,
    Both,
}

impl Sort {
    /// The ways to trace, a line each.
    fn ways(self) -> &'static [SortRays] {
        match self {
            Self::Auto => &[SortRays::Auto],
            Self::On => &[SortRays::On],
            Self::Off => &[SortRays::Off],
            Self::Both => &[SortRays::Off, SortRays::On],
        }
    }
}

pub(crate) fn run(arguments: &Trace, common: &Common) -> Result<Exit, Error> {
    let rays = read_rays(&arguments.rays)?;
    let scene = arguments.scene.load(common)?;
    if let Some(choice) = common.device.adapter() {
        return on_gpu(arguments, common, choice, (&scene, &rays));
    }
    let config = TracerConfig {
        single_rays: arguments.batch == Batch::Off,
        level: arguments.simd.as_deref().and_then(Level::from_name),
        ..arguments.structure.config()
    };
    let tracer = Tracer::new(&scene, &config).map_err(|e| build_error(&e))?;
    for &way in arguments.sort_rays.ways() {
        let figures = bench::trace(&tracer, &rays, arguments.occluded, way, arguments.repeat);
        print_line(arguments, &figures);
    }
    Ok(Exit::Done)
}

/// The same on a graphics processor, in the layout `compact`.
fn on_gpu(
    arguments: &Trace,
    common: &Common,
    choice: DeviceChoice,
    (scene, rays): (&Scene, &[Ray]),
) -> Result<Exit, Error> {
    let config = TracerConfig { layout: Layout::Compact, ..arguments.structure.config() };
    let tracer = Tracer::new(scene, &config).map_err(|e| build_error(&e))?;
    let words = tracer.words().map_err(|e| build_error(&e))?;
    let mut executor = common.executor(choice)?;
    let on_device = DeviceTracer::new(&mut executor, &words)?;
    let bytes = executor.held_bytes();
    let figures = gpu::bench::trace(&mut executor, &on_device, rays, arguments.occluded, arguments.repeat)?;
    let line = json!({
        "bench": "trace",
        "device": "gpu",
        "adapter": executor.adapter().name,
        "accel": tracer.report().accel,
        "layout": Layout::Compact.name(),
        "occluded": arguments.occluded,
        "triangles": tracer.report().triangles,
        "build_ms": tracer.report().build_ms,
        "bytes_per_triangle": bytes as f64 / tracer.report().triangles.max(1) as f64,
        "rays": rays.len(),
        "mrays_per_s": rays.len() as f64 / figures.ms.max(1e-6) / 1e3,
        "trace_ms": figures.ms,
        "compile_ms": figures.compile_ms,
        "dispatches": figures.dispatches,
        "hits": figures.hits,
        "sum_t": figures.sum_t,
        "peak_rss_bytes": peak_rss_bytes(),
    });
    println!("{line}");
    Ok(Exit::Done)
}

fn print_line(arguments: &Trace, figures: &TraceFigures) {
    let milliseconds = |time: Duration| time.as_secs_f64() * 1e3;
    let line = json!({
        "bench": "trace",
        "device": "cpu",
        "accel": figures.accel,
        "optimize": arguments.structure.optimize,
        "layout": arguments.structure.layout,
        "occluded": arguments.occluded,
        "batch": arguments.batch == Batch::On,
        "sorted": figures.sort.sorted,
        "simd": figures.level,
        "threads": rayon::current_num_threads(),
        "triangles": figures.triangles,
        "build_ms": figures.build_ms,
        "bytes_per_triangle": figures.bytes_per_triangle,
        "number_bytes_per_triangle": figures.number_bytes_per_triangle,
        "rays": figures.rays,
        "mrays_per_s": figures.mrays_per_s,
        "mrays_per_cpu_s": figures.mrays_per_cpu_s,
        "sort_ms": milliseconds(figures.sort.sorting),
        "trace_ms": milliseconds(figures.sort.tracing),
        "hits": figures.hits,
        "sum_t": figures.sum_t,
        "peak_rss_bytes": peak_rss_bytes(),
    });
    println!("{line}");
}

fn read_rays(path: &Path) -> Result<Vec<Ray>, Error> {
    let place = path.display().to_string();
    let bytes = std::fs::read(path).map_err(|e| Error::scene(e.to_string(), &place, ""))?;
    bench::parse_rays(&bytes).map_err(|e| Error::scene(e.to_string(), &place, ""))
}
