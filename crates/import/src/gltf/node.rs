//! The node hierarchy: which mesh, camera and light stands where.

use super::accessor::Data;
use super::findings::Findings;
use super::json::Json;
use vastlight_math::Affine3;
use vastlight_math::glam::{DAffine3, DMat4, DQuat, DVec3};

/// A node of the chosen scene with its place in the world.
#[derive(Clone, Debug)]
pub(super) struct Placed {
    pub(super) node: usize,
    pub(super) world_from_node: DAffine3,
}

/// A node's transform relative to its parent.
pub(super) fn local_transform(node: &Json<'_>) -> DAffine3 {
    if let Some(matrix) = node.doubles::<16>("matrix") {
        return DAffine3::from_mat4(DMat4::from_cols_array(&matrix));
    }
    let translation = node.doubles("translation").map_or(DVec3::ZERO, DVec3::from_array);
    let rotation = node.doubles("rotation").map_or(DQuat::IDENTITY, DQuat::from_array);
    let scale = node.doubles("scale").map_or(DVec3::ONE, DVec3::from_array);
    let rotation = if rotation.length_squared() > 0.0 { rotation.normalize() } else { DQuat::IDENTITY };
    DAffine3::from_scale_rotation_translation(scale, rotation, translation)
}

/// All nodes below `roots`, parents before children, in file order. A node that is reached twice is placed once, so
/// that a loop ends.
pub(super) fn place(root: &Json<'_>, roots: &[usize]) -> Vec<Placed> {
    let nodes = root.list("nodes");
    let mut seen = vec![false; nodes.len()];
    let mut stack: Vec<(usize, DAffine3)> = roots.iter().rev().map(|&i| (i, DAffine3::IDENTITY)).collect();
    let mut placed = Vec::new();
    while let Some((index, world_from_parent)) = stack.pop() {
        let Some(node) = nodes.get(index).filter(|_| !seen[index]) else { continue };
        seen[index] = true;
        if node.extension("KHR_node_visibility").is_some_and(|e| *e.at("visible") == Json::Bool(false)) {
            continue;
        }
        let world_from_node = world_from_parent * local_transform(node);
        placed.push(Placed { node: index, world_from_node });
        let children = node.list("children").iter().rev().filter_map(Json::integer);
        stack.extend(children.map(|child| (child, world_from_node)));
    }
    placed
}

/// A transform in the scene's precision.
pub(super) fn to_f32(transform: &DAffine3) -> Affine3 {
    Affine3::from_mat3_translation(transform.matrix3.as_mat3(), transform.translation.as_vec3())
}

/// How many copies EXT_mesh_gpu_instancing makes, and their transforms relative to the node; `None` if the node has none.
pub(super) fn gpu_instances(
    node: &Json<'_>,
    data: &Data,
    place: &str,
    findings: &mut Findings,
) -> Option<(usize, impl Fn(usize) -> DAffine3 + use<>)> {
    let extension = node.extension("EXT_mesh_gpu_instancing")?;
    let attributes = extension.at("attributes");
    let place = format!("{place}/extensions/EXT_mesh_gpu_instancing/attributes");
    let mut error = |what: String, hint: &str| {
        findings.error("UNUSABLE_INSTANCES", what, &place, hint);
        None
    };
    let translations = match attributes.index("TRANSLATION").map(|i| data.floats::<3>(i, 0.0)).transpose() {
        Ok(values) => values,
        Err(fault) => return error(fault.what, fault.hint),
    };
    let rotations = match attributes.index("ROTATION").map(|i| data.floats::<4>(i, 0.0)).transpose() {
        Ok(values) => values,
        Err(fault) => return error(fault.what, fault.hint),
    };
    let scales = match attributes.index("SCALE").map(|i| data.floats::<3>(i, 0.0)).transpose() {
        Ok(values) => values,
        Err(fault) => return error(fault.what, fault.hint),
    };
    let lengths = [
        translations.as_ref().map(Vec::len),
        rotations.as_ref().map(Vec::len),
        scales.as_ref().map(Vec::len),
    ];
    let count = lengths.into_iter().flatten().next().unwrap_or(0);
    if lengths.into_iter().flatten().any(|n| n != count) {
        return error("the attributes of the instances have different counts".into(), "");
    }
    let transform = move |i: usize| {
        let translation = translations.as_ref().map_or(DVec3::ZERO, |t| double3(t[i]));
        let rotation = rotations.as_ref().map_or(DQuat::IDENTITY, |r| double_quat(r[i]));
        let scale = scales.as_ref().map_or(DVec3::ONE, |s| double3(s[i]));
        DAffine3::from_scale_rotation_translation(scale, rotation, translation)
    };
    Some((count, transform))
}

fn double3(v: [f32; 3]) -> DVec3 {
    DVec3::from_array(v.map(f64::from))
}

fn double_quat(v: [f32; 4]) -> DQuat {
    let quat = DQuat::from_array(v.map(f64::from));
    if quat.length_squared() > 0.0 { quat.normalize() } else { DQuat::IDENTITY }
}
