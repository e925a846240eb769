//! Scene files to scene descriptions, one file a format.
//!
//! [`load`] reads a scene (glTF, OBJ, PLY, STL), [`load_environment`] a latitude-longitude map, [`load_ies`] a measured
//! luminaire. No input makes these panic; what a file has and vastlight does not support is named in the
//! [`vastlight_scene::Diagnostics`] of the result.

pub mod decode;
mod environment;
mod error;
mod format;
mod gltf;
mod ies;
mod limits;
mod number;
mod obj;
mod ply;
mod polygon;
mod scan;
mod single;
mod stl;
mod texels;

pub use environment::load_environment;
pub use error::{ErrorKind, ImportError};
pub use format::{SceneFormat, detect};
pub use gltf::validate as validate_gltf;
pub use ies::{load_ies, parse_ies};
pub use limits::Limits;
pub use texels::decode_image;

use single::single_mesh_scene;
use std::path::Path;
use vastlight_scene::SceneDesc;

/// How a scene file is read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// Bounds on what the file may ask for.
    pub limits: Limits,
    /// Which of a file's scenes to read, by name or number (glTF); `None` is the file's own choice.
    pub scene: Option<String>,
}

/// Reads a scene file. The format is found from the first bytes where they are unmistakable, else from the extension.
///
/// # Errors
/// The file cannot be read, is of an unknown format, malformed, or beyond the limits. Smaller defects are repaired and
/// stand in the diagnostics of the result.
pub fn load(path: &Path, options: &LoadOptions) -> Result<SceneDesc, ImportError> {
    match detect(path, &options.limits)? {
        SceneFormat::Gltf => gltf::load(path, options),
        SceneFormat::Ply => ply::load(path, options),
        SceneFormat::Obj => obj::load(path, options),
        SceneFormat::Stl => stl::load(path, options),
    }
}
