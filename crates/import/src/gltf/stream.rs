//! A scene mesh by mesh: tables and images first, and each mesh when it is asked for.

use super::accessor::Data;
use super::animation::Movement;
use super::buffers::{self, Sources};
use super::container::{self, Container};
use super::findings::Findings;
use super::json::{self, Json};
use super::mesh::{self, Built, Context, Shape};
use super::model::Accessor;
use super::topology::Mode;
use super::{Parsed, image, meshopt, open, parse};
use crate::texels::{Deferral, ImageSize};
use crate::{FileSize, ImportError, LoadOptions, Streamed};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use vastlight_scene::{Diagnostics, Mesh, Piece, SceneError, SceneStream, read_ahead};

/// Meshes that are made before they are asked for.
const AHEAD: usize = 2;
/// Bytes of a parsed document for each byte of its text.
const TREE: u64 = 4;
/// Bytes of a placement on its way: as the file has it, in the scene's table, and in that of its piece.
const PLACED_BYTES: u64 = 104;

/// The scene of [`super::load`], mesh by mesh. Meshes that deform are made at once, for what moves them.
///
/// # Errors
/// The file cannot be read.
pub(crate) fn stream(path: &Path, options: &LoadOptions) -> Result<Streamed, ImportError> {
    let file = open(path, options)?;
    let mut findings = Findings::default();
    let place = path.display().to_string();
    let mut deferral = Deferral::of_large();
    let parsed = parse(&file, path, (options, true), &mut deferral, &mut findings);
    let Some(Parsed { mut desc, shapes, context, files, mut movement }) = parsed else {
        let mut desc = vastlight_scene::SceneDesc::default();
        findings.report(&place, &mut desc.diagnostics);
        return Ok(SceneStream::from(desc).into());
    };
    findings.report(&place, &mut desc.diagnostics);
    let count = |shape: &Shape| triangles(&context.meshes[shape.mesh], |index| context.data.accessor(index));
    let triangles = shapes.iter().map(count).fold(0, u64::saturating_add);
    desc.meshes = vec![Mesh::default(); shapes.len()];
    let mut deforming = build_deforming(&context, &shapes, &mut movement);
    desc.motion = movement.finish(&desc);
    let SceneStream { desc, pieces: placements, .. } = desc.into();
    let jobs = shapes.into_iter().zip(placements).enumerate();
    let jobs = jobs.map(move |(number, (shape, placed))| (deforming.remove(&number), shape, placed));
    let make = move |(built, shape, placed): (Option<Built>, Shape, Result<Piece, SceneError>)| {
        let Built { mesh, findings: found, .. } = built.unwrap_or_else(|| mesh::build(&context, &shape));
        let mut diagnostics = Diagnostics::default();
        found.report(&place, &mut diagnostics);
        match diagnostics.first_error() {
            Some(error) => Err(error.clone().into()),
            None => Ok(Piece { mesh, diagnostics: diagnostics.items().to_vec(), ..placed? }),
        }
    };
    let pieces = read_ahead(jobs, AHEAD, make);
    let stream = SceneStream { desc, pieces, triangles: Some(triangles), rows: deferral.rows };
    Ok(Streamed { files, ..stream.into() })
}

/// The meshes whose vertices move, by number, without what poses them: the movement has that.
fn build_deforming(context: &Context, shapes: &[Shape], movement: &mut Movement) -> BTreeMap<usize, Built> {
    let moving: Vec<(usize, &Shape)> = shapes.iter().enumerate().filter(|(_, s)| context.moves(s)).collect();
    let built: Vec<Built> = moving.par_iter().map(|(_, shape)| mesh::build(context, shape)).collect();
    let noted = moving.into_iter().zip(built).map(|((number, shape), mut built)| {
        let joints = shape.skin.and_then(|skin| context.joints.get(&skin));
        movement.add_mesh(number, shape, std::mem::take(&mut built.bases), joints);
        (number, built)
    });
    noted.collect()
}

/// Triangles of a mesh as its accessors say.
fn triangles<'a>(mesh: &Json<'_>, accessor: impl Fn(usize) -> Option<&'a Accessor>) -> u64 {
    let of_primitive = |primitive: &Json<'_>| {
        let list = primitive.index("indices").or_else(|| primitive.at("attributes").index("POSITION"));
        let corners = list.and_then(&accessor).map_or(0, |accessor| accessor.count);
        match Mode::from_code(primitive.index("mode")) {
            Mode::Triangles => corners as u64 / 3,
            Mode::Strip | Mode::Fan => (corners as u64).saturating_sub(2),
            Mode::NoSurface(_) => 0,
        }
    };
    mesh.list("primitives").iter().map(of_primitive).fold(0, u64::saturating_add)
}

