//! The scenes below a folder, and no way out of it.

use serde::Serialize;
use std::path::{Component, Path, PathBuf};
use vastlight::Error;

/// Extensions of scenes.
const SCENES: [&str; 7] = ["glb", "gltf", "obj", "ply", "stl", "vls", "toml"];
/// Most entries of a listing.
const MOST: usize = 2000;

/// What a folder holds.
#[derive(Debug, PartialEq, Eq, Serialize)]
pub(crate) struct Listing {
    /// The folder, from the one that is shared; empty for that itself.
    pub(crate) folder: String,
    pub(crate) folders: Vec<String>,
    pub(crate) files: Vec<SceneFile>,
    /// Whether there is more than is listed.
    pub(crate) cut: bool,
}

/// A file that may be opened.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub(crate) struct SceneFile {
    pub(crate) name: String,
    pub(crate) bytes: u64,
}

fn outside(name: &str) -> Error {
    Error::usage("that is not below the folder of this page", name, "start it with another --folder")
}

/// The place of a name below a folder, by names alone and by where links lead.
pub(crate) fn below(root: &Path, name: &str) -> Result<PathBuf, Error> {
    let plain = |component| matches!(component, Component::Normal(_));
    if !Path::new(name).components().all(plain) || name.contains('\\') || name.contains('\0') {
        return Err(outside(name));
    }
    let gone = |e: std::io::Error| Error::scene(e.to_string(), name, "");
    let root = root.canonicalize().map_err(gone)?;
    let path = root.join(name).canonicalize().map_err(gone)?;
    if path.starts_with(&root) { Ok(path) } else { Err(outside(name)) }
}

/// What is in a folder below `root`.
pub(crate) fn list(root: &Path, folder: &str) -> Result<Listing, Error> {
    let path = below(root, folder)?;
    let entries = std::fs::read_dir(&path).map_err(|e| Error::scene(e.to_string(), folder, ""))?;
    let (mut folders, mut files) = (Vec::new(), Vec::new());
    for entry in entries.flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let Ok(meta) = std::fs::metadata(entry.path()) else { continue };
        if name.starts_with('.') {
            continue;
        }
        if meta.is_dir() {
            folders.push(name);
        } else if is_scene(Path::new(&name)) {
            files.push(SceneFile { name, bytes: meta.len() });
        }
    }
    folders.sort();
    files.sort();
    let cut = folders.len() + files.len() > MOST;
    folders.truncate(MOST);
    files.truncate(MOST - folders.len());
    Ok(Listing { folder: folder.to_owned(), folders, files, cut })
}

fn is_scene(name: &Path) -> bool {
    let extension = name.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    SCENES.contains(&extension.as_str())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_no_way_out_of_the_folder() {
        let outer = tempfile::tempdir().expect("a folder");
        let root = outer.path().join("shared");
        std::fs::create_dir_all(root.join("deep")).expect("made");
        for file in
            ["shared/a.glb", "shared/deep/b.PLY", "shared/notes.txt", "secret.glb", "shared/.hidden.obj"]
        {
            std::fs::write(outer.path().join(file), "x").expect("written");
        }
        assert!(below(&root, "a.glb").is_ok() && below(&root, "deep/b.PLY").is_ok());
        for name in [
            "../secret.glb",
            "deep/../../secret.glb",
            "/etc/passwd",
            "..",
            "deep\\..\\..",
            "a\0b",
            "none.glb",
        ] {
            assert!(below(&root, name).is_err(), "{name}");
        }
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(outer.path(), root.join("link")).expect("linked");
            assert!(below(&root, "link/secret.glb").is_err() && list(&root, "link").is_err());
        }
        let listing = list(&root, "").expect("listed");
        assert_eq!(listing.files, [SceneFile { name: "a.glb".into(), bytes: 1 }]);
        assert_eq!(listing.folders[0], "deep");
        assert_eq!(list(&root, "deep").expect("listed").files[0].name, "b.PLY");
    }
}
