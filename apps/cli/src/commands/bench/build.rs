//! `vastlight bench build SCENE`.

use super::{Structure, build_error, build_gpu};
use crate::arguments::{Common, SceneArguments};
use crate::exit::Exit;
use clap::Args;
use serde_json::json;
use vastlight::trace::bench;
use vastlight::{Error, peak_rss_bytes};

/// Build the acceleration structure of a scene; on gpu, that of its largest mesh
#[derive(Args, Debug)]
pub(crate) struct Build {
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    structure: Structure,
    /// Times it is built; the best counts. It is built once more before, to measure the tree and memory
    #[arg(long, value_name = "N", default_value_t = 3)]
    repeat: u32,
}

pub(crate) fn run(arguments: &Build, common: &Common) -> Result<Exit, Error> {
    let scene = arguments.scene.load(common)?;
    if let Some(choice) = common.device.adapter() {
        return build_gpu::run(&scene, &arguments.structure, arguments.repeat, (choice, common));
    }
    let config = arguments.structure.config();
    let figures = bench::build(&scene, &config, arguments.repeat).map_err(|e| build_error(&e))?;
    let stages: serde_json::Map<_, _> =
        figures.stages.iter().map(|(name, ms)| ((*name).to_owned(), json!(ms))).collect();
    let triangles = figures.triangles.max(1) as f64;
    let line = json!({
        "bench": "build",
        "device": "cpu",
        "accel": figures.accel,
        "optimize": arguments.structure.optimize,
        "layout": arguments.structure.layout,
        "threads": rayon::current_num_threads(),
        "triangles": figures.triangles,
        "references": figures.references,
        "nodes": figures.nodes,
        "build_ms": figures.build_ms,
        "cpu_ms": figures.cpu_ms,
        "mtri_per_s": figures.mtri_per_s,
        "cost": figures.cost,
        "depth": figures.depth,
        "overlap": figures.overlap,
        "bytes": figures.bytes,
        "bytes_per_triangle": figures.bytes as f64 / triangles,
        "peak_build_bytes": figures.peak_build_bytes,
        "peak_build_bytes_per_triangle": figures.peak_build_bytes.map(|bytes| bytes as f64 / triangles),
        "peak_rss_bytes": peak_rss_bytes(),
        "stages": stages,
    });
    println!("{line}");
    Ok(Exit::Done)
}
