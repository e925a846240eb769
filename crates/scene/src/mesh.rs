//! Triangle meshes.

use crate::ImplicitShape;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use vastlight_math::{Aabb, Vec2, Vec3, Vec4};

/// A run of a mesh's triangles that share one material.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Part {
    /// Index of the run's first triangle. Runs follow each other without gaps, the first starts at 0.
    pub first_triangle: u32,
    /// Index into [`crate::SceneDesc::materials`].
    pub material: u32,
}

/// A triangle mesh in its object's space.
///
/// Attribute arrays are either empty (absent) or as long as `positions`. Where normals are absent the surface is
/// flat; where a material looks at tangents that are absent, they are derived from texture coordinates.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Mesh {
    /// Name, for messages, object ids and overrides.
    pub name: String,
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Three vertex indices a triangle; counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Unit shading normals, or empty.
    pub normals: Vec<Vec3>,
    /// Unit tangents with the bitangent's sign in `w` (glTF's convention), or empty; zero where a file has none, until
    /// the scene derives them.
    pub tangents: Vec<Vec4>,
    /// Texture coordinate sets; each as long as `positions`. `v` grows downwards (glTF's convention).
    pub uvs: Vec<Vec<Vec2>>,
    /// Linear RGBA that multiplies the base colour, or empty.
    pub colors: Vec<Vec4>,
    /// Material runs; empty means material 0 for all triangles.
    pub parts: Vec<Part>,
    /// A surface without triangles; then there are no triangles, and the material is that of triangle 0. No store and no
    /// file format holds it.
    #[serde(skip)]
    pub implicit: Option<Arc<ImplicitShape>>,
}

impl Mesh {
    /// The box around the implicit surface, or around all vertices that triangles use; empty without either.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        if let Some(shape) = &self.implicit {
            return shape.bounds();
        }
        Aabb::from_points(self.triangles.iter().flatten().map(|&i| self.positions[i as usize]))
    }

    /// The material of a triangle.
    #[inline]
    #[must_use]
    pub fn material_of(&self, triangle: u32) -> u32 {
        match self.parts.partition_point(|p| p.first_triangle <= triangle) {
            0 => 0,
            n => self.parts[n - 1].material,
        }
    }

    /// The three corners of a triangle.
    #[inline]
    #[must_use]
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.triangles[triangle as usize].map(|i| self.positions[i as usize])
    }
}
