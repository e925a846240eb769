//! What a store was made of, so that a change is noticed.

use serde::{Deserialize, Serialize};
use std::path::Path;
use std::time::UNIX_EPOCH;

/// A file, or a demo scene with its options, that a store was packed from.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SourceFile {
    /// Path as it was given; `demo:NAME` with size and seed for a demo.
    pub name: String,
    /// Size, bytes; 0 for a demo.
    pub bytes: u64,
    /// Time of the last change in nanoseconds since 1970; 0 for a demo, and where the system does not say.
    pub modified_ns: u64,
}

impl SourceFile {
    /// A file as it is now.
    ///
    /// # Errors
    /// The system does not say.
    pub fn of_path(path: &Path) -> std::io::Result<Self> {
        let metadata = std::fs::metadata(path)?;
        let modified = metadata.modified().ok().and_then(|time| time.duration_since(UNIX_EPOCH).ok());
        Ok(Self {
            name: path.display().to_string(),
            bytes: metadata.len(),
            modified_ns: modified.map_or(0, |time| time.as_nanos() as u64),
        })
    }

    /// Whether the file is there and is another one than it was. A file that is not there any more says nothing.
    #[must_use]
    pub fn has_changed(&self) -> bool {
        let is_demo = self.name.starts_with("demo:");
        !is_demo && Self::of_path(Path::new(&self.name)).is_ok_and(|now| now != *self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_of_a_file_is_noticed_and_its_absence_is_not() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("mesh.ply");
        std::fs::write(&path, b"ply").expect("writes");
        let source = SourceFile::of_path(&path).expect("there");
        assert!(!source.has_changed());
        std::fs::write(&path, b"plyplyply").expect("writes");
        assert!(source.has_changed());
        std::fs::remove_file(&path).expect("removes");
        assert!(!source.has_changed());
    }
}
