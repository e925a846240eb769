//! Checks of skins: joints under one root, inverse bind matrices, transforms that do not count.

use super::layout::{Usage, Usages};
use super::nodes::Graph;
use crate::gltf::accessor::Data;
use crate::gltf::findings::Findings;
use crate::gltf::json::Json;
use crate::gltf::model::{Component, Shape};

/// Checks all skins, and the nodes that use them.
pub(super) fn check(root: &Json<'_>, data: &Data, usages: &mut Usages, findings: &mut Findings) {
    let graph = Graph::new(root);
    let tops = graph.tops();
    for (i, skin) in root.list("skins").iter().enumerate() {
        let place = format!("/skins/{i}");
        check_joints(skin, &graph, &tops, &place, findings);
        check_matrices(skin, data, usages, &format!("{place}/inverseBindMatrices"), findings);
    }
    check_ignored_transforms(root, &graph, findings);
}

/// All joints have one root in common, and the skeleton is such a one.
fn check_joints(
    skin: &Json<'_>,
    graph: &Graph,
    tops: &[Option<usize>],
    place: &str,
    findings: &mut Findings,
) {
    let joints: Vec<usize> = skin.list("joints").iter().filter_map(Json::integer).collect();
    let top = |joint: usize| tops.get(joint).copied().flatten();
    let common = joints.first().and_then(|&joint| top(joint));
    if !joints.is_empty() && (common.is_none() || joints.iter().any(|&joint| top(joint) != common)) {
        findings.error(
            "SKIN_NO_COMMON_ROOT",
            "the joints have no common root",
            &format!("{place}/joints"),
            "",
        );
        return;
    }
    // The common root itself is always above all joints.
    let Some(skeleton) = skin.index("skeleton").filter(|&s| s < tops.len() && Some(s) != common) else {
        return;
    };
    let mut below = vec![false; tops.len()];
    below[skeleton] = true;
    let below = graph.spread_down(below);
    if joints.iter().any(|&joint| !below[joint]) {
        let what = "the skeleton node is not above all joints";
        findings.error("SKIN_SKELETON_INVALID", what, &format!("{place}/skeleton"), "");
    }
}

fn check_matrices(skin: &Json<'_>, data: &Data, usages: &mut Usages, place: &str, findings: &mut Findings) {
    let Some(index) = skin.index("inverseBindMatrices") else { return };
    let Some(accessor) = data.accessor(index) else { return };
    usages.note(index, accessor, Usage::InverseBindMatrices, place, findings);
    if accessor.shape != Shape::Mat4 || accessor.component != Component::F32 {
        let what = format!("the format {} is not MAT4 FLOAT", accessor.format());
        findings.error("SKIN_IBM_INVALID_FORMAT", what, place, "");
    }
    let joints = skin.list("joints").len();
    if accessor.count < joints {
        let what = format!("there are {} matrices for {joints} joints", accessor.count);
        findings.error("INVALID_IBM_ACCESSOR_COUNT", what, place, "");
    }
    if accessor.view.and_then(|v| data.view(v)).is_some_and(|v| v.stride.is_some()) {
        let what = "the view of inverse bind matrices must not have a byteStride";
        findings.error("SKIN_IBM_ACCESSOR_WITH_BYTESTRIDE", what, place, "");
    }
}

fn check_ignored_transforms(root: &Json<'_>, graph: &Graph, findings: &mut Findings) {
    let nodes = root.list("nodes");
    let moves = |node: &Json<'_>| {
        ["matrix", "translation", "rotation", "scale"].into_iter().any(|key| node.get(key).is_some())
    };
    let moved = graph.spread_down(nodes.iter().map(moves).collect());
    let hint = "the joints place it";
    for (i, node) in nodes.iter().enumerate().filter(|(_, node)| node.get("skin").is_some()) {
        let place = format!("/nodes/{i}");
        if moves(node) {
            let what = "the transform of a node with a skinned mesh does not count";
            findings.warn("NODE_SKINNED_MESH_LOCAL_TRANSFORMS", what, &place, hint);
        }
        if graph.parents[i].is_some_and(|parent| moved[parent]) {
            let what = "the transforms above a node with a skinned mesh do not count";
            findings.warn("NODE_SKINNED_MESH_PARENT_TRANSFORMS", what, &place, hint);
        }
    }
}

/// The last row of inverse bind matrices is (0, 0, 0, 1).
pub(super) fn check_data(root: &Json<'_>, data: &Data, findings: &mut Findings) {
    for (i, skin) in root.list("skins").iter().enumerate() {
        let accessor = skin.index("inverseBindMatrices").filter(|&a| data.has_values(a));
        let matrices = accessor.and_then(|a| data.floats::<16>(a, 0.0).ok());
        let is_wrong = |m: &[f32; 16]| [m[3], m[7], m[11], m[15]] != [0.0, 0.0, 0.0, 1.0];
        if let Some(joint) = matrices.iter().flatten().position(is_wrong) {
            let what = format!("the last row of matrix {joint} is not 0, 0, 0, 1");
            findings.error("ACCESSOR_INVALID_IBM", what, &format!("/skins/{i}/inverseBindMatrices"), "");
        }
    }
}
