//! Wavefront OBJ with MTL: one streaming pass, then a mesh for each object.
//!
//! Objects (`o`) become meshes with their names. A file without objects, but with a moderate number of groups (`g`),
//! gets a mesh for each group; with hundreds of small groups it stays one mesh, because rays are faster in one mesh
//! than in many that overlap. Materials stay apart in every case. `docs/formats.md` says how MTL is understood.

mod builder;
mod closed;
mod material;
mod mtl;
mod normals;
mod parse;
mod split;
mod textures;

use crate::polygon::Triangulator;
use crate::texels::Deferral;
use crate::{FileSize, ImportError, LoadOptions};
use material::Library;
use std::path::{Path, PathBuf};
use vastlight_math::Affine3;
use vastlight_scene::{Diagnostics, Instance, Mesh, SceneDesc};

/// Reads an OBJ file and the files that it names. Texels of images that `deferral` is for come later.
pub(crate) fn read(
    path: &Path,
    options: &LoadOptions,
    deferral: &mut Deferral,
) -> Result<(SceneDesc, Vec<PathBuf>), ImportError> {
    read_cut(path, options, deferral, Triangulator::default()).map(|(desc, files, _)| (desc, files))
}

/// Only the meshes of an OBJ file.
pub(crate) fn read_meshes(
    path: &Path,
    options: &LoadOptions,
    triangulator: Triangulator,
) -> Result<Vec<Mesh>, ImportError> {
    let source = crate::scan::Source::open(path, &options.limits)?;
    let parsed = parse::parse(source, &options.limits, triangulator, &mut Diagnostics::default())?;
    Ok(split::into_meshes(parsed.mesh, &parsed.runs, &parsed.names, ""))
}

/// Reads an OBJ file whose polygons are cut as is said.
pub(crate) fn read_cut(
    path: &Path,
    options: &LoadOptions,
    deferral: &mut Deferral,
    triangulator: Triangulator,
) -> Result<(SceneDesc, Vec<PathBuf>, Triangulator), ImportError> {
    let mut diagnostics = Diagnostics::default();
    let source = crate::scan::Source::open(path, &options.limits)?;
    let parsed = parse::parse(source, &options.limits, triangulator, &mut diagnostics)?;
    let stem = path.file_stem().map_or_else(|| "mesh".to_owned(), |s| s.to_string_lossy().into_owned());
    let library = Library::load(&parsed.libraries, path, &options.limits, &mut diagnostics);
    let closed = closed::closed_materials(&parsed, &library.glass(&parsed.materials));
    let meshes = split::into_meshes(parsed.mesh, &parsed.runs, &parsed.names, &stem);
    let mut desc = SceneDesc { meshes, diagnostics, ..SceneDesc::default() };
    library.fill(&parsed.materials, &closed, (options, deferral), &mut desc);
    for (i, mesh) in desc.meshes.iter().enumerate() {
        desc.names.push(mesh.name.clone());
        let id = i as u32;
        desc.instances.push(Instance { world_from_object: Affine3::IDENTITY, mesh: id, name: id });
    }
    Ok((desc, library.files(), parsed.triangulator))
}

/// What a file's size says.
pub(crate) fn file_size(path: &Path) -> Result<FileSize, ImportError> {
    let bytes = std::fs::metadata(path).map_err(|e| ImportError::io(&e, path))?.len();
    // A line of text of some 30 bytes is a vertex of 12 to 32, and tables to find it again.
    Ok(FileSize { streaming_bytes: bytes.saturating_mul(3), triangles: bytes / 100, ..FileSize::default() })
}

#[cfg(test)]
mod tests;
