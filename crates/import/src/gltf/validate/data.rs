//! Checks of accessors' values: finite numbers, declared bounds, sparse indices.

use crate::gltf::accessor::{Data, Source};
use crate::gltf::findings::Findings;
use crate::gltf::json::Json;
use crate::gltf::model::Component;
use rayon::prelude::*;

/// Checks the values of all accessors that have data.
pub(super) fn check(root: &Json<'_>, data: &Data, findings: &mut Findings) {
    let found: Vec<Findings> = root
        .list("accessors")
        .par_iter()
        .enumerate()
        .map(|(i, json)| {
            let mut findings = Findings::default();
            check_accessor(json, data, i, &mut findings);
            findings
        })
        .collect();
    found.into_iter().for_each(|f| findings.append(f));
}

fn check_accessor(json: &Json<'_>, data: &Data, index: usize, findings: &mut Findings) {
    if !data.has_values(index) {
        return;
    }
    let Ok(source) = data.source(index) else { return };
    let place = format!("/accessors/{index}");
    check_sparse_indices(&source, &place, findings);
    match source.bounds() {
        Some(bounds) => check_bounds(json, &bounds, source.accessor.component, &place, findings),
        None => {
            let what = "the accessor holds numbers that are not finite";
            findings.error("ACCESSOR_INVALID_FLOAT", what, &place, "");
        }
    }
}

fn check_sparse_indices(source: &Source<'_>, place: &str, findings: &mut Findings) {
    let indices = source.sparse_indices();
    let place = format!("{place}/sparse/indices");
    if indices.windows(2).any(|pair| pair[0] >= pair[1]) {
        let what = "the indices of replaced elements do not ascend";
        findings.error("ACCESSOR_SPARSE_INDICES_NON_INCREASING", what, &place, "");
    }
    if let Some(i) = indices.iter().find(|&&i| i >= source.accessor.count) {
        let what = format!("element {i} is to be replaced, there are {}", source.accessor.count);
        findings.error("ACCESSOR_SPARSE_INDEX_OOB", what, &place, "");
    }
}

/// The declared bounds are those of the values.
fn check_bounds(
    json: &Json<'_>,
    bounds: &[(f64, f64)],
    component: Component,
    place: &str,
    findings: &mut Findings,
) {
    let rounded = |x: f64| if component == Component::F32 { f64::from(x as f32) } else { x };
    for (c, &(smallest, largest)) in bounds.iter().enumerate() {
        let declared = |key: &str| json.list(key).get(c).and_then(Json::number).map(rounded);
        if let Some(min) = declared("min").filter(|&min| min != smallest) {
            let what = format!("the declared minimum is {min}, the values' is {smallest}");
            findings.error("ACCESSOR_MIN_MISMATCH", what, &format!("{place}/min/{c}"), "");
        }
        if let Some(max) = declared("max").filter(|&max| max != largest) {
            let what = format!("the declared maximum is {max}, the values' is {largest}");
            findings.error("ACCESSOR_MAX_MISMATCH", what, &format!("{place}/max/{c}"), "");
        }
    }
}
