//! What writers read: a scene in memory, or one that is made mesh by mesh each time it is walked through.

use crate::ExportError;
use std::cell::Cell;
use vastlight_scene::{
    Instances, Mesh, MeshPreparation, Piece, PieceInstance, Scene, SceneError, SceneStream, can_be_placed,
};

/// What is done with a mesh and its placements.
pub(crate) type Visit<'a> = dyn FnMut(&Mesh, &[PieceInstance]) -> Result<(), ExportError> + 'a;

/// A scene that can be walked through more than once, the same each time.
pub(crate) trait Source {
    /// Everything but meshes and instances, which it may hold or not.
    fn tables(&self) -> &Scene;

    /// Triangles of all meshes, each once, where that is known without a walk.
    fn triangles(&self) -> Option<u64>;

    /// Walks through the meshes; those of a stream come with their placements.
    fn meshes(&self, visit: &mut Visit<'_>) -> Result<(), ExportError>;

    /// Walks through the placements, one or more of a mesh at a time.
    fn placements(&self, visit: &mut Visit<'_>) -> Result<(), ExportError>;

    /// All placements, if they are in memory.
    fn instances(&self) -> Option<&Instances>;
}

impl Source for Scene {
    fn tables(&self) -> &Scene {
        self
    }

    fn triangles(&self) -> Option<u64> {
        Some(self.unique_triangles())
    }

    fn meshes(&self, visit: &mut Visit<'_>) -> Result<(), ExportError> {
        Self::meshes(self).iter().try_for_each(|mesh| visit(mesh, &[]))
    }

    fn placements(&self, visit: &mut Visit<'_>) -> Result<(), ExportError> {
        Self::instances(self).iter().try_for_each(|i| {
            let place = PieceInstance { world_from_object: i.world_from_object, name: i.name };
            visit(&Self::meshes(self)[i.mesh as usize], &[place])
        })
    }

    fn instances(&self) -> Option<&Instances> {
        Some(Self::instances(self))
    }
}

/// Makes the stream once more.
pub(crate) type Make<'a> = dyn Fn() -> Result<SceneStream, SceneError> + 'a;

/// A scene that is made again for each walk.
pub(crate) struct Streamed<'a> {
    make: &'a Make<'a>,
    tables: Scene,
    preparation: MeshPreparation,
    triangles: Option<u64>,
    placed: Cell<u64>,
}

impl<'a> Streamed<'a> {
    pub(crate) fn new(make: &'a Make<'a>) -> Result<Self, ExportError> {
        let SceneStream { mut desc, triangles, rows, .. } = make()?;
        rows.iter().try_for_each(|rows| rows.fill(&mut desc))?;
        let tables = Scene::new(desc)?;
        let preparation = MeshPreparation::new(tables.desc());
        Ok(Self { make, tables, preparation, triangles, placed: Cell::new(0) })
    }

    /// Triangles of all placements that the last walk found.
    pub(crate) fn placed(&self) -> u64 {
        self.placed.get()
    }

    fn prepared(&self, piece: Result<Piece, SceneError>) -> Result<Piece, ExportError> {
        let mut piece = piece?;
        if piece.mesh.implicit.is_some() {
            return Err(ExportError::implicit(&piece.mesh));
        }
        self.preparation.prepare(&mut piece.mesh)?;
        piece.instances.retain(|i| can_be_placed(&i.world_from_object));
        let names = self.tables.desc().names.len();
        match piece.instances.iter().find(|i| i.name as usize >= names) {
            Some(i) => {
                Err(SceneError::new(format!("name {} does not exist", i.name), "instances", "").into())
            }
            None => Ok(piece),
        }
    }
}

impl Source for Streamed<'_> {
    fn tables(&self) -> &Scene {
        &self.tables
    }

    fn triangles(&self) -> Option<u64> {
        self.triangles
    }

    fn meshes(&self, visit: &mut Visit<'_>) -> Result<(), ExportError> {
        self.placed.set(0);
        for piece in (self.make)()?.pieces {
            let piece = self.prepared(piece)?;
            let triangles = piece.mesh.triangles.len() as u64 * piece.instances.len() as u64;
            self.placed.set(self.placed.get() + triangles);
            visit(&piece.mesh, &piece.instances)?;
        }
        Ok(())
    }

    fn placements(&self, visit: &mut Visit<'_>) -> Result<(), ExportError> {
        self.meshes(visit)
    }

    fn instances(&self) -> Option<&Instances> {
        None
    }
}
