//! Scenes of one mesh, as mesh files describe them.

use std::path::Path;
use vastlight_math::{Affine3, Vec3};
use vastlight_scene::{ColorInput, Diagnostics, Instance, Material, Mesh, SceneDesc};

/// A scene with `mesh` once, named after the file.
pub(crate) fn single_mesh_scene(mut mesh: Mesh, path: &Path, diagnostics: Diagnostics) -> SceneDesc {
    let name = path.file_stem().map_or_else(|| "mesh".to_owned(), |s| s.to_string_lossy().into_owned());
    mesh.name.clone_from(&name);
    let mut material = Material::new("neutral");
    if !mesh.colors.is_empty() {
        material.base_color = ColorInput::new(Vec3::ONE);
    }
    SceneDesc {
        meshes: vec![mesh],
        instances: vec![Instance { world_from_object: Affine3::IDENTITY, mesh: 0, name: 0 }],
        names: vec![name],
        materials: vec![material],
        diagnostics,
        ..SceneDesc::default()
    }
}
