//! Scenes to files, one file a format: GLB, PLY, OBJ.
//!
//! [`write()`] and [`write_stream`] choose the format by the extension, stream to a file beside the target and rename it at the end. The
//! same scene gives the same bytes. What a format cannot hold is named in the [`Diagnostics`] that are returned:
//!
//! | | GLB | OBJ + MTL | PLY |
//! |---|---|---|---|
//! | meshes, instances | yes; instances are nodes | flattened to world space | one mesh in world space |
//! | normals, uvs | yes | yes (the first uv set) | yes (the first uv set) |
//! | vertex colours | yes | after the coordinates | 8 bits sRGB, times the material's colour |
//! | materials | yes, with KHR extensions; measured metals in `extras` | colours, roughness, metal, glass, textures | colour only |
//! | cameras, lights | yes, the lens in `extras`; without profile | no | no |
//! | sky, constant light | in `extras`, which the glTF importer reads | no | no |
//! | environment map | no | no | no |

mod error;
mod flatten;
mod glb;
mod obj;
mod ply;
mod png;
mod source;
mod target;

pub use error::ExportError;

use source::{Source, Streamed};
use std::path::Path;
use vastlight_scene::{Diagnostics, Scene, SceneError, SceneStream};

/// The extensions that [`write()`] knows, without the dot.
pub const FORMATS: [&str; 3] = ["glb", "ply", "obj"];

/// Writes `scene` to `path` in the format of its extension; returns what the format could not hold.
///
/// # Errors
/// The extension is none of [`FORMATS`], the scene is larger than the format allows or has implicit surfaces, or the file cannot be written.
/// The target is then left as it was.
pub fn write(scene: &Scene, path: &Path) -> Result<Diagnostics, ExportError> {
    if let Some(mesh) = scene.implicit_mesh() {
        return Err(ExportError::implicit(mesh));
    }
    write_source(scene, path)
}

/// What became of a stream.
#[derive(Clone, Debug)]
pub struct Written {
    /// What the format could not hold.
    pub lost: Diagnostics,
    /// Triangles of all instances.
    pub triangles: u64,
}

/// Writes a scene that comes mesh by mesh: a few meshes are in memory at a time, and for GLB 100 bytes or so a mesh
/// and an instance. `make` is called once for each walk through the scene (up to four) and must give the same each
/// time.
///
/// # Errors
/// As [`write()`], or the scene cannot be made.
pub fn write_stream(
    make: &dyn Fn() -> Result<SceneStream, SceneError>,
    path: &Path,
) -> Result<Written, ExportError> {
    let scene = Streamed::new(make)?;
    let lost = write_source(&scene, path)?;
    Ok(Written { lost, triangles: scene.placed() })
}

fn write_source(scene: &impl Source, path: &Path) -> Result<Diagnostics, ExportError> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    let mut lost = Diagnostics::default();
    match extension.as_str() {
        "glb" => glb::write(scene, path, &mut lost)?,
        "ply" => ply::write(scene, path, &mut lost)?,
        "obj" => obj::write(scene, path, &mut lost)?,
        _ => return Err(ExportError::format(path)),
    }
    Ok(lost)
}
