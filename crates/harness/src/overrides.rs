//! Changes to a scene from a TOML file, and manifests.

use crate::scene::check;
use crate::scratch::{Scratch, options};
use vastlight::{LoadOptions, Overrides, load, open};

/// An override file for a small scene, and the same bytes as a manifest.
pub(crate) fn run(bytes: &[u8]) {
    let scratch = Scratch::with(&[("scene.toml", bytes), ("mesh.ply", MESH)]);
    let path = scratch.path("scene.toml");
    let import = LoadOptions { import: options(), ..LoadOptions::default() };
    if let Ok(scene) = load(&path.display().to_string(), &import) {
        check::scene(&scene);
    }
    let Ok(overrides) = Overrides::read(&path) else { return };
    let changed = LoadOptions { overrides: vec![overrides], ..import };
    let Ok(open) = open("demo:cornell", &changed) else { return };
    check::scene(&open.scene);
    check::picture(&open);
}

/// What a manifest can place.
const MESH: &[u8] =
    b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
    element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
