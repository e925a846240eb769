//! The plain description of a scene.

use crate::{Camera, Diagnostics, Environment, Image, Light, Material, Mesh, Motion, Texture};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use vastlight_math::Affine3;

/// One placement of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Instance {
    /// Object space to world space. A mirrored placement (negative determinant) keeps the mesh's outside outside.
    pub world_from_object: Affine3,
    /// Index into [`SceneDesc::meshes`].
    pub mesh: u32,
    /// Index into [`SceneDesc::names`].
    pub name: u32,
}

/// A scene as an importer, a generator or a program describes it: plain data, indices between tables, unchecked.
///
/// Right-handed, y up, metres. Colours are linear Rec. 709 (sRGB primaries). Everything that a file had and this
/// project does not support stands in `diagnostics`.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct SceneDesc {
    /// Meshes; shared by instances.
    pub meshes: Vec<Mesh>,
    /// Placements of meshes.
    pub instances: Vec<Instance>,
    /// Names that instances refer to (a million instances share few names).
    pub names: Vec<String>,
    /// Materials; may be empty, then a neutral one is added.
    pub materials: Vec<Material>,
    /// Textures: an image with the way it is sampled.
    pub textures: Vec<Texture>,
    /// Decoded images.
    pub images: Vec<Image>,
    /// Point, spot and directional lights. Area lights are emissive materials.
    pub lights: Vec<Light>,
    /// Cameras; may be empty, then one is framed around the bounds.
    pub cameras: Vec<Camera>,
    /// Light from infinity; `None` where the file says nothing (a scene without any light then gets a sky).
    pub environment: Option<Environment>,
    /// What moves; the tables hold the scene at rest. A store keeps its [record](crate::Motion::record) beside the description.
    #[serde(skip)]
    pub motion: Option<Arc<dyn Motion>>,
    /// What was found while importing.
    pub diagnostics: Diagnostics,
}
