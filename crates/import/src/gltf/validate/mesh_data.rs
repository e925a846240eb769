//! Checks of vertex attributes' values: indices in range, unit normals, colours and weights in range, joints.

use super::schema::pointer;
use super::semantics::Semantic;
use crate::gltf::accessor::Data;
use crate::gltf::findings::Findings;
use crate::gltf::json::Json;
use crate::gltf::model::Component;
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Largest deviation of a normal's length from 1 (8 bits of quantisation).
const UNIT_TOLERANCE: f32 = 0.00674;
/// Largest deviation of a sum of weights from 1 for each weight (8 bits of quantisation).
const WEIGHT_TOLERANCE: f32 = 0.0019608;

/// One check of one accessor, or of one primitive's joints.
enum Job<'a> {
    Indices { accessor: usize, vertices: usize },
    Unit { accessor: usize, with_sign: bool },
    Colors { accessor: usize },
    Influences { primitive: &'a Json<'a>, joints: Option<(usize, usize)> },
}

/// Checks the values of all primitives. What several primitives share is checked once.
pub(super) fn check<'a>(root: &'a Json<'a>, data: &Data, findings: &mut Findings) {
    let jobs = collect(root, data);
    let found: Vec<Findings> = jobs
        .par_iter()
        .map(|(job, place)| {
            let mut findings = Findings::default();
            run(job, data, place, &mut findings);
            findings
        })
        .collect();
    found.into_iter().for_each(|f| findings.append(f));
}

