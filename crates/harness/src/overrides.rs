//! Changes to a scene from a TOML file, and manifests.

use crate::scene::check;
use crate::scratch::{Scratch, options};
use std::path::Path;
use vastlight::{Error, LoadOptions, OpenScene, Overrides, load, open};

/// What overrides and manifests can name, beside them.
const FILES: [(&str, &[u8]); 4] = [
    ("room.gltf", include_bytes!("room.gltf")),
    ("mesh.ply", MESH),
    ("lamp.ies", include_bytes!("../../../fuzz/seeds/ies/c")),
    ("sky.hdr", include_bytes!("../../../fuzz/seeds/image/flat.hdr")),
];

/// What a manifest can place.
const MESH: &[u8] =
    b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
    element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

/// An override file for a small scene, and the same bytes as a manifest.
pub(crate) fn run(bytes: &[u8]) -> bool {
    let scratch = Scratch::with(&FILES);
    let path = scratch.path("scene.toml");
    std::fs::write(&path, bytes).expect("the folder takes files");
    let placed = load(&path.display().to_string(), &import());
    if let Ok(scene) = &placed {
        check::scene(scene);
    }
    let changed = changed(&path, &scratch.path("room.gltf"));
    if let Ok(open) = &changed {
        check::scene(&open.scene);
        check::picture(open);
    }
    placed.is_ok() || changed.is_ok()
}

fn import() -> LoadOptions {
    LoadOptions { import: options(), ..LoadOptions::default() }
}

/// A scene with a texture and lights of every kind, as the overrides in a file have it.
fn changed(overrides: &Path, scene: &Path) -> Result<OpenScene, Error> {
    // The sky that it gets otherwise takes longer than all the rest.
    let day = Overrides::parse("environment.color = [1, 1, 1]", "day")?;
    let overrides = vec![day, Overrides::read(overrides)?];
    open(&scene.display().to_string(), &LoadOptions { overrides, ..import() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::seed;
    use vastlight::scene::Environment;

    /// Nothing would be tried behind names that lead nowhere.
    #[test]
    fn seeds_reach_lamps_profiles_and_maps() {
        let scratch = Scratch::with(&FILES);
        let [plain, lamp, map] =
            [Vec::new(), seed("overrides", "lamp"), seed("overrides", "map")].map(|bytes| {
                let path = scratch.path("scene.toml");
                std::fs::write(&path, bytes).expect("written");
                changed(&path, &scratch.path("room.gltf")).expect("a scene").scene
            });
        assert!(plain.lights().len() == 3 && !plain.textures().is_empty());
        let profiles =
            |scene: &vastlight::scene::Scene| scene.lights().iter().filter(|l| l.profile.is_some()).count();
        assert_eq!([&plain, &lamp].map(profiles), [0, 1]);
        assert_ne!(plain.lights()[0].intensity, lamp.lights()[0].intensity);
        assert!(matches!(map.environment(), Environment::Map { .. }));
    }
}
