//! Where the library is looked for.

use std::path::{Path, PathBuf};

/// Environment variable that names the library, or the folder that it is in; then it is looked for nowhere else.
pub const LIBRARY_VARIABLE: &str = "VASTLIGHT_OIDN";

/// File names of the library, best first.
const NAMES: &[&str] = if cfg!(windows) {
    &["OpenImageDenoise.dll"]
} else if cfg!(target_os = "macos") {
    &["libOpenImageDenoise.2.dylib", "libOpenImageDenoise.1.dylib", "libOpenImageDenoise.dylib"]
} else {
    &[
        "libOpenImageDenoise.so.2",
        "libOpenImageDenoise.so.1",
        "libOpenImageDenoise.so.0",
        "libOpenImageDenoise.so",
    ]
};

/// What to try in turn: names alone are found by the system.
pub(crate) fn candidates(named: Option<&Path>) -> Vec<PathBuf> {
    match named {
        Some(folder) if folder.is_dir() => NAMES.iter().map(|name| folder.join(name)).collect(),
        Some(file) => vec![file.to_owned()],
        None => NAMES.iter().map(PathBuf::from).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_has_the_names_of_the_system_and_a_file_is_one() {
        let names = candidates(None);
        assert!(!names.is_empty());
        let folder = tempfile::tempdir().expect("temporary folder");
        let inside = candidates(Some(folder.path()));
        let expected: Vec<_> = names.iter().map(|name| folder.path().join(name)).collect();
        assert_eq!(inside, expected);
        let file = folder.path().join("my-denoiser.so");
        assert_eq!(candidates(Some(&file)), [file]);
    }
}
