//! `vastlight bench clusters SEQUENCE`.

use super::sequence::Sequence;
use crate::arguments::Common;
use crate::exit::Exit;
use crate::output::PictureFile;
use crate::values;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;
use vastlight::accel::cluster::Heuristic;
use vastlight::film::PngOptions;
use vastlight::{ClusterFigures, ClusterMoment, ClusterRequest, Error, measure_clusters};

/// Build trees over precomputed clusters of meshes that deform, beside trees over all triangles
#[derive(Args, Debug)]
#[command(mut_arg("frames", |frames| frames.default_value("0-71x12")))]
pub(crate) struct Clusters {
    #[command(flatten)]
    sequence: Sequence,
    /// What clusters should look like: acc (discs or balls), naive (full boxes), error (flat discs)
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "acc", value_parser = values::heuristic)]
    heuristic: Vec<Heuristic>,
    /// Most vertices of a cluster, and its largest size
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_values_t = [10, 50, 100, 200], value_parser = clap::value_parser!(u32).range(1..))]
    max_count: Vec<u32>,
    /// Builder on both sides
    #[arg(long, value_name = "NAME", default_value = "")]
    accel: String,
    /// Picture of the last kind of clusters by colour, PNG or EXR
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Clusters, common: &Common) -> Result<Exit, Error> {
    let output = arguments.output.as_ref().map(|path| PictureFile::new(path, false)).transpose()?;
    if let Some(output) = &output {
        output.refuse_sums("the picture of clusters is no sum")?;
    }
    let scene = arguments.sequence.scene.load(common)?;
    let request = ClusterRequest {
        heuristics: arguments.heuristic.clone(),
        max_counts: arguments.max_count.clone(),
        times: arguments.sequence.times(),
        size: arguments.sequence.size(),
        accel: arguments.accel.clone(),
    };
    let picture = measure_clusters(&scene, &request, |figures| {
        println!("{}", line(arguments, figures));
    })?;
    if let Some(output) = output {
        output.write_picture(&picture, &PngOptions::default())?;
    }
    Ok(Exit::Done)
}

fn line(arguments: &Clusters, figures: &ClusterFigures) -> serde_json::Value {
    let mean = figures.mean();
    let of_frames = |of: fn(&ClusterMoment) -> f64| figures.moments.iter().map(of).collect::<Vec<_>>();
    json!({
        "bench": "clusters",
        "sequence": arguments.sequence.scene.shown(),
        "heuristic": figures.config.heuristic.name(),
        "accel": arguments.accel,
        "max_count": figures.config.max_count,
        "clusters": figures.clusters,
        "triangles": figures.triangles,
        "made_ms": figures.made_ms,
        "build_ms": mean.build_ms[0],
        "build_ms_without": mean.build_ms[1],
        "build_ms_default": mean.build_ms[2],
        "trace_ms": mean.trace_ms[0],
        "trace_ratio": mean.trace_ms[1] / mean.trace_ms[0],
        "trace_ratio_default": mean.trace_ms[2] / mean.trace_ms[0],
        "frames": figures.moments.len(),
        "frame_build_ms": of_frames(|m| m.build_ms[0]),
        "frame_trace_ms": of_frames(|m| m.trace_ms[0]),
        "frame_trace_ratio": of_frames(|m| m.trace_ms[1] / m.trace_ms[0]),
        "same_hits": figures.same_hits,
        "threads": rayon::current_num_threads(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        clusters: Clusters,
    }

    #[test]
    fn few_frames_are_built_unless_asked_for() {
        let times = |line: &[&str]| Line::parse_from(line).clusters.sequence.times();
        assert_eq!(times(&["clusters", "demo:cloth"]), [0.0, 0.5, 1.0, 1.5, 2.0, 2.5]);
        assert_eq!(times(&["clusters", "demo:cloth", "-f", "24"]), [1.0]);
    }
}
