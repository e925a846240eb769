//! `vastlight bench trace SCENE --rays FILE`.

use super::{Structure, build_error};
use crate::arguments::{Common, SceneArguments};
use crate::exit::Exit;
use clap::{Args, ValueEnum};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::Duration;
use vastlight::math::Ray;
use vastlight::trace::bench::{self, TraceFigures};
use vastlight::trace::sort::SortRays;
use vastlight::trace::{Tracer, TracerConfig};
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
    let config = TracerConfig { single_rays: arguments.batch == Batch::Off, ..arguments.structure.config() };
    let tracer = Tracer::new(&scene, &config).map_err(|e| build_error(&e))?;
    for &way in arguments.sort_rays.ways() {
        let figures = bench::trace(&tracer, &rays, arguments.occluded, way, arguments.repeat);
        print_line(arguments, &figures);
    }
    Ok(Exit::Done)
}

fn print_line(arguments: &Trace, figures: &TraceFigures) {
    let milliseconds = |time: Duration| time.as_secs_f64() * 1e3;
    let line = json!({
        "bench": "trace",
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
