//! Checks of animations, which a still picture does not show.

use super::layout::{Usage, Usages};
use crate::gltf::accessor::Data;
use crate::gltf::findings::Findings;
use crate::gltf::json::Json;
use crate::gltf::model::{Accessor, Component, Shape};
use std::collections::BTreeMap;

/// Largest deviation of a rotation's length from 1 (8 bits of quantisation).
const UNIT_TOLERANCE: f32 = 0.00769;

/// Checks all animations.
pub(super) fn check(root: &Json<'_>, data: &Data, usages: &mut Usages, findings: &mut Findings) {
    for (i, animation) in root.list("animations").iter().enumerate() {
        let place = format!("/animations/{i}");
        for (k, sampler) in animation.list("samplers").iter().enumerate() {
            check_sampler(root, sampler, data, usages, &format!("{place}/samplers/{k}"), findings);
        }
        check_targets(animation, &place, findings);
        for (k, channel) in animation.list("channels").iter().enumerate() {
            check_channel(root, animation, channel, data, &format!("{place}/channels/{k}"), findings);
        }
    }
}

fn check_sampler(
    root: &Json<'_>,
    sampler: &Json<'_>,
    data: &Data,
    usages: &mut Usages,
    place: &str,
    findings: &mut Findings,
) {
    for key in ["input", "output"] {
        let Some(index) = sampler.index(key) else { continue };
        let Some(accessor) = data.accessor(index) else { continue };
        let place = format!("{place}/{key}");
        usages.note(index, accessor, Usage::Animation, &place, findings);
        if accessor.view.and_then(|v| data.view(v)).is_some_and(|v| v.stride.is_some()) {
            let what = "the view of an animation must not have a byteStride";
            findings.error("ANIMATION_SAMPLER_ACCESSOR_WITH_BYTESTRIDE", what, &place, "");
        }
        if key == "input" {
            check_input(root, sampler, index, accessor, &place, findings);
        }
    }
}

fn check_input(
    root: &Json<'_>,
    sampler: &Json<'_>,
    index: usize,
    accessor: &Accessor,
    place: &str,
    findings: &mut Findings,
) {
    if accessor.shape != Shape::Scalar || accessor.component != Component::F32 {
        let what = format!("the format {} is not SCALAR FLOAT", accessor.format());
        findings.error("ANIMATION_SAMPLER_INPUT_ACCESSOR_INVALID_FORMAT", what, place, "");
    }
    let json = &root.list("accessors")[index];
    if json.get("min").is_none() || json.get("max").is_none() {
        let what = "the times of an animation need min and max";
        findings.error("ANIMATION_SAMPLER_INPUT_ACCESSOR_WITHOUT_BOUNDS", what, place, "");
    }
    if sampler.at("interpolation").text() == Some("CUBICSPLINE") && accessor.count < 2 {
        let what = "a cubic spline needs at least 2 times";
        findings.error("ANIMATION_SAMPLER_INPUT_ACCESSOR_TOO_FEW_ELEMENTS", what, place, "");
    }
}

/// No two channels move the same.
fn check_targets(animation: &Json<'_>, place: &str, findings: &mut Findings) {
    let mut seen: BTreeMap<(usize, &str), usize> = BTreeMap::new();
    for (k, channel) in animation.list("channels").iter().enumerate() {
        let target = channel.at("target");
        let (Some(node), Some(path)) = (target.index("node"), target.at("path").text()) else { continue };
        if let Some(first) = seen.get(&(node, path)) {
            let what = format!("channels {first} and {k} have the same target");
            findings.error(
                "ANIMATION_DUPLICATE_TARGETS",
                what,
                &format!("{place}/channels/{first}/target"),
                "",
            );
        } else {
            seen.insert((node, path), k);
        }
    }
}

fn check_channel(
    root: &Json<'_>,
    animation: &Json<'_>,
    channel: &Json<'_>,
    data: &Data,
    place: &str,
    findings: &mut Findings,
) {
    let target = channel.at("target");
    let path = target.at("path").text().unwrap_or_default();
    let node = target.index("node").and_then(|n| root.list("nodes").get(n));
    if let Some(node) = node {
        check_target(root, node, path, &format!("{place}/target"), findings);
    }
    let Some(index) = channel.index("sampler") else { return };
    let Some(sampler) = animation.list("samplers").get(index) else {
        let what = format!("{index} refers to nothing");
        return findings.error("UNRESOLVED_REFERENCE", what, &format!("{place}/sampler"), "");
    };
    check_output(root, sampler, node, path, data, &format!("{place}/sampler"), findings);
}

fn check_target(root: &Json<'_>, node: &Json<'_>, path: &str, place: &str, findings: &mut Findings) {
    let moves = matches!(path, "translation" | "rotation" | "scale");
    if moves && node.get("matrix").is_some() {
        let what = "a node with a matrix cannot be animated";
        findings.error("ANIMATION_CHANNEL_TARGET_NODE_MATRIX", what, place, "");
    }
    if moves && node.get("skin").is_some() {
        let what = "moving the node of a skinned mesh has no effect";
        findings.warn("ANIMATION_CHANNEL_TARGET_NODE_SKIN", what, &format!("{place}/path"), "");
    }
    if path == "weights" && morph_targets(root, node) == 0 {
        let what = "the node's mesh has no morph targets";
        findings.error("ANIMATION_CHANNEL_TARGET_NODE_WEIGHTS_NO_MORPHS", what, place, "");
    }
}

