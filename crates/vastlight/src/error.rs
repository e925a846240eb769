//! Everything that can go wrong, in one type: what, where, and a hint.

use std::fmt;
use vastlight_film::FilmError;
use vastlight_gpu::GpuError;
use vastlight_import::ImportError;
use vastlight_scene::SceneError;

/// The class of an [`Error`]; the command's exit codes follow it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorClass {
    /// The request does not make sense.
    Usage,
    /// A scene or another input file cannot be used.
    Scene,
    /// The memory budget is too small.
    Memory,
    /// The device cannot be used.
    Device,
    /// A file cannot be written.
    Output,
    /// Samples were not finite where that was declared an error.
    NonFinite,
    /// The user stopped the work.
    Interrupted,
}

/// Why something could not be done.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub struct Error {
    /// The class, for programs.
    pub class: ErrorClass,
    /// What is wrong, one sentence without a full stop.
    pub what: String,
    /// Where: a file, an option, an object's name; empty if there is nothing to say.
    pub place: String,
    /// What the user can do; empty if there is nothing to say.
    pub hint: String,
}

impl Error {
    /// An error with its parts.
    pub fn new(
        class: ErrorClass,
        what: impl Into<String>,
        place: impl Into<String>,
        hint: impl Into<String>,
    ) -> Self {
        Self { class, what: what.into(), place: place.into(), hint: hint.into() }
    }

    /// An error of class [`ErrorClass::Usage`].
    pub fn usage(what: impl Into<String>, place: impl Into<String>, hint: impl Into<String>) -> Self {
        Self::new(ErrorClass::Usage, what, place, hint)
    }

    /// An error of class [`ErrorClass::Scene`].
    pub fn scene(what: impl Into<String>, place: impl Into<String>, hint: impl Into<String>) -> Self {
        Self::new(ErrorClass::Scene, what, place, hint)
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.place.is_empty() {
            write!(f, "{}: ", self.place)?;
        }
        f.write_str(&self.what)?;
        if self.hint.is_empty() { Ok(()) } else { write!(f, " ({})", self.hint) }
    }
}

impl From<SceneError> for Error {
    fn from(e: SceneError) -> Self {
        Self::scene(e.what, e.place, e.hint)
    }
}

impl From<ImportError> for Error {
    fn from(e: ImportError) -> Self {
        Self::scene(e.what, e.place, e.hint)
    }
}

impl From<FilmError> for Error {
    fn from(e: FilmError) -> Self {
        match e {
            FilmError::Write { path, what } => {
                Self::new(ErrorClass::Output, format!("cannot write: {what}"), path.display().to_string(), "")
            }
            FilmError::Read { path, what } => {
                Self::scene(format!("cannot read: {what}"), path.display().to_string(), "")
            }
            FilmError::Mismatch { what } => Self::scene(what, "", ""),
        }
    }
}

impl From<GpuError> for Error {
    fn from(e: GpuError) -> Self {
        if let GpuError::Pages(e) = e {
            return e.into();
        }
        Self::new(ErrorClass::Device, e.to_string(), "gpu", e.hint())
    }
}
