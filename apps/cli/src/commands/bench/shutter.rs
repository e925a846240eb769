//! `vastlight bench shutter SEQUENCE`.

use crate::arguments::{Common, SceneArguments};
use crate::exit::Exit;
use crate::values::{self, Resolution};
use clap::Args;
use serde_json::json;
use vastlight::{Error, Exposure, measure_shutter};

/// Trace rays at a moment of a scene that moves (--time), and each at its own time while the shutter is open
#[derive(Args, Debug)]
pub(crate) struct Shutter {
    #[command(flatten)]
    scene: SceneArguments,
    /// How long the shutter is open, as a part of a frame's time
    #[arg(long, value_name = "PART", default_value_t = 0.5, value_parser = values::shutter)]
    shutter: f32,
    /// Poses of what moves while the shutter is open
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(2..=i64::from(Exposure::MOST_KEYS)))]
    shutter_keys: u32,
    /// Frames a second
    #[arg(long, value_name = "N", default_value_t = 24.0, value_parser = values::positive)]
    fps: f32,
    /// Columns and rows of the camera's rays
    #[arg(short, long, value_name = "SIZE", default_value = "640x480", value_parser = values::resolution)]
    resolution: Resolution,
}

pub(crate) fn run(arguments: &Shutter, common: &Common) -> Result<Exit, Error> {
    let scene = arguments.scene.load(common)?;
    let exposure = Exposure { seconds: arguments.shutter / arguments.fps, keys: arguments.shutter_keys };
    let time = arguments.scene.time().unwrap_or(0.0);
    let figures = measure_shutter(&scene, time, &exposure, arguments.resolution.size(None).into())?;
    let slowdown = |i: usize| figures.still[i].zip(figures.open[i]).map(|(still, open)| still / open);
    let line = json!({
        "bench": "shutter",
        "sequence": arguments.scene.shown(),
        "time": time,
        "shutter": arguments.shutter,
        "keys": exposure.keys,
        "rays": figures.rays,
        "moving_instances": figures.moving[0],
        "moving_triangles": figures.moving[1],
        "still_mrays_per_s": figures.still[0],
        "open_mrays_per_s": figures.open[0],
        "slowdown": slowdown(0),
        "slowdown_by_processor_time": slowdown(1),
        "pose_ms": figures.pose_ms[0],
        "open_ms": figures.pose_ms[1],
        "threads": rayon::current_num_threads(),
    });
    println!("{line}");
    Ok(Exit::Done)
}
