//! Alpha as a filter of hits: a masked or blended surface is there, or it is not, for a whole ray.
//!
//! Blending is stochastic: the hit counts with probability alpha, decided by a hash of the sample and the triangle.
//! The expected picture is the exact blend in any order of surfaces, and no ray needs to be continued or sorted.

use crate::material::MaterialTable;
use crate::surface::attributes;
use vastlight_math::rng::hash_to_unit;
use vastlight_scene::Scene;
use vastlight_trace::{Hit, HitFilter};

/// Which parts of a scene have alpha at all.
#[derive(Clone, Debug)]
pub(crate) struct AlphaIndex {
    /// Per mesh: whether any of its triangles has a material with alpha.
    meshes: Vec<bool>,
}

impl AlphaIndex {
    pub(crate) fn new(scene: &Scene) -> Self {
        let has_alpha = |m: u32| scene.materials()[m as usize].has_alpha();
        let mesh_has_alpha = |mesh: &vastlight_scene::Mesh| match mesh.parts.as_slice() {
            [] => has_alpha(0),
            parts => parts.iter().any(|p| has_alpha(p.material)),
        };
        Self { meshes: scene.meshes().iter().map(mesh_has_alpha).collect() }
    }

    /// Whether there is any alpha to look at.
    pub(crate) fn any(&self) -> bool {
        self.meshes.contains(&true)
    }
}

/// Accepts hits by alpha. `keys` has a number for each ray of the batch, the same for the same sample and vertex.
#[derive(Debug)]
pub(crate) struct AlphaFilter<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) materials: &'a MaterialTable<'a>,
    pub(crate) index: &'a AlphaIndex,
    pub(crate) keys: &'a [u32],
}

impl HitFilter for AlphaFilter<'_> {
    fn accepts(&self, ray: usize, hit: &Hit) -> bool {
        let mesh = self.scene.instances()[hit.instance as usize].mesh;
        if !self.index.meshes[mesh as usize] {
            return true;
        }
        let material = self.scene.meshes()[mesh as usize].material_of(hit.prim);
        if !self.materials.has_alpha(material) {
            return true;
        }
        let point = attributes(self.scene, hit, self.materials.uv_sets(material));
        let alpha = self.materials.alpha(material, &point);
        alpha >= 1.0 || (alpha > 0.0 && hash_to_unit(&[self.keys[ray], hit.instance, hit.prim]) < alpha)
    }
}
