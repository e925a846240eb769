//! `vastlight bench NAME`: one JSON line a result.

mod build;
mod build_gpu;
mod caustics;
mod clusters;
mod kdtree;
mod ooc;
mod path;
mod sequence;
mod shutter;
mod sort;
mod texture;
mod trace;
mod update;

use crate::arguments::Common;
use crate::exit::Exit;
use clap::{Args, Subcommand};
use std::time::Instant;
use vastlight::trace::{Layout, TraceError, TracerConfig};
use vastlight::{Error, ErrorClass};

/// Measure, and print one JSON line a result
#[derive(Args, Debug)]
pub(crate) struct Bench {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand, Debug)]
enum What {
    Trace(trace::Trace),
    Build(build::Build),
    Kdtree(kdtree::Kdtree),
    Sort(sort::Sort),
    Path(Box<path::Path>),
    Ooc(Box<ooc::Ooc>),
    Texture(Box<texture::Texture>),
    Caustics(caustics::Caustics),
    Update(Box<update::Update>),
    Animate(Box<update::Animate>),
    Clusters(Box<clusters::Clusters>),
    Shutter(Box<shutter::Shutter>),
}

impl Bench {
    /// Whether the benchmark runs on graphics processors.
    pub(crate) const fn knows_gpu(&self) -> bool {
        use What::{Animate, Clusters, Ooc, Shutter, Texture, Update};
        !matches!(self.what, Ooc(_) | Texture(_) | Update(_) | Animate(_) | Clusters(_) | Shutter(_))
    }
}

pub(crate) fn run(arguments: &Bench, common: &Common, start: Instant) -> Result<Exit, Error> {
    match &arguments.what {
        What::Trace(arguments) => trace::run(arguments, common),
        What::Build(arguments) => build::run(arguments, common),
        What::Kdtree(arguments) => kdtree::run(arguments, common),
        What::Sort(arguments) => sort::run(arguments, common),
        What::Ooc(arguments) => ooc::run(arguments, common),
        What::Texture(arguments) => texture::run(arguments, common),
        What::Caustics(arguments) => caustics::run(arguments, common),
        What::Update(arguments) => update::update(arguments, common),
        What::Animate(arguments) => update::animate(arguments, common),
        What::Clusters(arguments) => clusters::run(arguments, common),
        What::Shutter(arguments) => shutter::run(arguments, common),
        What::Path(arguments) => path::run(arguments, common, start),
    }
}

/// Which acceleration structure.
#[derive(Args, Debug)]
struct Structure {
    /// Acceleration structure by name
    #[arg(long, value_name = "NAME", default_value = "")]
    accel: String,
    /// Most references to triangles, as a multiple of the triangles [default: chosen by the builder]
    #[arg(long, value_name = "FACTOR")]
    split_budget: Option<f32>,
    /// Rounds of reinsertion after the build: slower to build, faster to trace
    #[arg(long, value_name = "N", default_value_t = 0)]
    optimize: u32,
    /// How meshes lie in memory
    #[arg(long, value_name = "NAME", default_value = Layout::NAMES[0], value_parser = Layout::NAMES)]
    layout: String,
}

impl Structure {
    fn config(&self) -> TracerConfig {
        TracerConfig {
            accel: self.accel.clone(),
            split_budget: self.split_budget,
            optimize: self.optimize,
            layout: Layout::from_name(&self.layout).unwrap_or_default(),
            ..TracerConfig::default()
        }
    }
}

/// An acceleration structure that cannot be built.
fn build_error(error: &TraceError) -> Error {
    Error::new(ErrorClass::Usage, error.to_string(), "--accel", "")
}
