//! Why a file cannot be imported: what, where, and a hint.

use std::fmt;
use std::path::Path;
use vastlight_scene::SceneError;

/// The class of an [`ImportError`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorKind {
    /// The operating system refused to open or read a file.
    Io,
    /// The file is of no format that is read here.
    UnknownFormat,
    /// The file is well formed, but needs something that is not supported.
    Unsupported,
    /// The file breaks the rules of its format.
    Malformed,
    /// The file asks for more than [`crate::Limits`] allow.
    Limit,
}

/// Why a file cannot be imported.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub struct ImportError {
    /// The class, for programs.
    pub kind: ErrorKind,
    /// What is wrong, one sentence without a full stop.
    pub what: String,
    /// Where: a file, with a line, a byte or a JSON pointer where there is one.
    pub place: String,
    /// What the user can do; empty if there is nothing to say.
    pub hint: String,
}

impl ImportError {
    /// An error with its parts and an empty hint.
    pub fn new(kind: ErrorKind, what: impl Into<String>, place: impl Into<String>) -> Self {
        Self { kind, what: what.into(), place: place.into(), hint: String::new() }
    }

    /// An error of kind [`ErrorKind::Malformed`].
    pub fn malformed(what: impl Into<String>, place: impl Into<String>) -> Self {
        Self::new(ErrorKind::Malformed, what, place)
    }

    /// An error of kind [`ErrorKind::Unsupported`].
    pub fn unsupported(what: impl Into<String>, place: impl Into<String>) -> Self {
        Self::new(ErrorKind::Unsupported, what, place)
    }

    /// An error of kind [`ErrorKind::Limit`].
    pub fn limit(what: impl Into<String>, place: impl Into<String>) -> Self {
        Self::new(ErrorKind::Limit, what, place)
    }

    /// An error of the operating system with the file it is about.
    #[must_use]
    pub fn io(error: &std::io::Error, path: &Path) -> Self {
        Self::new(ErrorKind::Io, error.to_string(), path.display().to_string())
    }

    /// The same error with a hint.
    #[must_use]
    pub fn with_hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = hint.into();
        self
    }
}

impl fmt::Display for ImportError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.place.is_empty() {
            write!(f, "{}: ", self.place)?;
        }
        f.write_str(&self.what)?;
        if self.hint.is_empty() { Ok(()) } else { write!(f, " ({})", self.hint) }
    }
}

impl From<ImportError> for SceneError {
    fn from(e: ImportError) -> Self {
        Self { what: e.what, place: e.place, hint: e.hint }
    }
}
