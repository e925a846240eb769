//! Folders for readers that take files, and the limits of all.

use std::path::PathBuf;
use tempfile::TempDir;
use vastlight::import::{Limits, LoadOptions};

/// Limits under which a harness of a few kilobytes needs no more than a few hundred megabytes.
#[must_use]
pub fn limits() -> Limits {
    Limits {
        file_bytes: 1 << 22,
        vertices: 1 << 20,
        triangles: 1 << 20,
        items: 1 << 12,
        instances: 1 << 16,
        decoded_bytes: 1 << 24,
        all_images_bytes: 1 << 25,
        image_side: 1 << 12,
        nesting: 64,
        line_bytes: 1 << 20,
    }
}

/// How scene files are read.
pub(crate) fn options() -> LoadOptions {
    LoadOptions { limits: limits(), ..LoadOptions::default() }
}

/// A folder with files, removed in the end.
pub(crate) struct Scratch(TempDir);

impl Scratch {
    /// A folder with these files.
    pub(crate) fn with(files: &[(&str, &[u8])]) -> Self {
        let scratch = Self(tempfile::tempdir().expect("a folder for temporary files"));
        for (name, bytes) in files {
            std::fs::write(scratch.path(name), bytes).expect("the folder takes files");
        }
        scratch
    }

    /// Where a file is.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }
}
