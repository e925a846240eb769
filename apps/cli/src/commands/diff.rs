//! `vastlight diff A B`: error figures and a difference image.

use crate::exit::Exit;
use crate::output::PictureFile;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;
use vastlight::Error;
use vastlight::film::{self, BitDepth, PngOptions, ToneCurve};

/// Compare two pictures (.exr, .png, .hdr) and print one JSON line
///
/// All figures are over linear values of R, G and B; integer pictures are decoded from sRGB first. relmse is the mean
/// of (a-b)^2 / (b^2 + 0.01), psnr is for a peak of 1 (null for equal pictures), mean_ratio is mean(a) / mean(b).
#[derive(Args, Debug)]
pub(crate) struct Diff {
    /// The picture
    a: PathBuf,
    /// The reference
    b: PathBuf,
    /// Write |a - b| here (.exr, or .png without tone curve)
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Exit with 1 if relmse is larger than this
    #[arg(long, value_name = "RELMSE")]
    tolerance: Option<f64>,
}

pub(crate) fn run(arguments: &Diff) -> Result<Exit, Error> {
    let output = arguments.output.as_deref().map(|path| PictureFile::new(path, false)).transpose()?;
    if let Some(output) = &output {
        output.refuse_sums("a difference has no sums")?;
    }
    let a = film::read_picture(&arguments.a)?;
    let b = film::read_picture(&arguments.b)?;
    let figures = film::compare(&a, &b)?;
    if let Some(output) = output {
        let options =
            PngOptions { exposure: 0.0, curve: ToneCurve::Linear, depth: BitDepth::Eight, dither: false };
        output.write_picture(&film::difference(&a, &b)?, &options)?;
    }
    let line = json!({
        "diff": [arguments.a.display().to_string(), arguments.b.display().to_string()],
        "mse": figures.mse,
        "relmse": figures.relmse,
        "psnr": figures.psnr,
        "max": figures.max,
        "mean_ratio": figures.mean_ratio,
        "non_finite": figures.non_finite,
    });
    println!("{line}");
    let differs = arguments.tolerance.is_some_and(|t| figures.relmse > t || figures.non_finite > 0);
    Ok(if differs { Exit::Different } else { Exit::Done })
}
