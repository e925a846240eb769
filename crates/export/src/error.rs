//! Why a scene could not be written.

use std::path::Path;
use vastlight_scene::Mesh;

/// Why a scene could not be written: what, where, and a hint.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// No format has this extension.
    #[error("{place}: no scene format is written under this extension (there are .glb, .ply, .obj)")]
    Format {
        /// The file.
        place: String,
    },
    /// The scene is larger than the format can address.
    #[error("{place}: {what} ({hint})")]
    TooLarge {
        /// The file.
        place: String,
        /// What is too large, with its size and the limit.
        what: String,
        /// What to do instead.
        hint: String,
    },
    /// A surface has no triangles.
    #[error(
        "{place}: an implicit surface cannot be written (render the scene itself, such as demo:metaballs)"
    )]
    Implicit {
        /// The surface.
        place: String,
    },
    /// The file cannot be written.
    #[error("{place}: {source}")]
    Io {
        /// The file.
        place: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// The scene cannot be made.
    #[error(transparent)]
    Scene(#[from] vastlight_scene::SceneError),
    /// A texture cannot be encoded.
    #[error("{place}: the image cannot be encoded: {source}")]
    Image {
        /// The image.
        place: String,
        /// What the encoder said.
        source: image::ImageError,
    },
}

impl ExportError {
    pub(crate) fn format(path: &Path) -> Self {
        Self::Format { place: path.display().to_string() }
    }

    pub(crate) fn implicit(mesh: &Mesh) -> Self {
        Self::Implicit { place: format!("mesh \"{}\"", mesh.name) }
    }

    pub(crate) fn io(path: &Path, source: std::io::Error) -> Self {
        Self::Io { place: path.display().to_string(), source }
    }

    pub(crate) fn too_large(path: &Path, what: String, hint: &str) -> Self {
        Self::TooLarge { place: path.display().to_string(), what, hint: hint.into() }
    }
}