/// What a file's text says of its size: [`stream`] holds the document, what is decompressed as a whole, and the meshes
/// that are on their way.
///
/// # Errors
/// The file cannot be read.
pub(crate) fn file_size(path: &Path, options: &LoadOptions) -> Result<FileSize, ImportError> {
    let file = open(path, options)?;
    // What is wrong with the file is found when it is read.
    let Some(container) = container::split(&file, false, &mut Findings::default()) else {
        return Ok(FileSize::default());
    };
    let text = container.json.bytes().map_err(|error| ImportError::io(&error, path))?;
    let root = json::parse(&text).unwrap_or(Json::Null);
    let accessors: Vec<Option<Accessor>> = root.list("accessors").iter().map(Accessor::read).collect();
    let meshes = root.list("meshes").iter().map(|mesh| mesh_bytes(mesh, &accessors));
    let (largest, all) = meshes
        .fold((0, 0), |(largest, all): (u64, u64), bytes| (largest.max(bytes), all.saturating_add(bytes)));
    let under_way = largest.saturating_mul(AHEAD as u64 + 1).min(all);
    let document = (text.len() as u64).saturating_mul(TREE);
    let count = |mesh| triangles(mesh, |index| accessors.get(index)?.as_ref());
    let images = image_sizes(&root, &container, path, options);
    let placed = root.list("nodes").iter().map(|node| copies(node, &accessors));
    let instances = placed.fold(0, u64::saturating_add);
    let deforming = deforming_bytes(&root, &accessors);
    let parts = [
        document,
        under_way,
        deforming,
        meshopt::decoded_bytes(&root),
        instances.saturating_mul(PLACED_BYTES),
    ];
    Ok(FileSize {
        streaming_bytes: parts.into_iter().fold(0, u64::saturating_add),
        triangles: root.list("meshes").iter().map(count).fold(0, u64::saturating_add),
        instances,
        image_working_bytes: Deferral::of_large().working_bytes(&images),
        image_bytes: images.iter().fold(0, |sum, image| sum.saturating_add(image.decoded_bytes)),
    })
}

/// Bytes of the meshes whose vertices may move, which are made at once, with what moves them.
fn deforming_bytes(root: &Json<'_>, accessors: &[Option<Accessor>]) -> u64 {
    if root.list("animations").is_empty() {
        return 0;
    }
    let nodes = root.list("nodes").iter();
    let skinned: BTreeSet<usize> =
        nodes.filter(|node| node.index("skin").is_some()).filter_map(|node| node.index("mesh")).collect();
    let meshes = root.list("meshes").iter().enumerate();
    let bytes = |(number, mesh): (usize, &Json<'_>)| {
        let targets = mesh.list("primitives").iter().flat_map(|primitive| primitive.list("targets"));
        let members = targets.flat_map(|target| target.members());
        let displaced = members.map(|(_, index)| accessor_bytes(index.integer(), accessors));
        let displaced = displaced.fold(0, u64::saturating_add);
        let deforms = displaced > 0 || skinned.contains(&number);
        if deforms { mesh_bytes(mesh, accessors).saturating_mul(2).saturating_add(displaced) } else { 0 }
    };
    meshes.map(bytes).fold(0, u64::saturating_add)
}

/// How often a node places its mesh.
fn copies(node: &Json<'_>, accessors: &[Option<Accessor>]) -> u64 {
    let Some(extension) = node.extension("EXT_mesh_gpu_instancing") else {
        return u64::from(node.index("mesh").is_some());
    };
    let attributes = extension.at("attributes").members().iter().map(|(_, value)| value.integer());
    let counts = attributes.filter_map(|index| Some(accessors.get(index?)?.as_ref()?.count as u64));
    counts.max().unwrap_or(0)
}

/// What the headers of a document's images say.
fn image_sizes(root: &Json<'_>, container: &Container, path: &Path, options: &LoadOptions) -> Vec<ImageSize> {
    let (directory, limits) = (path.parent().unwrap_or(Path::new("")), &options.limits);
    let Container { bin, is_glb, .. } = container;
    let sources = Sources { bin: bin.as_ref(), is_glb: *is_glb, directory, limits };
    let data = Data::new(root, buffers::load(root, &sources, &mut Findings::default()));
    image::sizes(root, &data, directory, limits)
}

/// Bytes of an accessor's data as it stands in the file, and as it is used.
fn accessor_bytes(index: Option<usize>, accessors: &[Option<Accessor>]) -> u64 {
    let accessor = index.and_then(|index| accessors.get(index)?.as_ref());
    let element = |a: &Accessor| a.element_size() as u64 + 4 * a.shape.components() as u64;
    accessor.map_or(0, |a| element(a).saturating_mul(a.count as u64))
}

/// Bytes of a mesh while it is made: its data as it stands in the file, and as it is used.
fn mesh_bytes(mesh: &Json<'_>, accessors: &[Option<Accessor>]) -> u64 {
    let of_primitive = |primitive: &Json<'_>| {
        let attributes = primitive.at("attributes").members().iter().map(|(_, value)| value.integer());
        let used = attributes.chain([primitive.index("indices")]);
        used.fold(0_u64, |sum, index| sum.saturating_add(accessor_bytes(index, accessors)))
    };
    mesh.list("primitives").iter().fold(0, |sum: u64, p| sum.saturating_add(of_primitive(p)))
}
