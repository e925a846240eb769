//! Which surfaces rays may pass: by alpha, or because they are window panes.

use crate::material::MaterialTable;
use vastlight_scene::{Mesh, Scene};
use vastlight_trace::Hit;

/// How a surface may let rays pass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Veils {
    /// By alpha: any ray.
    pub(crate) alpha: bool,
    /// As a smooth thin wall: shadow rays.
    pub(crate) pane: bool,
}

impl Veils {
    fn or(self, other: Self) -> Self {
        Self { alpha: self.alpha || other.alpha, pane: self.pane || other.pane }
    }
}

/// The veils of a scene, by material and by mesh.
#[derive(Clone, Debug)]
pub(crate) struct VeilIndex {
    materials: Vec<Veils>,
    /// Per mesh: those of all its materials together.
    meshes: Vec<Veils>,
    all: Veils,
}

impl VeilIndex {
    pub(crate) fn new(scene: &Scene, table: &MaterialTable<'_>) -> Self {
        let materials: Vec<Veils> = (0..scene.materials().len() as u32)
            .map(|m| Veils { alpha: table.has_alpha(m), pane: table.may_be_pane(m) })
            .collect();
        let of_mesh = |mesh: &Mesh| match mesh.parts.as_slice() {
            [] => materials[0],
            parts => parts.iter().map(|p| materials[p.material as usize]).fold(Veils::default(), Veils::or),
        };
        let meshes: Vec<Veils> = scene.meshes().iter().map(of_mesh).collect();
        let all = meshes.iter().copied().fold(Veils::default(), Veils::or);
        Self { materials, meshes, all }
    }

    /// Whether rays may pass some surface of a mesh.
    pub(crate) fn has_veils(&self, mesh: usize) -> bool {
        self.meshes[mesh] != Veils::default()
    }

    /// Those of all surfaces together.
    pub(crate) fn any(&self) -> Veils {
        self.all
    }

    /// Those of the surface at a hit.
    pub(crate) fn of(&self, scene: &Scene, hit: &Hit) -> Veils {
        let mesh = scene.instances().mesh(hit.instance as usize) as usize;
        if self.meshes[mesh] == Veils::default() {
            return Veils::default();
        }
        self.materials[scene.meshes()[mesh].material_of(hit.prim) as usize]
    }
}