fn collect<'a>(root: &'a Json<'a>, data: &Data) -> Vec<(Job<'a>, String)> {
    let mut jobs = Vec::new();
    let mut seen: BTreeSet<(&str, usize, usize)> = BTreeSet::new();
    let joints = fewest_joints(root);
    for (i, mesh) in root.list("meshes").iter().enumerate() {
        for (k, primitive) in mesh.list("primitives").iter().enumerate() {
            let place = format!("/meshes/{i}/primitives/{k}");
            let mut add = |key: (&'static str, usize, usize), job: Job<'a>, place: String| {
                if seen.insert(key) {
                    jobs.push((job, place));
                }
            };
            let attributes = primitive.at("attributes");
            let position = attributes.index("POSITION").and_then(|p| data.accessor(p));
            if let (Some(accessor), Some(position)) = (primitive.index("indices"), position) {
                let vertices = position.count;
                let job = Job::Indices { accessor, vertices };
                add(("indices", accessor, vertices), job, format!("{place}/indices"));
            }
            for (name, value) in attributes.members() {
                let (Some(semantic), Some(accessor)) = (Semantic::parse(name), value.integer()) else {
                    continue;
                };
                let place = pointer(&format!("{place}/attributes"), name);
                match semantic {
                    Semantic::Normal => {
                        add(("unit", accessor, 0), Job::Unit { accessor, with_sign: false }, place);
                    }
                    Semantic::Tangent => {
                        add(("unit", accessor, 1), Job::Unit { accessor, with_sign: true }, place);
                    }
                    Semantic::Color(0) => add(("color", accessor, 0), Job::Colors { accessor }, place),
                    Semantic::Joints(0) => {
                        let job = Job::Influences { primitive, joints: joints[i] };
                        let fewest = joints[i].map_or(usize::MAX, |(count, _)| count);
                        add(
                            ("joints", accessor, fewest),
                            job,
                            format!("/meshes/{i}/primitives/{k}/attributes"),
                        );
                    }
                    _ => {}
                }
            }
        }
    }
    jobs
}

/// The smallest skin that each mesh is used with: number of joints, and the skin.
fn fewest_joints(root: &Json<'_>) -> Vec<Option<(usize, usize)>> {
    let mut fewest: Vec<Option<(usize, usize)>> = vec![None; root.list("meshes").len()];
    for node in root.list("nodes") {
        let (Some(mesh), Some(skin)) = (node.index("mesh"), node.index("skin")) else { continue };
        let (Some(slot), Some(json)) = (fewest.get_mut(mesh), root.list("skins").get(skin)) else { continue };
        let joints = (json.list("joints").len(), skin);
        *slot = Some(slot.map_or(joints, |least| least.min(joints)));
    }
    fewest
}

fn run(job: &Job<'_>, data: &Data, place: &str, findings: &mut Findings) {
    match *job {
        Job::Indices { accessor, vertices } => check_indices(data, accessor, vertices, place, findings),
        Job::Unit { accessor, with_sign } => check_unit(data, accessor, with_sign, place, findings),
        Job::Colors { accessor } => check_colors(data, accessor, place, findings),
        Job::Influences { primitive, joints } => check_influences(data, primitive, joints, place, findings),
    }
}

fn check_indices(data: &Data, accessor: usize, vertices: usize, place: &str, findings: &mut Findings) {
    let Some(form) = data.accessor(accessor).filter(|_| data.has_values(accessor)) else { return };
    let Ok(indices) = data.whole::<1>(accessor) else { return };
    let restart = match form.component {
        Component::U8 => u32::from(u8::MAX),
        Component::U16 => u32::from(u16::MAX),
        _ => u32::MAX,
    };
    if let Some(i) = indices.iter().position(|index| index[0] == restart) {
        let what = format!("index {i} is {restart}, which stands for a restart and is not allowed");
        findings.error("ACCESSOR_INDEX_PRIMITIVE_RESTART", what, place, "");
    } else if let Some(i) = indices.iter().position(|index| index[0] as usize >= vertices) {
        let what = format!("index {i} is {}, there are {vertices} vertices", indices[i][0]);
        findings.error("ACCESSOR_INDEX_OOB", what, place, "");
    }
}

fn check_unit(data: &Data, accessor: usize, with_sign: bool, place: &str, findings: &mut Findings) {
    if !data.has_values(accessor) {
        return;
    }
    let Ok(vectors) = data.floats::<4>(accessor, 1.0) else { return };
    let length = |v: &[f32; 4]| (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    if let Some(i) = vectors.iter().position(|v| (length(v) - 1.0).abs() > UNIT_TOLERANCE) {
        let what = format!("vector {i} is not of unit length: {}", length(&vectors[i]));
        findings.error("ACCESSOR_VECTOR3_NON_UNIT", what, place, "");
    }
    if let Some(i) = vectors.iter().position(|v| with_sign && v[3].abs() != 1.0) {
        let what = format!("the sign of tangent {i} is {}, not 1 or -1", vectors[i][3]);
        findings.error("ACCESSOR_INVALID_SIGN", what, place, "");
    }
}

fn check_colors(data: &Data, accessor: usize, place: &str, findings: &mut Findings) {
    let is_float = data.accessor(accessor).is_some_and(|a| a.component == Component::F32);
    if !is_float || !data.has_values(accessor) {
        return;
    }
    let Ok(colors) = data.floats::<4>(accessor, 1.0) else { return };
    if let Some(i) = colors.iter().position(|c| c.iter().any(|x| !(0.0..=1.0).contains(x))) {
        let what = format!("colour {i} is not within 0 to 1");
        findings.error("ACCESSOR_NON_CLAMPED", what, place, "");
    }
}

/// Joints exist and stand once at a vertex; weights are not negative and add up to 1.
fn check_influences(
    data: &Data,
    primitive: &Json<'_>,
    joints: Option<(usize, usize)>,
    place: &str,
    findings: &mut Findings,
) {
    let attributes = primitive.at("attributes");
    let mut sets = Vec::new();
    while let (Some(joint), Some(weight)) = (
        attributes.index(&format!("JOINTS_{}", sets.len())),
        attributes.index(&format!("WEIGHTS_{}", sets.len())),
    ) {
        if !data.has_values(joint) || !data.has_values(weight) {
            return;
        }
        let (Ok(joint), Ok(weight)) = (data.whole::<4>(joint), data.floats::<4>(weight, 0.0)) else { return };
        sets.push((joint, weight));
    }
    let vertices = sets.iter().map(|(joint, weight)| joint.len().min(weight.len())).min().unwrap_or(0);
    for v in 0..vertices {
        let influences: Vec<(u32, f32)> =
            sets.iter().flat_map(|(joint, weight)| joint[v].into_iter().zip(weight[v])).collect();
        if let Some((code, what)) = wrong_influences(&influences, joints, v) {
            findings.error(code, what, place, "");
        }
    }
}

fn wrong_influences(
    influences: &[(u32, f32)],
    joints: Option<(usize, usize)>,
    vertex: usize,
) -> Option<(&'static str, String)> {
    let mut used: Vec<u32> =
        influences.iter().filter(|(_, weight)| *weight != 0.0).map(|(joint, _)| *joint).collect();
    used.sort_unstable();
    if let Some((count, skin)) = joints
        && let Some((joint, _)) = influences.iter().find(|(joint, _)| *joint as usize >= count)
    {
        let what = format!("vertex {vertex} refers to joint {joint}, skin {skin} has {count}");
        return Some(("ACCESSOR_JOINTS_INDEX_OOB", what));
    }
    if let Some((_, weight)) = influences.iter().find(|(_, weight)| *weight < 0.0) {
        return Some((
            "ACCESSOR_WEIGHTS_NEGATIVE",
            format!("vertex {vertex} has the negative weight {weight}"),
        ));
    }
    if used.windows(2).any(|pair| pair[0] == pair[1]) {
        let what = format!("vertex {vertex} refers to one joint twice");
        return Some(("ACCESSOR_JOINTS_INDEX_DUPLICATE", what));
    }
    let sum: f32 = influences.iter().map(|(_, weight)| weight).sum();
    let tolerance = WEIGHT_TOLERANCE * influences.len().max(1) as f32;
    let is_wrong = (sum - 1.0).abs() > tolerance;
    is_wrong.then(|| {
        ("ACCESSOR_WEIGHTS_NON_NORMALIZED", format!("the weights of vertex {vertex} add up to {sum}"))
    })
}
