//! The collection of models: every well-formed glTF loads, every malformed one is refused or explained.

#![expect(clippy::print_stdout, reason = "a test says what it skips")]

mod common;

use common::models;
use std::path::{Path, PathBuf};
use vastlight_import::{LoadOptions, load};
use vastlight_scene::Scene;

/// All glTF files below a folder, sorted.
fn gltf_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).expect("readable").flatten() {
            let path = entry.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "gltf" || e == "glb") {
                files.push(path);
            }
        }
    }
    files.sort();
    files
}

#[test]
fn every_well_formed_model_loads() {
    for folder in ["gltf", "cad"] {
        let Some(folder) = models(folder) else { continue };
        for file in gltf_files(&folder) {
            let desc = load(&file, &LoadOptions::default()).expect("readable");
            let scene = Scene::new(desc).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
            assert!(scene.instanced_triangles() > 0, "{}", file.display());
        }
    }
}
