//! A glTF mesh with its primitives becomes one mesh with parts.

use super::accessor::{Data, Fault};
use super::findings::Findings;
use super::json::Json;
use super::primitive::{self, FromAccessors, Surface};
use super::topology::Mode;
use std::sync::atomic::{AtomicU64, Ordering};
use vastlight_math::{Vec2, Vec3, Vec4};
use vastlight_scene::{Mesh, Part};

/// What meshes are built from.
#[derive(Debug)]
pub(super) struct Context<'a> {
    pub(super) root: &'a Json<'a>,
    pub(super) data: &'a Data<'a>,
    /// Material of primitives that name none.
    pub(super) default_material: u32,
    /// Bytes of geometry that may still be made.
    pub(super) budget: &'a AtomicU64,
}

/// Builds a mesh; primitives that cannot be used are left out with a finding.
pub(super) fn build(context: &Context<'_>, index: usize) -> (Mesh, Findings) {
    let mut findings = Findings::default();
    let json = &context.root.list("meshes")[index];
    let mut mesh = Mesh { name: name_of(json, index), ..Mesh::default() };
    let surfaces: Vec<(Surface, u32)> = json
        .list("primitives")
        .iter()
        .enumerate()
        .filter_map(|(i, primitive)| {
            let place = format!("/meshes/{index}/primitives/{i}");
            let surface = surface_of(context, primitive, &place, &mut findings)?;
            let material = primitive.index("material").map_or(context.default_material, |m| m as u32);
            Some((surface, material))
        })
        .collect();
    merge(&mut mesh, surfaces);
    (mesh, findings)
}

/// A mesh's name, or its number.
pub(super) fn name_of(json: &Json<'_>, index: usize) -> String {
    match json.at("name").text() {
        Some(name) if !name.is_empty() => name.to_owned(),
        _ => format!("mesh {index}"),
    }
}

fn surface_of(
    context: &Context<'_>,
    primitive: &Json<'_>,
    place: &str,
    findings: &mut Findings,
) -> Option<Surface> {
    let mode = Mode::from_code(primitive.index("mode"));
    if let Mode::NoSurface(name) = mode {
        findings.warn("MODE_WITHOUT_SURFACE", format!("{name} have no surface"), place, "they are left out");
        return None;
    }
    let attributes = FromAccessors { data: context.data, primitive };
    let surface = primitive::read(&attributes, mode, place).and_then(|surface| {
        take_budget(context.budget, bytes_of(&surface), place)?;
        Ok(surface)
    });
    match surface {
        Ok(surface) if surface.triangles.is_empty() => None,
        Ok(surface) => Some(surface),
        Err(fault) => {
            findings.fault("UNUSABLE_PRIMITIVE", fault);
            None
        }
    }
}

fn bytes_of(surface: &Surface) -> u64 {
    let floats = 3
        + surface.normals.len().min(1) * 3
        + surface.tangents.len().min(1) * 4
        + surface.uvs.len() * 2
        + surface.colors.len().min(1) * 4;
    (surface.positions.len() * floats * 4 + surface.triangles.len() * 12) as u64
}

fn take_budget(budget: &AtomicU64, bytes: u64, place: &str) -> Result<(), Fault> {
    let take = |left: u64| left.checked_sub(bytes);
    match budget.fetch_update(Ordering::Relaxed, Ordering::Relaxed, take) {
        Ok(_) => Ok(()),
        Err(_) => Err(Fault::new("the geometry is beyond the limit of memory", place, "")),
    }
}

/// Appends surfaces to the mesh. An attribute that only some of them have gets its default in the others; surfaces
/// without normals become flat by splitting their vertices.
fn merge(mesh: &mut Mesh, mut surfaces: Vec<(Surface, u32)>) {
    if surfaces.iter().any(|(s, _)| !s.normals.is_empty()) {
        surfaces.iter_mut().filter(|(s, _)| s.normals.is_empty()).for_each(|(s, _)| flatten(s));
    }
    let tangents = surfaces.iter().any(|(s, _)| !s.tangents.is_empty());
    let colors = surfaces.iter().any(|(s, _)| !s.colors.is_empty());
    let uv_sets = surfaces.iter().map(|(s, _)| s.uvs.len()).max().unwrap_or(0);
    mesh.uvs.resize(uv_sets, Vec::new());
    for (surface, material) in surfaces {
        let first_vertex = mesh.positions.len();
        let vertices = surface.positions.len();
        append_part(&mut mesh.parts, mesh.triangles.len() as u32, material);
        let shift = |t: [u32; 3]| t.map(|i| i + first_vertex as u32);
        mesh.triangles.extend(surface.triangles.into_iter().map(shift));
        mesh.positions.extend(surface.positions);
        mesh.normals.extend(surface.normals);
        if tangents {
            extend(&mut mesh.tangents, surface.tangents, vertices, Vec4::ZERO);
        }
        if colors {
            extend(&mut mesh.colors, surface.colors, vertices, Vec4::ONE);
        }
        let mut sets = surface.uvs.into_iter();
        for set in &mut mesh.uvs {
            extend(set, sets.next().unwrap_or_default(), vertices, Vec2::ZERO);
        }
    }
}

fn append_part(parts: &mut Vec<Part>, first_triangle: u32, material: u32) {
    if parts.last().is_none_or(|last| last.material != material) {
        parts.push(Part { first_triangle, material });
    }
}

fn extend<T: Copy>(all: &mut Vec<T>, own: Vec<T>, vertices: usize, default: T) {
    if own.is_empty() {
        all.extend(std::iter::repeat_n(default, vertices));
    } else {
        all.extend(own);
    }
}

/// Gives each triangle its own corners with the triangle's normal; tangents are dropped, as the specification says.
fn flatten(surface: &mut Surface) {
    let corners: Vec<u32> = surface.triangles.iter().flatten().copied().collect();
    let pick = |i: &u32| *i as usize;
    surface.positions = corners.iter().map(|i| surface.positions[pick(i)]).collect();
    if !surface.colors.is_empty() {
        surface.colors = corners.iter().map(|i| surface.colors[pick(i)]).collect();
    }
    for set in surface.uvs.iter_mut().filter(|set| !set.is_empty()) {
        *set = corners.iter().map(|i| set[pick(i)]).collect();
    }
    surface.tangents.clear();
    let faces = surface.positions.as_chunks::<3>().0;
    surface.normals = faces.iter().flat_map(|&[a, b, c]| [face_normal(a, b, c); 3]).collect();
    surface.triangles = (0..faces.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
}

/// The unit normal of a triangle; z for a degenerate one.
fn face_normal(a: Vec3, b: Vec3, c: Vec3) -> Vec3 {
    (b - a).cross(c - a).try_normalize().unwrap_or(Vec3::Z)
}