fn morph_targets(root: &Json<'_>, node: &Json<'_>) -> usize {
    let mesh = node.index("mesh").and_then(|m| root.list("meshes").get(m));
    mesh.and_then(|m| m.list("primitives").first()).map_or(0, |p| p.list("targets").len())
}

fn check_output(
    root: &Json<'_>,
    sampler: &Json<'_>,
    node: Option<&Json<'_>>,
    path: &str,
    data: &Data,
    place: &str,
    findings: &mut Findings,
) {
    let of = |key: &str| sampler.index(key).and_then(|i| data.accessor(i));
    let (Some(input), Some(output)) = (of("input"), of("output")) else { return };
    let float = output.component == Component::F32;
    let fine = match path {
        "translation" | "scale" => output.shape == Shape::Vec3 && float,
        "rotation" => output.shape == Shape::Vec4 && (float || output.normalized),
        "weights" => output.shape == Shape::Scalar && (float || output.normalized),
        _ => return,
    };
    if !fine {
        let what = format!("the format {} is not allowed for {path}", output.format());
        return findings.error("ANIMATION_SAMPLER_OUTPUT_ACCESSOR_INVALID_FORMAT", what, place, "");
    }
    let per_time = match (path, node) {
        ("weights", Some(node)) => morph_targets(root, node),
        ("weights", None) => return,
        _ => 1,
    };
    let of_spline = if sampler.at("interpolation").text() == Some("CUBICSPLINE") { 3 } else { 1 };
    let expected = input.count.saturating_mul(per_time).saturating_mul(of_spline);
    if output.count != expected && per_time > 0 {
        let what = format!("there are {} values, {expected} are needed", output.count);
        findings.error("ANIMATION_SAMPLER_OUTPUT_ACCESSOR_INVALID_COUNT", what, place, "");
    }
}

/// Times ascend from 0 or later, rotations are unit quaternions.
pub(super) fn check_data(root: &Json<'_>, data: &Data, findings: &mut Findings) {
    for (i, animation) in root.list("animations").iter().enumerate() {
        for (k, sampler) in animation.list("samplers").iter().enumerate() {
            let place = format!("/animations/{i}/samplers/{k}/input");
            check_times(sampler, data, &place, findings);
        }
        for (k, channel) in animation.list("channels").iter().enumerate() {
            if channel.at("target").at("path").text() == Some("rotation") {
                let sampler = channel.index("sampler").and_then(|s| animation.list("samplers").get(s));
                let place = format!("/animations/{i}/channels/{k}/sampler");
                sampler.into_iter().for_each(|s| check_rotations(s, data, &place, findings));
            }
        }
    }
}

fn check_times(sampler: &Json<'_>, data: &Data, place: &str, findings: &mut Findings) {
    let Some(times) = values::<1>(sampler, "input", data) else { return };
    if let Some(i) = times.iter().position(|t| t[0] < 0.0) {
        let what = format!("time {i} is negative: {}", times[i][0]);
        findings.error("ACCESSOR_ANIMATION_INPUT_NEGATIVE", what, place, "");
    }
    if let Some(i) = times.windows(2).position(|pair| pair[0][0] >= pair[1][0]) {
        let what = format!("time {} is not later than the one before: {}", i + 1, times[i + 1][0]);
        findings.error("ACCESSOR_ANIMATION_INPUT_NON_INCREASING", what, place, "");
    }
}

fn check_rotations(sampler: &Json<'_>, data: &Data, place: &str, findings: &mut Findings) {
    let Some(rotations) = values::<4>(sampler, "output", data) else { return };
    let is_spline = sampler.at("interpolation").text() == Some("CUBICSPLINE");
    let is_wrong = |(i, q): (usize, &[f32; 4])| {
        let length = q.iter().map(|x| x * x).sum::<f32>().sqrt();
        // In a spline each value stands between its two tangents.
        (!is_spline || i % 3 == 1) && (length - 1.0).abs() > UNIT_TOLERANCE
    };
    if let Some(i) = rotations.iter().enumerate().position(is_wrong) {
        let code = "ACCESSOR_ANIMATION_SAMPLER_OUTPUT_NON_NORMALIZED_QUATERNION";
        findings.error(code, format!("rotation {i} is no unit quaternion"), place, "");
    }
}

/// Values that the file holds; `None` for accessors without data.
fn values<const N: usize>(sampler: &Json<'_>, key: &str, data: &Data) -> Option<Vec<[f32; N]>> {
    let index = sampler.index(key)?;
    let accessor = data.accessor(index)?;
    if accessor.shape.components() != N || !data.has_values(index) {
        return None;
    }
    data.floats(index, 0.0).ok()
}
