//! `vastlight bench update SEQUENCE` and `vastlight bench animate SEQUENCE`.

use super::sequence::Sequence;
use crate::arguments::{Common, SceneArguments};
use crate::exit::Exit;
use crate::values;
use clap::Args;
use serde_json::json;
use vastlight::trace::UpdateMethod;
use vastlight::{Error, MovingFigures, MovingRequest, measure_moving};

/// Follow a scene that moves by several methods, and compare with building anew at each frame
#[derive(Args, Debug)]
pub(crate) struct Update {
    #[command(flatten)]
    following: Following,
}

/// Follow a scene that moves by several methods: update and tracing together, over all frames
#[derive(Args, Debug)]
pub(crate) struct Animate {
    #[command(flatten)]
    following: Following,
    /// Rays of a frame, in millions
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_values_t = [1.0, 10.0, 100.0], value_parser = values::positive)]
    rays: Vec<f32>,
}

/// How a sequence is followed.
#[derive(Args, Debug)]
struct Following {
    #[command(flatten)]
    sequence: Sequence,
    /// Methods: clustered, refit, rotate, rebuild, auto
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_values = UpdateMethod::ALL.map(UpdateMethod::name), value_parser = values::update_method)]
    method: Vec<UpdateMethod>,
    /// Builder of fresh trees [default: the fastest whose rays are within 5 % of the best]
    #[arg(long, value_name = "NAME", default_value = "")]
    accel: String,
}

impl Following {
    fn request(&self, rays_per_frame: f64) -> MovingRequest {
        MovingRequest {
            methods: self.method.clone(),
            times: self.sequence.times(),
            size: self.sequence.size(),
            rays_per_frame,
            rebuild: self.accel.clone(),
        }
    }
}

pub(crate) fn update(arguments: &Update, common: &Common) -> Result<Exit, Error> {
    let Following { sequence, method: methods, .. } = &arguments.following;
    let scene = sequence.scene.load(common)?;
    let mut all = Vec::new();
    measure_moving(&scene, &arguments.following.request(1e6), |figures| {
        println!("{}", line(&sequence.scene, figures));
        all.push(figures.clone());
    })?;
    for &method in methods {
        let of_method: Vec<_> = all.iter().filter(|f| f.method == method).collect();
        let mean = |value: fn(&MovingFigures) -> f64| {
            of_method.iter().map(|f| value(f)).sum::<f64>() / of_method.len().max(1) as f64
        };
        let summary = json!({
            "bench": "update",
            "sequence": sequence.scene.shown(),
            "method": method.name(),
            "frames": of_method.len(),
            "update_ms": mean(|f| f.update_ms),
            "scene_ms": mean(|f| f.scene_ms),
            "rebuild_ms": mean(|f| f.rebuild_ms),
            "trace_ratio": mean(|f| f.fresh_trace_ms) / mean(|f| f.trace_ms),
            "rebuilt_fraction": mean(|f| f.changed[0]),
            "migrated_fraction": mean(|f| f.changed[1]),
            "same_hits": of_method.iter().all(|f| f.same_hits),
        });
        println!("{summary}");
    }
    Ok(Exit::Done)
}

fn line(scene: &SceneArguments, figures: &MovingFigures) -> serde_json::Value {
    json!({
        "bench": "update",
        "sequence": scene.shown(),
        "method": figures.method.name(),
        "frame": figures.frame,
        "time": figures.time,
        "builder": figures.builder,
        "update_ms": figures.update_ms,
        "scene_ms": figures.scene_ms,
        "rebuild_ms": figures.rebuild_ms,
        "trace_ratio": figures.fresh_trace_ms / figures.trace_ms,
        "rebuilt_fraction": figures.changed[0],
        "migrated_fraction": figures.changed[1],
        "moved_meshes": figures.moved[0],
        "moved_instances": figures.moved[1],
        "rays": figures.rays,
        "same_hits": figures.same_hits,
        "threads": rayon::current_num_threads(),
    })
}

pub(crate) fn animate(arguments: &Animate, common: &Common) -> Result<Exit, Error> {
    let sequence = &arguments.following.sequence;
    let scene = sequence.scene.load(common)?;
    for millions in &arguments.rays {
        let rays = f64::from(*millions) * 1e6;
        let mut sums: Vec<(UpdateMethod, f64, f64)> = Vec::new();
        measure_moving(&scene, &arguments.following.request(rays), |figures| {
            let trace_ms = figures.trace_ms * rays / figures.rays.max(1) as f64;
            match sums.iter_mut().find(|sum| sum.0 == figures.method) {
                Some(sum) => (sum.1, sum.2) = (sum.1 + figures.update_ms, sum.2 + trace_ms),
                None => sums.push((figures.method, figures.update_ms, trace_ms)),
            }
        })?;
        let fixed = sums.iter().filter(|sum| sum.0 != UpdateMethod::Auto);
        let best = fixed.map(|sum| sum.1 + sum.2).fold(f64::INFINITY, f64::min);
        for (method, update_ms, trace_ms) in &sums {
            let line = json!({
                "bench": "animate",
                "sequence": sequence.scene.shown(),
                "method": method.name(),
                "rays_per_frame": rays,
                "update_ms": update_ms,
                "trace_ms": trace_ms,
                "against_best": (update_ms + trace_ms) / best,
                "frames": sequence.times().len(),
            });
            println!("{line}");
        }
    }
    Ok(Exit::Done)
}
