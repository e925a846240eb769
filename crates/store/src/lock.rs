//! One process writes a file.

use same_file::Handle;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{ErrorKind, Result};
use std::path::Path;
use std::time::Duration;

/// How often a file that another process keeps is asked for.
const PATIENCE: u32 = 20;

/// Opens a file at `path` and takes it for this process; none if another keeps it. One that was killed gives it back when the
/// system has taken down its memory, which takes a moment.
pub(crate) fn open_locked(path: &Path) -> Result<Option<File>> {
    for attempt in 0..PATIENCE {
        if attempt > 0 {
            std::thread::sleep(Duration::from_millis(100));
        }
        let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)?;
        match file.try_lock() {
            Ok(()) if is_at(&file, path)? => return Ok(Some(file)),
            Ok(()) | Err(TryLockError::WouldBlock) => {}
            Err(TryLockError::Error(error)) => return Err(error),
        }
    }
    Ok(None)
}

/// Whether the file is still the one at `path`: who kept it before may have given it its name, or taken it away.
fn is_at(file: &File, path: &Path) -> Result<bool> {
    match Handle::from_path(path) {
        Ok(there) => Ok(Handle::from_file(file.try_clone()?)? == there),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_was_renamed_or_removed_is_not_the_one_at_its_path() {
        let folder = tempfile::tempdir().expect("a folder");
        let [part, whole] = ["part", "whole"].map(|name| folder.path().join(name));
        let opened = || open_locked(&part).expect("opened").expect("free");
        let file = opened();
        assert!(is_at(&file, &part).expect("read"));
        std::fs::rename(&part, &whole).expect("renamed");
        assert!(!is_at(&file, &part).expect("read") && is_at(&file, &whole).expect("read"));
        let other = opened();
        assert!(is_at(&other, &part).expect("read") && !is_at(&file, &part).expect("read"));
        std::fs::remove_file(&part).expect("removed");
        assert!(!is_at(&other, &part).expect("read"));
    }

    #[test]
    fn a_file_that_is_kept_is_not_given() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("part");
        let kept = open_locked(&path).expect("opened").expect("free");
        assert!(open_locked(&path).expect("opened").is_none());
        drop(kept);
        assert!(open_locked(&path).expect("opened").is_some());
    }
}
