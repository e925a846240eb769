//! `vastlight bench build SCENE --device gpu`.

use super::Structure;
use crate::arguments::Common;
use crate::exit::Exit;
use serde_json::json;
use vastlight::accel::wide::{MeshBvh, MeshView};
use vastlight::accel::{Reference, quality, validate_parts};
use vastlight::gpu::bench::{self, BuildInput, Built};
use vastlight::gpu::build::Builder;
use vastlight::gpu::{DeviceChoice, Executor};
use vastlight::math::Aabb;
use vastlight::scene::{Mesh, Scene};
use vastlight::trace::Layout;
use vastlight::{Error, ErrorClass};

/// Most triangles in a leaf, as on the CPU.
const LEAF: u32 = 8;

/// Builds over the largest mesh of a scene, and checks the tree.
pub(super) fn run(
    scene: &Scene,
    structure: &Structure,
    repeat: u32,
    (choice, common): (DeviceChoice, &Common),
) -> Result<Exit, Error> {
    let (name, builder) = builder(structure)?;
    let mut executor = common.executor(choice)?;
    let none = Mesh::default();
    let mesh = scene.meshes().iter().max_by_key(|mesh| mesh.triangles.len()).unwrap_or(&none);
    let (positions, triangles) = (&mesh.positions[..], &mesh.triangles[..]);
    let split_budget = structure.split_budget;
    let input = BuildInput { positions, triangles, builder, leaf: LEAF, split_budget };
    let built = bench::build(&mut executor, &input, repeat)?;
    check(mesh, &built)?;
    let counts = [scene.meshes().len(), mesh.triangles.len()];
    println!("{}", line(name, counts, &executor, &built));
    Ok(Exit::Done)
}

/// The builder that is asked for, with its name.
fn builder(structure: &Structure) -> Result<(&'static str, Builder), Error> {
    let known = Builder::ALL.map(|(name, _)| name).join(", ");
    let wanted = if structure.accel.is_empty() { "hlbvh2" } else { structure.accel.as_str() };
    let found = Builder::ALL.into_iter().find(|(name, _)| *name == wanted);
    if structure.optimize != 0 || structure.layout != Layout::NAMES[0] {
        let what = "builds on graphics processors have no --optimize and --layout";
        return Err(Error::usage(what, "bench build", "leave them out, or use --device cpu"));
    }
    found.ok_or_else(|| {
        let what = format!("\"{wanted}\" is not built on graphics processors (known: {known})");
        Error::usage(what, "--accel", "")
    })
}

/// Checks the tree, and that the leaves of the wide one over it cover all triangles.
fn check(mesh: &Mesh, (_, tree, wide): &Built) -> Result<(), Error> {
    let bounds = |i| Reference::new(&Aabb::from_points(mesh.corners(i)), i).bounds();
    let boxes: Vec<Aabb> = (0..mesh.triangles.len() as u32).map(bounds).collect();
    let wrong = |what| Error::new(ErrorClass::Device, format!("{what}"), "bench build", "report this");
    validate_parts(tree, &boxes, LEAF, |_, _| true).map_err(wrong)?;
    let view = MeshView { positions: &mesh.positions, triangles: &mesh.triangles };
    let bvh = MeshBvh::over_nodes(&view, &wide.nodes, &wide.leaves, &tree.prims);
    bvh.validate(&view).map(drop).map_err(wrong)
}

fn line(
    name: &str,
    [meshes, triangles]: [usize; 2],
    executor: &Executor,
    (figures, tree, wide): &Built,
) -> serde_json::Value {
    let measured = quality(tree);
    let stages: serde_json::Map<_, _> =
        figures.stages.iter().map(|(name, ms)| ((*name).to_owned(), json!(ms))).collect();
    json!({
        "bench": "build",
        "device": "gpu",
        "adapter": executor.adapter().name,
        "accel": name,
        "meshes": meshes,
        "triangles": triangles,
        "references": measured.references,
        "nodes": measured.nodes,
        "wide_nodes": wide.nodes.len(),
        "build_ms": figures.ms,
        "first_ms": figures.first_ms,
        "compile_ms": figures.compile_ms,
        "mtri_per_s": triangles as f64 / figures.ms.max(1e-6) / 1e3,
        "refit_ms": figures.refit_ms,
        "cost": measured.cost,
        "depth": measured.depth,
        "overlap": measured.overlap,
        "dispatches": figures.dispatches,
        "sort_dispatches": figures.sort_dispatches,
        "peak_bytes": executor.held_bytes(),
        "stages": stages,
    })
}
