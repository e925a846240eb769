//! What is packed: scenes mesh by mesh, meshes block by block, and where they came from.

use vastlight_scene::{LargeMesh, SceneDesc, SceneStream};
use vastlight_store::SourceFile;

/// A scene on its way to a store.
#[derive(Debug)]
pub struct PackInput {
    /// What comes mesh by mesh.
    pub stream: SceneStream,
    /// Meshes that come block by block, behind those of `stream`.
    pub large: Vec<LargeMesh>,
    /// What the scene is made of; none for a scene that a program made, which cannot go on after it was stopped.
    pub sources: Vec<SourceFile>,
    /// How the sources were read and changed: part of what says whether a stopped pack can go on.
    pub settings: String,
    /// Bytes that the input itself holds in memory.
    pub held_bytes: u64,
}

impl PackInput {
    /// Triangles of all meshes, each counted once, if that is known.
    #[must_use]
    pub fn triangles(&self) -> Option<u64> {
        let large = self.large.iter().try_fold(0, |sum: u64, mesh| Some(sum + mesh.triangles?))?;
        Some(self.stream.triangles? + large)
    }
}

impl From<SceneStream> for PackInput {
    fn from(stream: SceneStream) -> Self {
        Self { stream, large: Vec::new(), sources: Vec::new(), settings: String::new(), held_bytes: 0 }
    }
}

impl From<SceneDesc> for PackInput {
    fn from(desc: SceneDesc) -> Self {
        SceneStream::from(desc).into()
    }
}
