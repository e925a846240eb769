//! `vastlight generate KIND -o FILE`: a procedural scene as a file.

use crate::arguments::Common;
use crate::commands::write::{self, FileKind, StoreOptions, kind_of};
use crate::exit::Exit;
use crate::progress::ProgressKind;
use clap::Args;
use std::path::PathBuf;
use std::time::Instant;
use vastlight::scene::generate::{self, GenerateOptions};
use vastlight::store::PackConfig;
use vastlight::{Error, LoadOptions};

/// Write a procedural scene to a file (.glb, .obj, .ply, .vls); the same seed gives the same file
#[derive(Args, Debug)]
pub(crate) struct Generate {
    /// Name of the demo scene
    #[arg(value_parser = clap::builder::PossibleValuesParser::new(generate::names()))]
    kind: String,
    /// The file: .glb, .obj, .ply or .vls
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Triangles, for scenes whose size can be chosen
    #[arg(long, value_name = "N")]
    triangles: Option<u64>,
    /// Bytes of texture, for scenes that can be asked for them (8GiB, 512MiB)
    #[arg(long, value_name = "SIZE", value_parser = vastlight::parse_bytes)]
    texture_bytes: Option<u64>,
    /// Another seed is another scene of the kind
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Moment, for scenes that move, in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, allow_negative_numbers = true)]
    time: f32,
}

pub(crate) fn run(arguments: &Generate, common: &Common, start: Instant) -> Result<Exit, Error> {
    let generate = GenerateOptions {
        triangles: arguments.triangles,
        texture_bytes: arguments.texture_bytes,
        seed: arguments.seed,
        time: arguments.time,
    };
    let source = format!("demo:{}", arguments.kind);
    let load = LoadOptions { generate, ..LoadOptions::default() };
    match kind_of(&arguments.output)? {
        FileKind::Store => {
            let config = PackConfig::default();
            let options = StoreOptions { config, progress: ProgressKind::Auto, json: false };
            write::store(&[source], &load, &arguments.output, &options, common, start)?;
        }
        FileKind::Exchange => write::exchange(&source, &load, &arguments.output, common)?,
    }
    Ok(Exit::Done)
}
