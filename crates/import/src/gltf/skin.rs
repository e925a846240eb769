//! Skins: vertices follow the joints' transforms, at rest or at a moment (linear blend skinning).

use super::accessor::Data;
use super::json::Json;
use super::node;
use super::primitive::{Influences, Surface};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use vastlight_math::glam::{DAffine3, DMat4};
use vastlight_math::{Affine3, Mat3, Vec3};

/// A skin's joints: the node of each, and its space from that of the mesh in its bind pose.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Skin {
    joints: Vec<(Option<usize>, DAffine3)>,
}

impl Skin {
    /// Reads a skin; a joint without a usable matrix gets that which changes nothing.
    pub(super) fn read(json: &Json<'_>, data: &Data) -> Self {
        let inverse_binds = json.index("inverseBindMatrices").and_then(|i| data.floats::<16>(i, 0.0).ok());
        let inverse_bind = |joint: usize| match inverse_binds.as_ref().and_then(|m| m.get(joint)) {
            Some(matrix) => DAffine3::from_mat4(DMat4::from_cols_array(&matrix.map(f64::from))),
            None => DAffine3::IDENTITY,
        };
        let joints = json.list("joints").iter().enumerate();
        Self { joints: joints.map(|(i, joint)| (joint.integer(), inverse_bind(i))).collect() }
    }

    /// The nodes that are joints.
    pub(super) fn nodes(&self) -> impl Iterator<Item = usize> {
        self.joints.iter().filter_map(|(node, _)| *node)
    }

    /// World space from the space of a mesh in its bind pose, for each joint. Joints outside of the scene stand at its origin.
    pub(super) fn matrices(&self, world_from_node: impl Fn(usize) -> Option<DAffine3>) -> Vec<Affine3> {
        let world = |node: Option<usize>| node.and_then(&world_from_node).unwrap_or(DAffine3::IDENTITY);
        self.joints.iter().map(|(node, from_bind)| node::to_f32(&(world(*node) * *from_bind))).collect()
    }
}

/// Moves the vertices of a surface to the world space of its joints.
pub(super) fn apply(surface: &mut Surface, influences: &[Influences], joints: &[Affine3]) {
    let vertices = surface.positions.len();
    let blended = |v: usize| {
        let weighted = influences
            .iter()
            .filter_map(|(joints, weights)| Some((joints.get(v)?, weights.get(v)?)))
            .flat_map(|(j, w)| j.iter().copied().zip(w.iter().copied()));
        blend(weighted, joints)
    };
    let blended: Vec<Option<Affine3>> =
        (0..vertices).into_par_iter().with_min_len(CHUNK).map(blended).collect();
    move_all(&mut surface.positions, &blended, |map, position| map.transform_point3(position));
    move_all(&mut surface.normals, &blended, |map, normal| transform_normal(map.matrix3, normal));
    move_all(&mut surface.tangents, &blended, |map, tangent| {
        let direction = map.transform_vector3(tangent.truncate());
        direction.normalize_or(tangent.truncate()).extend(tangent.w)
    });
}

/// Vertices that one thread moves at a time, at least.
const CHUNK: usize = 4096;

fn move_all<V: Copy + Send>(
    values: &mut [V],
    maps: &[Option<Affine3>],
    moved: impl Fn(&Affine3, V) -> V + Sync,
) {
    values.par_iter_mut().with_min_len(CHUNK).zip(maps).for_each(|(value, map)| {
        if let Some(map) = map {
            *value = moved(map, *value);
        }
    });
}

/// The weighted mean of joint matrices; `None` if no weight counts.
fn blend(weighted: impl Iterator<Item = (u32, f32)>, joints: &[Affine3]) -> Option<Affine3> {
    let mut sum = Affine3::from_mat3_translation(Mat3::ZERO, Vec3::ZERO);
    let mut total = 0.0;
    for (joint, weight) in weighted.filter(|(_, weight)| *weight > 0.0) {
        let Some(matrix) = joints.get(joint as usize) else { continue };
        sum.matrix3 += matrix.matrix3 * weight;
        sum.translation += matrix.translation * weight;
        total += weight;
    }
    if total <= 0.0 {
        return None;
    }
    sum.matrix3 *= 1.0 / total;
    sum.translation /= total;
    Some(sum)
}

/// The normal of a transformed surface: the inverse transpose up to a factor, kept on its side.
fn transform_normal(matrix: Mat3, normal: Vec3) -> Vec3 {
    let (x, y, z) = (matrix.x_axis, matrix.y_axis, matrix.z_axis);
    let cofactors = Mat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    let side = if x.dot(y.cross(z)) < 0.0 { -1.0 } else { 1.0 };
    (cofactors * normal * side).normalize_or(normal)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_stay_perpendicular_under_uneven_scale_and_mirrors() {
        for scale in [Vec3::new(1.0, 3.0, 0.5), Vec3::new(-1.0, 3.0, 0.5)] {
            let matrix = Mat3::from_diagonal(scale);
            let (normal, along) = (Vec3::new(0.6, 0.8, 0.0), Vec3::new(-0.8, 0.6, 0.3));
            let along = along - normal * normal.dot(along);
            let moved = transform_normal(matrix, normal);
            assert!(moved.dot(matrix * along).abs() < 1e-6);
            assert!(moved.dot(matrix * normal) > 0.0);
        }
    }
}
