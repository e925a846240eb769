//! Files that appear whole or not at all: written beside the target, synchronised, renamed.

use crate::FilmError;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use tempfile::NamedTempFile;

/// Finds out, before any work, whether `path` can be written later.
///
/// # Errors
/// If the folder does not exist or takes no new file, or if `path` is a folder.
pub fn check_writable(path: &Path) -> Result<(), FilmError> {
    if path.is_dir() {
        return Err(FilmError::write(path, "it is a folder"));
    }
    temporary_beside(path).map(drop)
}

/// Writes a file through `body`. Whatever fails, the target is then as it was before.
///
/// # Errors
/// If anything cannot be written, a full disk included.
pub fn write_atomically(
    path: &Path,
    body: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), FilmError> {
    let mut temporary = temporary_beside(path)?;
    write_and_sync(temporary.as_file_mut(), body).map_err(|e| FilmError::write(path, e))?;
    temporary.persist(path).map_err(|e| FilmError::write(path, e.error))?;
    Ok(())
}

fn write_and_sync(file: &mut File, body: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut buffered = BufWriter::new(&mut *file);
    body(&mut buffered)?;
    buffered.flush()?;
    drop(buffered);
    file.sync_all()
}

/// A new file in the target's folder, removed when dropped.
fn temporary_beside(path: &Path) -> Result<NamedTempFile, FilmError> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".vastlight-").suffix(".tmp");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder).map_err(|e| FilmError::write(path, reason(&e, folder)))
}

fn reason(error: &io::Error, folder: &Path) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => format!("the folder {} does not exist", folder.display()),
        _ => format!("the folder {} takes no new file: {error}", folder.display()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join("a.png");
        write_atomically(&path, |w| w.write_all(b"old")).expect("written");
        let full = |w: &mut dyn Write| {
            w.write_all(b"half of the new")?;
            Err(io::Error::from(io::ErrorKind::StorageFull))
        };
        write_atomically(&path, full).expect_err("disk full");
        assert_eq!(std::fs::read(&path).expect("still there"), b"old");
        assert_eq!(std::fs::read_dir(folder.path()).expect("listed").count(), 1);
    }

    #[test]
    fn unusable_targets_are_found_beforehand() {
        let folder = tempfile::tempdir().expect("temporary folder");
        assert!(check_writable(&folder.path().join("ok.png")).is_ok());
        assert!(check_writable(folder.path()).is_err());
        let message =
            check_writable(&folder.path().join("no/such/x.png")).expect_err("no folder").to_string();
        assert!(message.contains("does not exist"), "{message}");
        assert_eq!(std::fs::read_dir(folder.path()).expect("listed").count(), 0);
    }
}
