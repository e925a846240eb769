//! glTF 2.0 and GLB.
//!
//! The way of the data: `container` splits the file (a `blob`, which stays on disk if it is large), `json` parses the text, `validate` checks the document against
//! the specification, `buffers`, `meshopt` and `accessor` give typed arrays, `mesh` (with `primitive`, `topology`), `material`
//! (with `texture`, `image`), `camera`, `light` and `extras` turn the parts into the scene's, `assemble` walks the
//! nodes, and `animation` keeps what moves.

mod accessor;
mod animation;
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
mod stream;
#[cfg(test)]
mod tests;
mod texture;
mod topology;
mod uri;
mod validate;

use crate::blob::{self, Blob};
use crate::texels::Deferral;
use crate::{ImportError, LoadOptions};
use assemble::Parsed;
use container::Container;
use findings::Findings;
use mesh::Built;
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use vastlight_scene::{Diagnostics, SceneDesc};

pub use animation::motion;
pub(crate) use stream::{file_size, stream};

/// Reads a glTF or GLB file; also returns the files that it names.
///
/// What the specification calls an error stands as an error in the diagnostics of the result, which `Scene::new`
/// then refuses.
///
/// # Errors
/// The file cannot be read.
pub(crate) fn load(path: &Path, options: &LoadOptions) -> Result<(SceneDesc, Vec<PathBuf>), ImportError> {
    let file = open(path, options)?;
    let mut findings = Findings::default();
    let (mut desc, files) = load_blob(&file, path, options, &mut findings);
    findings.report(&path.display().to_string(), &mut desc.diagnostics);
    Ok((desc, files))
}

/// The scene in a file with its meshes and what moves it, and the files that it names; an empty one if an error stands in `findings`.
fn load_blob(
    file: &Blob,
    path: &Path,
    options: &LoadOptions,
    findings: &mut Findings,
) -> (SceneDesc, Vec<PathBuf>) {
    let parsed = parse(file, path, (options, true), &mut Deferral::never(), findings);
    let Some(Parsed { mut desc, shapes, context, mut movement, files }) = parsed else {
        return Default::default();
    };
    let built: Vec<Built> = shapes.par_iter().map(|shape| mesh::build(&context, shape)).collect();
    for (Built { mesh, bases, findings: found }, shape) in built.into_iter().zip(&shapes) {
        findings.append(found);
        let joints = shape.skin.and_then(|skin| context.joints.get(&skin));
        movement.add_mesh(desc.meshes.len(), shape, bases, joints);
        desc.meshes.push(mesh);
    }
    desc.motion = movement.finish(&desc);
    (desc, files)
}

/// Checks a glTF or GLB file and reports all that is found.
#[must_use]
pub fn validate(path: &Path) -> Diagnostics {
    match load(path, &LoadOptions::default()) {
        Ok((desc, _)) => desc.diagnostics,
        Err(error) => {
            let mut diagnostics = Diagnostics::default();
            diagnostics.error(error.what, error.place, error.hint);
            diagnostics
        }
    }
}

fn open(path: &Path, options: &LoadOptions) -> Result<Blob, ImportError> {
    Blob::open(path, options.limits.file_bytes, blob::MOST_IN_MEMORY)
        .map_err(|error| ImportError::io(&error, path))
}

/// From a file to a description without meshes, and what they are made of, with what moves them if that is wanted; `None` if an error
/// stands in `findings`. Texels of images that `deferral` is for come later.
fn parse(
    file: &Blob,
    path: &Path,
    (options, animated): (&LoadOptions, bool),
    deferral: &mut Deferral,
    findings: &mut Findings,
) -> Option<Parsed> {
    let expect_glb = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("glb"));
    let container = container::split(file, expect_glb, findings)?;
    let text = match container.json.bytes() {
        Ok(text) => text,
        Err(error) => {
            findings.error("IO_ERROR", format!("the file cannot be read: {error}"), "", "");
            return None;
        }
    };
    let root = match json::parse(&text) {
        Ok(root) => root,
        Err(error) => {
            findings.error("INVALID_JSON", format!("the JSON is invalid: {error}"), "", "");
            return None;
        }
    };
    validate::check_schema(&root, findings);
    let directory = path.parent().unwrap_or(Path::new(""));
    let Container { bin, is_glb, .. } = &container;
    let sources = buffers::Sources { bin: bin.as_ref(), is_glb: *is_glb, directory, limits: &options.limits };
    let buffers = buffers::load(&root, &sources, findings);
    let mut data = accessor::Data::new(&root, buffers);
    validate::check_rules(&root, &data, findings);
    if findings.has_errors() {
        return None;
    }
    let decoded = meshopt::decode_views(&root, &data, &options.limits, findings);
    data.set_decoded(decoded);
    validate::check_data(&root, &data, findings);
    Some(assemble::assemble(&root, data, directory, (options, animated), deferral, findings))
}
