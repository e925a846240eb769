//! Scene files to scene descriptions, one file a format.
//!
//! [`load`] reads a scene (glTF, OBJ, PLY, STL), [`load_environment`] a latitude-longitude map, [`load_ies`] a measured
//! luminaire. No input makes these panic; what a file has and vastlight does not support is named in the
//! [`vastlight_scene::Diagnostics`] of the result.

mod blob;
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
mod sequence;
mod single;
mod stl;
mod texels;

pub use environment::load_environment;
pub use error::{ErrorKind, ImportError};
pub use format::{SceneFormat, detect};
pub use gltf::{motion as gltf_motion, validate as validate_gltf};
pub use ies::{load_ies, parse_ies};
pub use limits::Limits;
pub use sequence::files_of;
pub use texels::decode_image;

use single::single_mesh_scene;
use std::path::{Path, PathBuf};
use texels::Deferral;
use vastlight_scene::{LargeMesh, SceneDesc, SceneError, SceneStream};

/// How a scene file is read.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadOptions {
    /// Bounds on what the file may ask for.
    pub limits: Limits,
    /// Which of a file's scenes to read, by name or number (glTF); `None` is the file's own choice.
    pub scene: Option<String>,
    /// Which of a file's animations moves the scene, by name or number (glTF); `None` is the first.
    pub animation: Option<String>,
    /// Files a second of a sequence of files.
    pub sequence_fps: f32,
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self { limits: Limits::default(), scene: None, animation: None, sequence_fps: 24.0 }
    }
}

/// Reads a scene file. The format is found from the first bytes where they are unmistakable, else from the extension.
///
/// A run of `#` in a file's name stands for the digits of numbers: the files of all numbers are one scene that moves, at rest as the
/// first of them (OBJ and PLY).
///
/// # Errors
/// The file cannot be read, is of an unknown format, malformed, or beyond the limits. Smaller defects are repaired and
/// stand in the diagnostics of the result.
pub fn load(path: &Path, options: &LoadOptions) -> Result<SceneDesc, ImportError> {
    load_with_files(path, options).map(|(desc, _)| desc)
}

/// The scene of [`load`], and the files that its file names: buffers, material libraries, images.
///
/// # Errors
/// Those of [`load`].
pub fn load_with_files(path: &Path, options: &LoadOptions) -> Result<(SceneDesc, Vec<PathBuf>), ImportError> {
    if let Some(files) = sequence::Files::find(path, &options.limits)? {
        return sequence::load(files, options);
    }
    match detect(path, &options.limits)? {
        SceneFormat::Gltf => gltf::load(path, options),
        SceneFormat::Ply => Ok((ply::load(path, options)?, Vec::new())),
        SceneFormat::Obj => obj::read(path, options, &mut Deferral::never()),
        SceneFormat::Stl => Ok((stl::load(path, options)?, Vec::new())),
    }
}

/// A scene that is still in its file.
#[derive(Debug)]
pub struct Streamed {
    /// What comes mesh by mesh.
    pub stream: SceneStream,
    /// What comes block by block, behind the meshes of `stream`.
    pub large: Vec<LargeMesh>,
    /// Files that the scene's file names: buffers, material libraries, images.
    pub files: Vec<PathBuf>,
}

impl Streamed {
    /// The whole scene. Instances stand in the order of their meshes, those of `large` behind the others.
    ///
    /// # Errors
    /// The first error of the pieces.
    pub fn collect(self) -> Result<SceneDesc, SceneError> {
        let mut desc = self.stream.collect()?;
        for large in self.large {
            let instances = large.instances.clone();
            desc.push_placed(large.collect()?, &instances);
        }
        Ok(desc)
    }
}

/// A scene that comes from no file.
impl From<SceneStream> for Streamed {
    fn from(stream: SceneStream) -> Self {
        Self { stream, large: Vec::new(), files: Vec::new() }
    }
}

/// A scene file mesh by mesh, or block by block, and large images row by row; what cannot come so is read as a whole. The scene is
/// that of [`load`], at rest.
///
/// # Errors
/// Those of [`load`], as far as they can be known already; the others come with the meshes.
pub fn stream(path: &Path, options: &LoadOptions) -> Result<Streamed, ImportError> {
    let path = &sequence::first_file(path, &options.limits)?;
    match detect(path, &options.limits)? {
        SceneFormat::Ply => ply::stream(path, options),
        SceneFormat::Gltf => gltf::stream(path, options),
        SceneFormat::Obj => {
            let mut deferral = Deferral::of_large();
            let (desc, files) = obj::read(path, options, &mut deferral)?;
            let stream = SceneStream { rows: deferral.rows, ..desc.into() };
            Ok(Streamed { files, ..stream.into() })
        }
        SceneFormat::Stl => stl::stream(path, options),
    }
}

/// How large a scene file is, as far as it says before it is read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FileSize {
    /// Bytes that [`stream`] holds at most beside images that are decoded at once.
    pub streaming_bytes: u64,
    /// Bytes that it holds besides while images that come row by row are looked through, before the first mesh is made.
    pub image_working_bytes: u64,
    /// About how many triangles there are at least, each mesh counted once.
    pub triangles: u64,
    /// Placements of meshes, where there are many.
    pub instances: u64,
    /// Bytes of all decoded images; 0 for OBJ, whose libraries nobody has read yet.
    pub image_bytes: u64,
}

/// Looks at headers and the sizes of files.
///
/// # Errors
/// The file cannot be read, or is of an unknown format.
pub fn file_size(path: &Path, options: &LoadOptions) -> Result<FileSize, ImportError> {
    let path = &sequence::first_file(path, &options.limits)?;
    let format = detect(path, &options.limits)?;
    Ok(match format {
        SceneFormat::Ply => ply::file_size(path, options)?,
        SceneFormat::Obj => obj::file_size(path)?,
        SceneFormat::Stl => stl::file_size(path, options)?,
        SceneFormat::Gltf => gltf::file_size(path, options)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn size(name: &str, bytes: &[u8]) -> FileSize {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).expect("written");
        file_size(&path, &LoadOptions::default()).expect("read")
    }

    #[test]
    fn the_size_of_a_mesh_is_known_before_it_is_read() {
        let known =
            |streaming_bytes, triangles| FileSize { streaming_bytes, triangles, ..FileSize::default() };
        let ply = |elements: &str| {
            let vertices = "element vertex 0\nproperty float x\nproperty float y\nproperty float z\n";
            let text = format!("ply\nformat ascii 1.0\n{vertices}{elements}end_header\n");
            (size("a.ply", text.as_bytes()), text.len() as u64)
        };
        assert_eq!(ply("element face 7\n").0, known(0, 7));
        let many = "element face 900000000000000000\n";
        assert_eq!(ply(&many.repeat(21)).0, known(0, u64::MAX));
        let (strips, bytes) = ply("element tristrips 1\n");
        assert_eq!(strips, known(4 * bytes, 0));
        assert_eq!(size("a.obj", &[b'#'; 1000]), known(3000, 10));
        assert_eq!(size("a.stl", &[0; 84 + 50 * 9]), known(2 * (84 + 50 * 9), 10));
        let text = [b"solid a\nfacet ".as_slice(), &vec![b' '; 41 << 20]].concat();
        assert_eq!(size("a.stl", &text), known(80 << 20, text.len() as u64 / 250));
    }
}
