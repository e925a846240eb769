//! The node hierarchy: which mesh, camera and light stands where.

use super::accessor::Data;
use super::findings::Findings;
use super::json::Json;
use serde::{Deserialize, Serialize};
use vastlight_math::Affine3;
use vastlight_math::glam::{DAffine3, DMat4, DQuat, DVec3};

/// A node of the chosen scene with its place in the world.
#[derive(Clone, Debug)]
pub(super) struct Placed {
    pub(super) node: usize,
    /// Number of its parent among the placed nodes.
    pub(super) parent: Option<usize>,
    pub(super) world_from_node: DAffine3,
}

/// A node's transform relative to its parent in its parts.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct Parts {
    pub(super) scale: DVec3,
    pub(super) rotation: DQuat,
    pub(super) translation: DVec3,
}

impl Parts {
    /// What a node without a matrix says.
    pub(super) fn read(node: &Json<'_>) -> Self {
        let rotation = node.doubles("rotation").map_or(DQuat::IDENTITY, DQuat::from_array);
        Self {
            scale: node.doubles("scale").map_or(DVec3::ONE, DVec3::from_array),
            rotation: if rotation.length_squared() > 0.0 { rotation.normalize() } else { DQuat::IDENTITY },
            translation: node.doubles("translation").map_or(DVec3::ZERO, DVec3::from_array),
        }
    }

    /// Scaled, then turned, then moved.
    pub(super) fn transform(&self) -> DAffine3 {
        DAffine3::from_scale_rotation_translation(self.scale, self.rotation, self.translation)
    }
}

/// A node's transform relative to its parent.
pub(super) fn local_transform(node: &Json<'_>) -> DAffine3 {
    match node.doubles::<16>("matrix") {
        Some(matrix) => DAffine3::from_mat4(DMat4::from_cols_array(&matrix)),
        None => Parts::read(node).transform(),
    }
}

/// All nodes below `roots`, parents before children, in file order. A node that is reached twice is placed once, so
/// that a loop ends.
pub(super) fn place(root: &Json<'_>, roots: &[usize]) -> Vec<Placed> {
    let nodes = root.list("nodes");
    let mut seen = vec![false; nodes.len()];
    let mut stack: Vec<(usize, Option<usize>)> = roots.iter().rev().map(|&i| (i, None)).collect();
    let mut placed: Vec<Placed> = Vec::new();
    while let Some((index, parent)) = stack.pop() {
        let Some(node) = nodes.get(index).filter(|_| !seen[index]) else { continue };
        seen[index] = true;
        if node.extension("KHR_node_visibility").is_some_and(|e| *e.at("visible") == Json::Bool(false)) {
            continue;
        }
        let world_from_parent = parent.map_or(DAffine3::IDENTITY, |p| placed[p].world_from_node);
        let world_from_node = world_from_parent * local_transform(node);
        let children = node.list("children").iter().rev().filter_map(Json::integer);
        stack.extend(children.map(|child| (child, Some(placed.len()))));
        placed.push(Placed { node: index, parent, world_from_node });
    }
    placed
}

/// A transform in the scene's precision.
pub(super) fn to_f32(transform: &DAffine3) -> Affine3 {
    Affine3::from_mat3_translation(transform.matrix3.as_mat3(), transform.translation.as_vec3())
}

/// Copies of a node's mesh that EXT_mesh_gpu_instancing makes.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Copies {
    count: usize,
    translations: Option<Vec<[f32; 3]>>,
    rotations: Option<Vec<[f32; 4]>>,
    scales: Option<Vec<[f32; 3]>>,
}

impl Copies {
    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.count
    }

    /// Whether there is all that a copy has for each.
    pub(super) fn is_sound(&self) -> bool {
        let lengths = [
            self.translations.as_ref().map(Vec::len),
            self.rotations.as_ref().map(Vec::len),
            self.scales.as_ref().map(Vec::len),
        ];
        let mut known = lengths.into_iter().flatten().peekable();
        (known.peek().is_some() || self.count == 0) && known.all(|length| length == self.count)
    }

    /// The space of the node from that of a copy.
    pub(super) fn node_from_copy(&self, i: usize) -> DAffine3 {
        let scale = self.scales.as_ref().map_or(DVec3::ONE, |s| double3(s[i]));
        let rotation = self.rotations.as_ref().map_or(DQuat::IDENTITY, |r| double_quat(r[i]));
        let translation = self.translations.as_ref().map_or(DVec3::ZERO, |t| double3(t[i]));
        Parts { scale, rotation, translation }.transform()
    }
}

/// The copies of a node's mesh; `None` if the node has none.
pub(super) fn gpu_instances(
    node: &Json<'_>,
    data: &Data,
    place: &str,
    findings: &mut Findings,
) -> Option<Copies> {
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
    Some(Copies { count, translations, rotations, scales })
}

fn double3(v: [f32; 3]) -> DVec3 {
    DVec3::from_array(v.map(f64::from))
}

fn double_quat(v: [f32; 4]) -> DQuat {
    let quat = DQuat::from_array(v.map(f64::from));
    if quat.length_squared() > 0.0 { quat.normalize() } else { DQuat::IDENTITY }
}
