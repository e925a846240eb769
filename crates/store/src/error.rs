//! Why a store cannot be written or read.

use std::io::ErrorKind;
use std::path::Path;
use vastlight_paging::SourceError;

/// Why a store cannot be written or read: what, where, and what to do.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{place}: {what} ({hint})")]
pub struct StoreError {
    /// What went wrong.
    pub what: String,
    /// The file and the part of it, or the mesh.
    pub place: String,
    /// What can be done about it.
    pub hint: &'static str,
    /// Whether the file could not be written.
    pub is_output: bool,
}

impl StoreError {
    pub(crate) fn pack(mesh: &str, what: String) -> Self {
        Self { what, place: format!("mesh \"{mesh}\""), hint: "see `vastlight validate`", is_output: false }
    }

    pub(crate) fn read(path: &Path, error: &std::io::Error) -> Self {
        Self {
            what: format!("a temporary file cannot be read: {error}"),
            place: path.display().to_string(),
            hint: "is the disk sound?",
            is_output: true,
        }
    }

    /// A store that another process is writing.
    pub(crate) fn busy(path: &Path) -> Self {
        Self {
            what: "another process is packing this store".into(),
            place: path.display().to_string(),
            hint: "wait for it, or choose another name",
            is_output: true,
        }
    }

    pub(crate) fn write(path: &Path, error: &std::io::Error) -> Self {
        let hint = match error.kind() {
            ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge => {
                "make room on the disk; the same command goes on where it stopped"
            }
            _ => "is the folder there and writable?",
        };
        Self { what: error.to_string(), place: path.display().to_string(), hint, is_output: true }
    }

    pub(crate) fn damaged(name: &str, what: impl Into<String>) -> Self {
        Self {
            what: what.into(),
            place: name.to_owned(),
            hint: "the store is damaged or cut short: pack the scene again",
            is_output: false,
        }
    }
}

impl From<SourceError> for StoreError {
    fn from(error: SourceError) -> Self {
        Self {
            what: error.what,
            place: format!("{}, byte {}", error.name, error.offset),
            hint: error.hint,
            is_output: false,
        }
    }
}
