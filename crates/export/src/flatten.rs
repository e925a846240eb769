//! Instances as world-space vertices, one instance at a time.

use vastlight_math::{Affine3, Mat3, Vec3};
use vastlight_scene::{Mesh, PieceInstance};

/// An instance's mesh in world space.
pub(crate) struct Placed<'a> {
    pub(crate) mesh: &'a Mesh,
    world_from_object: Affine3,
    normal_map: Mat3,
    mirrored: bool,
}

impl<'a> Placed<'a> {
    pub(crate) fn new(mesh: &'a Mesh, instance: &PieceInstance) -> Self {
        let world_from_object = instance.world_from_object;
        Self {
            mesh,
            world_from_object,
            normal_map: world_from_object.matrix3.inverse().transpose(),
            mirrored: world_from_object.matrix3.determinant() < 0.0,
        }
    }

    pub(crate) fn position(&self, vertex: usize) -> Vec3 {
        self.world_from_object.transform_point3(self.mesh.positions[vertex])
    }

    /// The shading normal, if the mesh has them.
    pub(crate) fn normal(&self, vertex: usize) -> Option<Vec3> {
        let normal = self.mesh.normals.get(vertex)?;
        Some((self.normal_map * *normal).normalize_or_zero())
    }

    /// A triangle whose front stays its front even if the instance mirrors.
    pub(crate) fn triangle(&self, triangle: usize) -> [u32; 3] {
        let [a, b, c] = self.mesh.triangles[triangle];
        if self.mirrored { [a, c, b] } else { [a, b, c] }
    }
}
