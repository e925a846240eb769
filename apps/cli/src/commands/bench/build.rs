//! `vastlight bench build SCENE`.

use super::build_error;
use crate::arguments::{Common, SceneArguments};
use crate::exit::Exit;
use clap::Args;
use serde_json::json;
use vastlight::trace::{TracerConfig, bench};
use vastlight::{Error, peak_rss_bytes};

/// Build the acceleration structure of a scene
#[derive(Args, Debug)]
pub(crate) struct Build {
    #[command(flatten)]
    scene: SceneArguments,
    /// Acceleration structure by name
    #[arg(long, value_name = "NAME", default_value = "")]
    accel: String,
    /// Most references to triangles, as a multiple of the triangles [default: chosen by the builder]
    #[arg(long, value_name = "FACTOR")]
    split_budget: Option<f32>,
    /// Rounds of reinsertion after the build: slower to build, faster to trace
    #[arg(long, value_name = "N", default_value_t = 0)]
    optimize: u32,
    /// Times it is built; the best counts
    #[arg(long, value_name = "N", default_value_t = 3)]
    repeat: u32,
}

pub(crate) fn run(arguments: &Build, common: &Common) -> Result<Exit, Error> {
    let scene = arguments.scene.load(common)?;
    let config = TracerConfig {
        accel: arguments.accel.clone(),
        split_budget: arguments.split_budget,
        optimize: arguments.optimize,
        ..TracerConfig::default()
    };
    let figures = bench::build(&scene, &config, arguments.repeat).map_err(|e| build_error(&e))?;
    let stages: serde_json::Map<_, _> =
        figures.stages.iter().map(|(name, ms)| ((*name).to_owned(), json!(ms))).collect();
    let line = json!({
        "bench": "build",
        "accel": figures.accel,
        "optimize": arguments.optimize,
        "threads": rayon::current_num_threads(),
        "triangles": figures.triangles,
        "references": figures.references,
        "nodes": figures.nodes,
        "build_ms": figures.build_ms,
        "mtri_per_s": figures.mtri_per_s,
        "cost": figures.cost,
        "bytes": figures.bytes,
        "peak_bytes": peak_rss_bytes(),
        "stages": stages,
    });
    println!("{line}");
    Ok(Exit::Done)
}
