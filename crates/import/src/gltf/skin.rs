//! Skins: vertices follow the joints' transforms at rest, once at load (linear blend skinning).

use super::accessor::Data;
use super::json::Json;
use super::node;
use super::primitive::Surface;
use vastlight_math::glam::{DAffine3, DMat4};
use vastlight_math::{Affine3, Mat3, Vec3};

/// World space from the space of a mesh in its bind pose, for each joint of a skin.
pub(super) fn joint_matrices(
    skin: &Json<'_>,
    data: &Data,
    world_from_node: &[Option<DAffine3>],
) -> Vec<Affine3> {
    let inverse_binds = skin.index("inverseBindMatrices").and_then(|i| data.floats::<16>(i, 0.0).ok());
    let inverse_bind = |joint: usize| match inverse_binds.as_ref().and_then(|m| m.get(joint)) {
        Some(matrix) => DAffine3::from_mat4(DMat4::from_cols_array(&matrix.map(f64::from))),
        None => DAffine3::IDENTITY,
    };
    let joints = skin.list("joints").iter().enumerate();
    let matrix = |(i, joint): (usize, &Json<'_>)| {
        let world = joint.integer().and_then(|j| world_from_node.get(j).copied().flatten());
        node::to_f32(&(world.unwrap_or(DAffine3::IDENTITY) * inverse_bind(i)))
    };
    joints.map(matrix).collect()
}

/// Moves the vertices of a surface to the world space of its joints.
pub(super) fn apply(surface: &mut Surface, joints: &[Affine3]) {
    let influences = std::mem::take(&mut surface.influences);
    for v in 0..surface.positions.len() {
        let weighted = influences
            .iter()
            .filter_map(|(joints, weights)| Some((joints.get(v)?, weights.get(v)?)))
            .flat_map(|(j, w)| j.iter().copied().zip(w.iter().copied()));
        let Some(world_from_bind) = blend(weighted, joints) else { continue };
        surface.positions[v] = world_from_bind.transform_point3(surface.positions[v]);
        if let Some(normal) = surface.normals.get_mut(v) {
            *normal = transform_normal(world_from_bind.matrix3, *normal);
        }
        if let Some(tangent) = surface.tangents.get_mut(v) {
            let direction = world_from_bind.transform_vector3(tangent.truncate());
            *tangent = direction.normalize_or(tangent.truncate()).extend(tangent.w);
        }
    }
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
