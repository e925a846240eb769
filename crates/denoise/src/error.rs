//! What can go wrong with the denoiser.

use std::path::PathBuf;

/// Why a picture could not be denoised.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DenoiseError {
    /// No library could be loaded.
    #[error("Open Image Denoise cannot be loaded, looked for {}: {why}", list(looked_for))]
    Missing {
        /// Where it was looked for: files, or names in the system's folders of libraries.
        looked_for: Vec<PathBuf>,
        /// What the system says of the last of them.
        why: String,
    },
    /// A library was loaded that lacks a function.
    #[error("{} is no Open Image Denoise 1 or 2: it has no {function}", library.display())]
    Foreign {
        /// The library.
        library: PathBuf,
        /// The function.
        function: &'static str,
    },
    /// The library reports an error.
    #[error("Open Image Denoise failed: {0}")]
    Failed(String),
    /// The planes of a picture are not as long as it has pixels, or there are none.
    #[error("a plane of the picture has not {0} pixels")]
    Shape(usize),
}

impl DenoiseError {
    /// What a user can do.
    #[must_use]
    pub fn hint(&self) -> &'static str {
        match self {
            Self::Missing { .. } | Self::Foreign { .. } => {
                "install Open Image Denoise 2, set VASTLIGHT_OIDN to its library or folder, or leave --denoise out"
            }
            Self::Failed(_) => "leave --denoise out",
            Self::Shape(_) => "",
        }
    }
}

fn list(paths: &[PathBuf]) -> String {
    paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ")
}
