//! Where the collection of models is.

use std::path::{Path, PathBuf};

/// A folder of the collection, or a clear line why the test is skipped.
pub(crate) fn models(folder: &str) -> Option<PathBuf> {
    let named = std::env::var_os("VASTLIGHT_MODELS").map(PathBuf::from);
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/models");
    let path = named.unwrap_or(beside).join(folder);
    if !path.is_dir() {
        println!("skipped: no model collection at {}", path.display());
        return None;
    }
    Some(path)
}
