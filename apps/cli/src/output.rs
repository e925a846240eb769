//! Where pictures go: the file format by its extension, checked before any work.

use crate::values;
use clap::Args;
use std::io::Write;
use std::path::{Path, PathBuf};
use vastlight::film::{self, Accumulator, Aov, BitDepth, Picture, PngOptions, ToneCurve};
use vastlight::{Error, ErrorClass};

/// How a PNG is made.
#[derive(Args, Debug)]
#[command(next_help_heading = "Output options")]
pub(crate) struct PngArguments {
    /// Exposure of the PNG in stops
    #[arg(long, value_name = "EV", default_value_t = 0.0, value_parser = values::finite, allow_hyphen_values = true)]
    exposure: f32,
    /// Tone curve of the PNG: filmic, reinhard, linear (or none)
    #[arg(long, value_name = "NAME", default_value_t = ToneCurve::Filmic)]
    tonemap: ToneCurve,
    /// Bits a channel of the PNG
    #[arg(long, value_name = "8|16", default_value_t = 8, value_parser = clap::value_parser!(u8).range(8..=16))]
    bit_depth: u8,
    /// Leave out the fine pattern that hides the steps of 8-bit gradients
    #[arg(long)]
    no_dither: bool,
}

impl PngArguments {
    /// The options of a file.
    pub(crate) fn options(&self) -> Result<PngOptions, Error> {
        let depth = match self.bit_depth {
            8 => BitDepth::Eight,
            16 => BitDepth::Sixteen,
            _ => return Err(Error::usage("a PNG has 8 or 16 bits a channel", "--bit-depth", "")),
        };
        Ok(PngOptions { exposure: self.exposure, curve: self.tonemap, depth, dither: !self.no_dither })
    }
}

/// A picture file to be written.
#[derive(Clone, Debug)]
pub(crate) struct PictureFile {
    path: PathBuf,
    format: Format,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Png,
    Exr,
    /// Sums of a picture, for `merge`.
    Sums,
}

impl PictureFile {
    /// Checks extension and folder. The name of a sequence has a place for the frame's number: a run of `#`.
    pub(crate) fn new(path: &Path, is_sequence: bool) -> Result<Self, Error> {
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
        let place = path.display().to_string();
        let format = match extension.to_ascii_lowercase().as_str() {
            "png" => Format::Png,
            "exr" => Format::Exr,
            "vlc" => Format::Sums,
            _ => {
                return Err(Error::usage(
                    "unknown kind of picture",
                    place,
                    "write to .png or .exr, or sums of passes to .vlc",
                ));
            }
        };
        match (is_sequence, numbered(path, 0).is_some()) {
            (true, false) => {
                let what = "several frames need a place for their number in the file's name";
                return Err(Error::usage(what, place, "write to frame.####.png or the like"));
            }
            (false, true) => {
                let what = "#### in a file's name stands for the number of a frame";
                return Err(Error::usage(what, place, "say which with --frames, or take another name"));
            }
            _ => {}
        }
        film::check_writable(path)?;
        Ok(Self { path: path.to_owned(), format })
    }

    /// The file of a frame.
    pub(crate) fn of_frame(&self, frame: u32) -> Self {
        Self { path: numbered(&self.path, frame).unwrap_or_else(|| self.path.clone()), format: self.format }
    }

    /// Whether the file can hold what is asked for.
    pub(crate) fn check_aovs(&self, aovs: &[Aov]) -> Result<(), Error> {
        match (self.format, aovs.first()) {
            (Format::Png, Some(aov)) => {
                let place = self.path.display().to_string();
                Err(Error::usage(format!("a PNG has no place for the AOV {aov}"), place, "write to .exr"))
            }
            _ => Ok(()),
        }
    }

    /// Refuses a file of sums, where only a picture can be written.
    pub(crate) fn refuse_sums(&self, reason: &str) -> Result<(), Error> {
        if self.is_sums() {
            return Err(Error::usage(reason, self.name(), "write to .exr or .png"));
        }
        Ok(())
    }

    /// Whether it is a file of sums.
    pub(crate) fn is_sums(&self) -> bool {
        self.format == Format::Sums
    }

    /// Writes sums, or the picture that they are developed to.
    pub(crate) fn write(&self, sums: &Accumulator, png: &PngOptions) -> Result<(), Error> {
        match self.format {
            Format::Sums => Ok(film::write_sums(&self.path, sums)?),
            _ => self.write_picture(&sums.develop(), png),
        }
    }

    /// Writes a picture; PNG through the tone curve, EXR linear.
    pub(crate) fn write_picture(&self, picture: &Picture, png: &PngOptions) -> Result<(), Error> {
        match self.format {
            Format::Png => film::write_png(&self.path, picture, png)?,
            Format::Exr => film::write_exr(&self.path, picture)?,
            Format::Sums => self.refuse_sums("a picture cannot be written as sums")?,
        }
        Ok(())
    }

    /// Where it is.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// The file's name for messages.
    pub(crate) fn name(&self) -> String {
        self.path.display().to_string()
    }
}

/// Fewest `#` that stand for a number: a single one is part of a name.
const LEAST_MARKS: usize = 2;

/// A path with the last run of `#` in the file's name replaced by a number of at least as many digits; none without such a run.
pub(crate) fn numbered(path: &Path, number: u32) -> Option<PathBuf> {
    let name = path.file_name()?.to_str()?;
    let end = name.rfind('#')? + 1;
    let start = name[..end].trim_end_matches('#').len();
    let width = end - start;
    (width >= LEAST_MARKS)
        .then(|| path.with_file_name(format!("{}{number:0width$}{}", &name[..start], &name[end..])))
}

/// Writes a text file, whole or not at all.
pub(crate) fn write_text(path: &Path, text: &str) -> Result<(), Error> {
    Ok(film::write_atomically(path, |w| w.write_all(text.as_bytes()))?)
}

/// Writes to stdout.
pub(crate) fn print(bytes: &[u8]) -> Result<(), Error> {
    std::io::stdout().lock().write_all(bytes).map_err(|e| stdout_error(&e))
}

/// The error of a failed pipe or file behind stdout.
pub(crate) fn stdout_error(error: &std::io::Error) -> Error {
    Error::new(ErrorClass::Output, error.to_string(), "standard output", "")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_numbered_where_the_marks_are() {
        let of = |name: &str, number| numbered(Path::new(name), number).map(|p| p.display().to_string());
        assert_eq!(of("a/f.####.png", 7).as_deref(), Some("a/f.0007.png"));
        assert_eq!(of("##.exr", 12345).as_deref(), Some("12345.exr"));
        assert_eq!(of("take#2_###.png", 4).as_deref(), Some("take#2_004.png"));
        assert_eq!(of("shot#3.png", 7), None);
        assert_eq!(of("##/f.png", 7), None);
    }
}
