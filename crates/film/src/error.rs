//! What can go wrong with a film or an image file.

use std::path::{Path, PathBuf};

/// Why a picture could not be written, read, merged or compared.
#[derive(Debug, thiserror::Error)]
pub enum FilmError {
    /// A file could not be written. Nothing is left of it.
    #[error("{}: cannot write: {what}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The reason.
        what: String,
    },
    /// A file could not be read as a picture.
    #[error("{}: cannot read: {what}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The reason.
        what: String,
    },
    /// Two films or pictures do not fit together.
    #[error("the pictures do not match: {what}")]
    Mismatch {
        /// What differs.
        what: String,
    },
}

impl FilmError {
    pub(crate) fn write(path: &Path, what: impl ToString) -> Self {
        Self::Write { path: path.to_owned(), what: what.to_string() }
    }

    pub(crate) fn read(path: &Path, what: impl ToString) -> Self {
        Self::Read { path: path.to_owned(), what: what.to_string() }
    }

    pub(crate) fn mismatch(what: impl Into<String>) -> Self {
        Self::Mismatch { what: what.into() }
    }
}
