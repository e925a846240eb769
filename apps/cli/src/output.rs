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
    /// Checks extension and folder. The name of a sequence has a place for the frame's number: a run of `#`.
    pub(crate) fn new(path: &Path, is_sequence: bool) -> Result<Self, Error> {
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
        let place = path.display().to_string();
        let format = match extension.to_ascii_lowercase().as_str() {
            "png" => Format::Png,
            "exr" => Format::Exr,
            _ => return Err(Error::usage("unknown kind of picture", place, "write to .png or .exr")),
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
