//! Compressed buffer views: EXT_meshopt_compression and its successor KHR_meshopt_compression.

use super::accessor::{Data, Fault};
use super::buffers::Bytes;
use super::findings::Findings;
use super::json::Json;
use crate::Limits;
use crate::blob::Blob;
use crate::decode::{self, MeshoptFilter, MeshoptMode};
use rayon::prelude::*;

const EXTENSIONS: [&str; 2] = ["KHR_meshopt_compression", "EXT_meshopt_compression"];

/// Decompresses the views that need it; `None` for those that stand in the file as they are.
pub(super) fn decode_views(
    root: &Json<'_>,
    data: &Data,
    limits: &Limits,
    findings: &mut Findings,
) -> Vec<Option<Blob>> {
    let mut left = data.geometry_budget();
    let mut jobs = Vec::new();
    for (i, view) in root.list("bufferViews").iter().enumerate() {
        let Some((name, json)) = compressed(view) else { continue };
        let place = format!("/bufferViews/{i}/extensions/{name}");
        let size = size_of(json);
        let Some(rest) = left.checked_sub(size) else {
            findings.error("GEOMETRY_LIMIT", "the geometry is beyond the limit of memory", &place, "");
            continue;
        };
        left = rest;
        jobs.push((i, view, json, place));
    }
    let decoded: Vec<(usize, Result<Vec<u8>, Fault>)> = jobs
        .par_iter()
        .map(|(i, view, json, place)| (*i, decode_view(view, json, data, limits, place)))
        .collect();
    let mut views = vec![None; root.list("bufferViews").len()];
    for (i, result) in decoded {
        match result {
            Ok(bytes) => views[i] = Some(bytes.into()),
            Err(fault) => findings.fault("MESHOPT_DATA_INVALID", fault),
        }
    }
    views
}

/// Bytes of all views that [`decode_views`] decompresses.
pub(super) fn decoded_bytes(root: &Json<'_>) -> u64 {
    let views = root.list("bufferViews").iter().filter_map(compressed);
    views.fold(0, |sum, (_, json)| sum.saturating_add(size_of(json)))
}

/// The extension of a compressed view.
fn compressed<'j, 'a>(view: &'j Json<'a>) -> Option<(&'static str, &'j Json<'a>)> {
    EXTENSIONS.into_iter().find_map(|name| Some((name, view.extension(name)?)))
}

fn size_of(json: &Json<'_>) -> u64 {
    json.index("count").unwrap_or(0).saturating_mul(json.index("byteStride").unwrap_or(0)) as u64
}

fn decode_view(
    view: &Json<'_>,
    json: &Json<'_>,
    data: &Data,
    limits: &Limits,
    place: &str,
) -> Result<Vec<u8>, Fault> {
    let wrong = |what: &str| Fault::new(what, place, "");
    let number = |key: &str| {
        json.index(key).ok_or_else(|| wrong("the description of the compressed data is incomplete"))
    };
    let (buffer, length) = (number("buffer")?, number("byteLength")?);
    let (count, stride) = (number("count")?, number("byteStride")?);
    let Bytes::Known(bytes) = data.buffers().get(buffer) else {
        return Err(wrong("the compressed data is missing"));
    };
    let start = json.index("byteOffset").unwrap_or(0);
    let compressed = bytes.part(start as u64, length as u64);
    let compressed = compressed.ok_or_else(|| wrong("the compressed data does not fit its buffer"))?;
    let compressed = compressed.bytes().map_err(|error| wrong(&error.to_string()))?;
    let mode = mode_of(json).ok_or_else(|| wrong("the mode is unknown"))?;
    let filter = filter_of(json).ok_or_else(|| wrong("the filter is unknown"))?;
    let decoded = decode::meshopt(&compressed, count, stride, mode, filter, limits, place)
        .map_err(|error| wrong(&error.what))?;
    if view.index("byteLength").is_some_and(|needed| decoded.len() < needed) {
        return Err(wrong("the decompressed data is shorter than its view"));
    }
    Ok(decoded)
}

fn mode_of(json: &Json<'_>) -> Option<MeshoptMode> {
    match json.at("mode").text()? {
        "ATTRIBUTES" => Some(MeshoptMode::Attributes),
        "TRIANGLES" => Some(MeshoptMode::Triangles),
        "INDICES" => Some(MeshoptMode::Indices),
        _ => None,
    }
}

fn filter_of(json: &Json<'_>) -> Option<MeshoptFilter> {
    match json.at("filter").text().unwrap_or("NONE") {
        "NONE" => Some(MeshoptFilter::None),
        "OCTAHEDRAL" => Some(MeshoptFilter::Octahedral),
        "QUATERNION" => Some(MeshoptFilter::Quaternion),
        "EXPONENTIAL" => Some(MeshoptFilter::Exponential),
        "COLOR" => Some(MeshoptFilter::Color),
        _ => None,
    }
}
