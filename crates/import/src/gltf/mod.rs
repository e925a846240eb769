//! glTF 2.0 and GLB.
//!
//! The way of the data: `container` splits the file, `json` parses the text, `validate` checks the document against
//! the specification, `buffers`, `meshopt` and `accessor` give typed arrays, `mesh` (with `primitive`, `topology`), `material`
//! (with `texture`, `image`), `camera`, `light` and `extras` turn the parts into the scene's, and `assemble` walks the
//! nodes.

mod accessor;
mod assemble;
mod buffers;
mod camera;
mod container;
mod draco;
mod extensions;
mod extras;
mod findings;
mod image;
mod json;
mod light;
mod material;
mod mesh;
mod meshopt;
mod model;
mod morph;
mod node;
mod primitive;
mod skin;
#[cfg(test)]
mod tests;
mod texture;
mod topology;
mod uri;
mod validate;

use crate::{ErrorKind, ImportError, LoadOptions};
use findings::Findings;
use std::path::Path;
use vastlight_scene::{Diagnostics, SceneDesc};

/// Reads a glTF or GLB file.
///
/// What the specification calls an error stands as an error in the diagnostics of the result, which `Scene::new`
/// then refuses.
///
/// # Errors
/// The file cannot be read.
pub(crate) fn load(path: &Path, options: &LoadOptions) -> Result<SceneDesc, ImportError> {
    let bytes = read(path, options)?;
    let mut findings = Findings::default();
    let mut desc = parse(&bytes, path, options, &mut findings).unwrap_or_default();
    findings.report(&path.display().to_string(), &mut desc.diagnostics);
    Ok(desc)
}

/// Bytes that [`load`] takes for a file and its buffers at most, as far as the sizes of files say.
///
/// # Errors
/// The file cannot be read.
pub(crate) fn whole_bytes(path: &Path, options: &LoadOptions) -> Result<u64, ImportError> {
    let failed = |e: std::io::Error| ImportError::io(&e, path);
    let folder = path.parent().unwrap_or(Path::new(""));
    let own = std::fs::metadata(path).map_err(failed)?.len();
    let text = buffers::read_json(path, options.limits.file_bytes).map_err(failed)?;
    // What is wrong with the text is found when it is read.
    let root = json::parse(&text).unwrap_or(json::Json::Null);
    let size = |buffer: &json::Json<'_>| match buffer.at("uri").text().map(|uri| uri::resolve(uri, folder)) {
        Some(uri::Uri::File(file)) => std::fs::metadata(file).map_or(0, |metadata| metadata.len()),
        _ => 0,
    };
    let buffers: u64 = root.list("buffers").iter().map(size).sum();
    // The buffers, and the meshes that are made of them, whose indices become wider.
    Ok((own + buffers).saturating_mul(5) / 2)
}

/// Checks a glTF or GLB file and reports all that is found.
#[must_use]
pub fn validate(path: &Path) -> Diagnostics {
    match load(path, &LoadOptions::default()) {
        Ok(desc) => desc.diagnostics,
        Err(error) => {
            let mut diagnostics = Diagnostics::default();
            diagnostics.error(error.what, error.place, error.hint);
            diagnostics
        }
    }
}

fn read(path: &Path, options: &LoadOptions) -> Result<Vec<u8>, ImportError> {
    buffers::read_file(path, options.limits.file_bytes)
        .map_err(|error| ImportError::new(ErrorKind::Io, error.to_string(), path.display().to_string()))
}

/// From bytes to a description; `None` if an error stands in `findings`.
fn parse(bytes: &[u8], path: &Path, options: &LoadOptions, findings: &mut Findings) -> Option<SceneDesc> {
    let expect_glb = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("glb"));
    let container = container::split(bytes, expect_glb, findings)?;
    let root = match json::parse(container.json) {
        Ok(root) => root,
        Err(error) => {
            findings.error("INVALID_JSON", format!("the JSON is invalid: {error}"), "", "");
            return None;
        }
    };
    validate::check_schema(&root, findings);
    let directory = path.parent().unwrap_or(Path::new(""));
    let sources =
        buffers::Sources { bin: container.bin, is_glb: container.is_glb, directory, limits: &options.limits };
    let buffers = buffers::load(&root, &sources, findings);
    let mut data = accessor::Data::new(&root, buffers);
    validate::check_rules(&root, &data, findings);
    if findings.has_errors() {
        return None;
    }
    let decoded = meshopt::decode_views(&root, &data, &options.limits, findings);
    data.set_decoded(decoded);
    validate::check_data(&root, &data, findings);
    Some(assemble::assemble(&root, &data, directory, options, findings))
}
