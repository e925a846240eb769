//! `vastlight generate KIND -o FILE`: a procedural scene as a file.

use crate::arguments::Common;
use crate::exit::Exit;
use clap::Args;
use std::path::PathBuf;
use vastlight::export::{self, ExportError};
use vastlight::film::check_writable;
use vastlight::scene::generate::{self, GenerateOptions};
use vastlight::{Error, ErrorClass};

/// Write a procedural scene to a file (.glb, .obj, .ply); the same seed gives the same file
#[derive(Args, Debug)]
pub(crate) struct Generate {
    /// Name of the demo scene
    #[arg(value_parser = clap::builder::PossibleValuesParser::new(generate::names()))]
    kind: String,
    /// The file: .glb, .obj or .ply
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
}

pub(crate) fn run(arguments: &Generate, common: &Common) -> Result<Exit, Error> {
    let extension = arguments.output.extension().and_then(|e| e.to_str()).unwrap_or_default();
    if !export::FORMATS.contains(&extension.to_ascii_lowercase().as_str()) {
        let place = arguments.output.display().to_string();
        let hint = format!("write to one of .{}", export::FORMATS.join(", ."));
        return Err(Error::usage("unknown kind of scene file", place, hint));
    }
    check_writable(&arguments.output)?;
    let options = GenerateOptions {
        triangles: arguments.triangles,
        texture_bytes: arguments.texture_bytes,
        seed: arguments.seed,
    };
    let make = || generate::stream(&arguments.kind, &options);
    make()?;
    let written = export::write_stream(&make, &arguments.output).map_err(|e| write_error(&e))?;
    if !common.quiet {
        written.lost.items().iter().for_each(|item| eprintln!("warning: {item}"));
        eprintln!("{}: {} triangles", arguments.output.display(), written.triangles);
    }
    Ok(Exit::Done)
}

fn write_error(error: &ExportError) -> Error {
    Error::new(ErrorClass::Output, error.to_string(), "", "")
}
