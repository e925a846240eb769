//! Where pictures go: the file format by its extension, checked before any work.

use std::path::{Path, PathBuf};
use vastlight::film::{self, Aov, Picture, PngOptions};
use vastlight::{Error, ErrorClass};

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
}

impl PictureFile {
    /// Checks extension and folder.
    pub(crate) fn new(path: &Path) -> Result<Self, Error> {
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
        let place = path.display().to_string();
        let format = match extension.to_ascii_lowercase().as_str() {
            "png" => Format::Png,
            "exr" => Format::Exr,
            _ => return Err(Error::usage("unknown kind of picture", place, "write to .png or .exr")),
        };
        if place.contains("####") {
            let hint = "give a file name without ####";
            return Err(Error::usage("sequences of frames are not available yet", place, hint));
        }
        film::check_writable(path)?;
        Ok(Self { path: path.to_owned(), format })
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

    /// Writes the picture; PNG through the tone curve, EXR linear.
    pub(crate) fn write(&self, picture: &Picture, png: &PngOptions) -> Result<(), Error> {
        match self.format {
            Format::Png => film::write_png(&self.path, picture, png)?,
            Format::Exr => film::write_exr(&self.path, picture)?,
        }
        Ok(())
    }

    /// The file's name for messages.
    pub(crate) fn name(&self) -> String {
        self.path.display().to_string()
    }
}

/// Writes a text file, whole or not at all.
pub(crate) fn write_text(path: &Path, text: &str) -> Result<(), Error> {
    Ok(film::write_atomically(path, |w| w.write_all(text.as_bytes()))?)
}

/// The error of a failed pipe or file behind stdout.
pub(crate) fn stdout_error(error: &std::io::Error) -> Error {
    Error::new(ErrorClass::Output, error.to_string(), "standard output", "")
}
