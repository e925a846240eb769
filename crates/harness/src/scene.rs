//! Scene files: read as a whole and piece by piece, made a scene, written again.

pub(crate) mod check;

use crate::scratch::{Scratch, options};
use std::path::Path;
use vastlight::import::{ImportError, LoadOptions, file_size, load, stream, validate_gltf};
use vastlight::math::Vec3;
use vastlight::scene::{Environment, Scene, SceneDesc};

/// What stands between an OBJ file and its material library.
const LIBRARY: &[u8] = b"\n#mtl\n";

/// glTF as JSON, or as GLB; buffers and images are inside.
pub(crate) fn gltf(bytes: &[u8]) -> bool {
    let scratch = Scratch::with(&[("scene.gltf", bytes)]);
    let path = scratch.path("scene.gltf");
    let _ = validate_gltf(&path);
    read(&path)
}

/// OBJ, and behind a line `#mtl` its library `scene.mtl`.
pub(crate) fn obj(bytes: &[u8]) -> bool {
    let split = bytes.windows(LIBRARY.len()).position(|window| window == LIBRARY);
    let (scene, library) = match split {
        Some(place) => (&bytes[..place + 1], &bytes[place + LIBRARY.len()..]),
        None => (bytes, &[][..]),
    };
    let scratch = Scratch::with(&[("scene.obj", scene), ("scene.mtl", library)]);
    read(&scratch.path("scene.obj"))
}

/// PLY.
pub(crate) fn ply(bytes: &[u8]) -> bool {
    let scratch = Scratch::with(&[("scene.ply", bytes)]);
    read(&scratch.path("scene.ply"))
}

/// STL.
pub(crate) fn stl(bytes: &[u8]) -> bool {
    let scratch = Scratch::with(&[("scene.stl", bytes)]);
    read(&scratch.path("scene.stl"))
}

fn read(path: &Path) -> bool {
    let options = options();
    let size = file_size(path, &options);
    let Ok(mut desc) = load(path, &options) else { return false };
    size.expect("what can be read has a size");
    if desc.diagnostics.first_error().is_some() {
        assert!(Scene::new(desc).is_err(), "a scene with an error is none");
        return false;
    }
    same_in_pieces(&desc, path, &options);
    // The sky that it gets otherwise takes longer than all the rest.
    desc.environment.get_or_insert(Environment::Constant(Vec3::ONE));
    let Ok(mut scene) = Scene::new(desc) else { return false };
    check::scene(&scene);
    check::moments(&mut scene);
    check::written_again(&scene);
    check::rendered(&scene);
    true
}

/// Reading piece by piece gives the same scene.
fn same_in_pieces(desc: &SceneDesc, path: &Path, options: &LoadOptions) {
    let other = stream(path, options).map_err(|e: ImportError| e.to_string());
    let other = other.and_then(|streamed| streamed.collect().map_err(|e| e.to_string()));
    let other = other.expect("what can be read can be read in pieces");
    let tables = |desc: &SceneDesc| {
        let mut instances = desc.instances.clone();
        instances.sort_by_key(|i| i.mesh);
        let geometry = (&desc.meshes, &instances, &desc.names);
        let looks = (&desc.materials, &desc.textures, &desc.images);
        let rest = (&desc.lights, &desc.cameras, &desc.environment);
        // Numbers that are not finite equal themselves as bytes.
        postcard::to_stdvec(&(geometry, looks, rest)).expect("tables are written")
    };
    assert!(tables(desc) == tables(&other), "read in pieces it is another scene");
}
