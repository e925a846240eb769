//! Scenes of one mesh, as mesh files describe them.

use crate::{ErrorKind, ImportError, Streamed};
use std::path::Path;
use vastlight_math::{Affine3, Vec3};
use vastlight_scene::{
    ColorInput, Diagnostics, Instance, LargeMesh, Material, Mesh, PieceInstance, ReadMesh, SceneDesc,
    SceneError, SceneStream,
};

/// A scene with `mesh` once, named after the file.
pub(crate) fn single_mesh_scene(mut mesh: Mesh, path: &Path, diagnostics: Diagnostics) -> SceneDesc {
    let desc = scene_around(path, !mesh.colors.is_empty(), diagnostics);
    mesh.name.clone_from(&desc.names[0]);
    SceneDesc {
        meshes: vec![mesh],
        instances: vec![Instance { world_from_object: Affine3::IDENTITY, mesh: 0, name: 0 }],
        ..desc
    }
}

/// The same scene with its mesh still in the file.
pub(crate) fn streamed_mesh(
    path: &Path,
    colored: bool,
    triangles: Option<u64>,
    diagnostics: Diagnostics,
    read: ReadMesh,
) -> Streamed {
    let desc = scene_around(path, colored, diagnostics);
    let name = desc.names[0].clone();
    let instances = vec![PieceInstance { world_from_object: Affine3::IDENTITY, name: 0 }];
    let large = vec![LargeMesh { name, parts: Vec::new(), instances, triangles, read }];
    Streamed { large, ..SceneStream::from(desc).into() }
}

fn scene_around(path: &Path, colored: bool, diagnostics: Diagnostics) -> SceneDesc {
    let name = path.file_stem().map_or_else(|| "mesh".to_owned(), |s| s.to_string_lossy().into_owned());
    let mut material = Material::new("neutral");
    if colored {
        material.base_color = ColorInput::new(Vec3::ONE);
    }
    SceneDesc { names: vec![name], materials: vec![material], diagnostics, ..SceneDesc::default() }
}

/// Why a mesh was not read to its end.
pub(crate) enum Stopped {
    /// The file is wrong.
    File(ImportError),
    /// Who takes the mesh has no room.
    Sink(SceneError),
}

impl Stopped {
    /// The error of a mesh that is read into memory.
    pub(crate) fn into_import(self) -> ImportError {
        match self {
            Self::File(error) => error,
            Self::Sink(SceneError { what, place, hint }) => {
                ImportError::new(ErrorKind::Limit, what, place).with_hint(hint)
            }
        }
    }
}

impl From<ImportError> for Stopped {
    fn from(error: ImportError) -> Self {
        Self::File(error)
    }
}

impl From<SceneError> for Stopped {
    fn from(error: SceneError) -> Self {
        Self::Sink(error)
    }
}

impl From<Stopped> for SceneError {
    fn from(stopped: Stopped) -> Self {
        match stopped {
            Stopped::File(error) => error.into(),
            Stopped::Sink(error) => error,
        }
    }
}

/// For tests: keeps what comes, and how much comes at once.
#[cfg(test)]
#[derive(Default)]
pub(crate) struct Blocks {
    pub(crate) mesh: Mesh,
    pub(crate) most_vertices: usize,
    pub(crate) most_triangles: usize,
    /// Refuses triangles beyond so many.
    pub(crate) room: usize,
}

#[cfg(test)]
impl vastlight_scene::MeshSink for Blocks {
    fn vertices(&mut self, block: &Mesh) -> Result<(), SceneError> {
        self.most_vertices = self.most_vertices.max(block.positions.len());
        self.mesh.vertices(block)
    }

    fn triangles(&mut self, block: &[[u32; 3]]) -> Result<(), SceneError> {
        self.most_triangles = self.most_triangles.max(block.len());
        if self.mesh.triangles.len() + block.len() > self.room {
            return Err(SceneError::new("there is no room", "a test", ""));
        }
        self.mesh.triangles(block)
    }

    fn position(&mut self, vertex: u32) -> Result<Vec3, SceneError> {
        self.mesh.position(vertex)
    }
}
