//! The Khronos validator's own cases: our errors against its reports.

#[path = "../../../tests/common/mod.rs"]
mod common;

use crate::LoadOptions;
use crate::gltf::findings::{Finding, Findings};
use crate::gltf::json::{self, Json};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use vastlight_scene::Severity;

fn cases() -> Option<Vec<PathBuf>> {
    let folder = common::models("malformed/gltf-validator")?;
    let mut cases = Vec::new();
    for topic in std::fs::read_dir(folder).expect("readable").flatten().filter(|e| e.path().is_dir()) {
        let files = std::fs::read_dir(topic.path()).expect("readable").flatten().map(|e| e.path());
        cases.extend(files.filter(|f| f.to_string_lossy().ends_with(".report.json")));
    }
    cases.sort();
    Some(cases)
}

fn findings_of(file: &Path) -> Vec<Finding> {
    let bytes = std::fs::read(file).expect("readable");
    let mut findings = Findings::default();
    crate::gltf::load_blob(&bytes.into(), file, &LoadOptions::default(), &mut findings);
    findings.list().to_vec()
}

/// Whether one place lies within the other.
fn related(a: &str, b: &str) -> bool {
    let (a, b) = (a.trim_end_matches('/'), b.trim_end_matches('/'));
    a.starts_with(b) || b.starts_with(a)
}

/// Differences between a report and what we find.
fn compare(report: &Json<'_>, ours: &[Finding]) -> Vec<String> {
    let errors: Vec<&Finding> = ours.iter().filter(|f| f.diagnostic.severity == Severity::Error).collect();
    let theirs: Vec<&Json<'_>> =
        report.at("issues").list("messages").iter().filter(|m| m.index("severity") == Some(0)).collect();
    let their_codes: BTreeSet<&str> = theirs.iter().filter_map(|m| m.at("code").text()).collect();
    let mut differences = Vec::new();
    if theirs.is_empty() != errors.is_empty() {
        differences.push(format!("they have {} errors, we have {}: {errors:?}", theirs.len(), errors.len()));
    }
    for message in &theirs {
        let pointer = message.at("pointer").text().unwrap_or_default();
        if !errors.iter().any(|f| pointer.is_empty() || related(&f.diagnostic.place, pointer)) {
            differences.push(format!("nothing found at {pointer}"));
        }
    }
    for error in errors.iter().filter(|f| !their_codes.contains(f.code)) {
        differences.push(format!("{} is ours alone, they have {their_codes:?}", error.code));
    }
    differences
}

/// Whether a report without errors has warnings about a picture, and we have nothing to say.
fn is_silent(report_file: &Path) -> bool {
    let text = std::fs::read(report_file).expect("readable");
    let report = json::parse(&text).expect("a report");
    let messages = report.at("issues").list("messages");
    let of_no_concern = ["DATA_URI_GLB", "MULTIPLE_EXTENSIONS", "MESH_PRIMITIVE_GENERATED_TANGENT_SPACE"];
    let warned = messages.iter().any(|m| {
        let code = m.at("code").text().unwrap_or_default();
        m.index("severity") == Some(1) && !of_no_concern.contains(&code)
    });
    let file = report_file.to_string_lossy().replace(".report.json", "");
    warned && findings_of(Path::new(&file)).is_empty()
}

/// Where our code differs from theirs for a reason.
const EXPECTED: &[(&str, &str)] = &[
    // A number beyond f64 is no valid JSON for our parser.
    ("infinite_znear", "INVALID_JSON"),
    ("infinite_transform", "INVALID_JSON"),
    // One error more for a mesh that has several.
    ("empty_object.gltf in mesh", "MESH_PRIMITIVES_UNEQUAL_TARGETS_COUNT"),
    // An unknown extension cannot be required; the validator only says that it is not used.
    ("undefined_used_extensions", "UNSUPPORTED_REQUIRED_EXTENSION"),
    // A broken image is a broken image.
    ("png_eos", "IMAGE_DATA_INVALID"),
];

#[test]
fn errors_are_those_of_the_reports() {
    let Some(cases) = cases() else { return };
    let mut differences = Vec::new();
    for report_file in &cases {
        let text = std::fs::read(report_file).expect("readable");
        let report = json::parse(&text).expect("a report");
        let file = report_file.to_string_lossy().replace(".report.json", "");
        let name = file.rsplit('/').take(2).collect::<Vec<_>>().join(" in ");
        for difference in compare(&report, &findings_of(Path::new(&file))) {
            if !EXPECTED.iter().any(|(case, words)| name.starts_with(case) && difference.contains(words)) {
                differences.push(format!("{name}: {difference}"));
            }
        }
    }
    assert!(cases.len() > 200);
    let silent = cases.iter().filter(|case| is_silent(case)).count();
    assert_eq!(silent, 0, "cases with warnings in the report and none of ours");
    assert!(differences.is_empty(), "{} differences:\n{}", differences.len(), differences.join("\n"));
}
