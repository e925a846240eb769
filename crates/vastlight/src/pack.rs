//! From a scene, mesh by mesh, to a store.

use crate::{Error, textures};
use rayon::prelude::*;
use std::path::Path;
use vastlight_accel::Scratch;
use vastlight_scene::{
    Instance, Material, Mesh, MeshPreparation, Piece, Scene, SceneDesc, SceneError, SceneStream,
};
use vastlight_store::{PackConfig, PackedMesh, StoreSize, StoreWriter};

/// Triangles of meshes that are packed side by side.
const TOGETHER: usize = 1 << 19;

/// Packs a scene to a store at `target`; `progress` is told the triangles so far. The same scene gives the same bytes.
///
/// # Errors
/// If the scene is wrong, or the store cannot be written: the target is then left as it was.
pub fn pack(
    stream: SceneStream,
    target: &Path,
    config: &PackConfig,
    mut progress: impl FnMut(u64),
) -> Result<StoreSize, Error> {
    let SceneStream { mut desc, pieces, rows, .. } = stream;
    if let Some(error) = desc.diagnostics.first_error() {
        return Err(SceneError::from(error.clone()).into());
    }
    if desc.materials.is_empty() {
        desc.materials.push(Material::new("neutral"));
    }
    let preparation = MeshPreparation::new(&desc);
    let mut writer = StoreWriter::create(target)?;
    textures::pack(&mut desc, rows, config.tile_bytes, &mut writer)?;
    let mut packing = Packing { desc, preparation, config, writer };
    let (mut waiting, mut triangles, mut done) = (Vec::new(), 0, 0);
    for piece in pieces {
        let piece = piece?;
        triangles += piece.mesh.triangles.len();
        waiting.push(piece);
        if triangles >= TOGETHER {
            packing.add(&mut waiting)?;
            done += std::mem::take(&mut triangles) as u64;
            progress(done);
        }
    }
    packing.add(&mut waiting)?;
    progress(done + triangles as u64);
    let Packing { desc, writer, .. } = packing;
    let scene = Scene::with_meshes_elsewhere(desc, writer.extents().to_vec())?;
    Ok(writer.finish(&scene)?)
}

struct Packing<'c> {
    /// All that is known so far, geometry only of meshes that shine.
    desc: SceneDesc,
    preparation: MeshPreparation,
    config: &'c PackConfig,
    writer: StoreWriter,
}

impl Packing<'_> {
    /// Packs pieces side by side and adds them in their order.
    fn add(&mut self, pieces: &mut Vec<Piece>) -> Result<(), Error> {
        let (preparation, config) = (&self.preparation, self.config);
        let prepare = |scratch: &mut Scratch, piece: &mut Piece| {
            let found = preparation.prepare(&mut piece.mesh)?;
            Ok::<_, Error>((found, PackedMesh::new(&piece.mesh, config, scratch)?))
        };
        let packed: Vec<_> = pieces.par_iter_mut().map_init(Scratch::default, prepare).collect();
        for (piece, packed) in pieces.drain(..).zip(packed) {
            let (found, mesh) = packed?;
            found.into_iter().for_each(|diagnostic| self.desc.diagnostics.push(diagnostic));
            self.writer.add(&mesh)?;
            self.describe(piece);
        }
        Ok(())
    }

    /// Keeps what is resident of a piece.
    fn describe(&mut self, piece: Piece) {
        let Piece { mesh, instances } = piece;
        let number = self.desc.meshes.len() as u32;
        let shines = materials_of(&mesh).any(|material| self.desc.materials[material as usize].is_emissive());
        self.desc.meshes.push(if shines {
            mesh
        } else {
            Mesh { name: mesh.name, parts: mesh.parts, ..Mesh::default() }
        });
        self.desc.instances.extend(instances.iter().map(|i| Instance {
            world_from_object: i.world_from_object,
            mesh: number,
            name: i.name,
        }));
    }
}

/// The materials of a mesh.
pub(crate) fn materials_of(mesh: &Mesh) -> impl Iterator<Item = u32> {
    let default = mesh.parts.is_empty().then_some(0);
    default.into_iter().chain(mesh.parts.iter().map(|part| part.material))
}
