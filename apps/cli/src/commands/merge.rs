//! `vastlight merge A.vlc B.vlc ... -o FILE`.

use crate::arguments::Common;
use crate::exit::Exit;
use crate::output::{PictureFile, PngArguments};
use clap::Args;
use std::path::PathBuf;
use vastlight::{Error, merge_sums};

/// Add sums of passes, and put sums of parts side by side (.vlc, from `render --passes A-B -o FILE.vlc` or `render --crop ... -o FILE.vlc`): the bits
/// of one run, in any order
///
/// A single file may also be a checkpoint of a picture under way.
#[derive(Args, Debug)]
pub(crate) struct Merge {
    /// Sums of the same picture, of different passes or parts
    #[arg(required = true, value_name = "FILE.vlc")]
    sums: Vec<PathBuf>,
    /// A picture (.png or .exr), or sums again (.vlc)
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    png: PngArguments,
}

pub(crate) fn run(arguments: &Merge, common: &Common) -> Result<Exit, Error> {
    let png = arguments.png.options()?;
    let file = PictureFile::new(&arguments.output, false)?;
    let sums = merge_sums(&arguments.sums, common.memory)?;
    file.check_aovs(&sums.film().settings().aovs)?;
    file.write(&sums, &png)?;
    if !common.quiet {
        eprintln!("{}: passes {}", file.name(), sums.samples());
    }
    Ok(Exit::Done)
}
