//! A glTF mesh with its primitives becomes one mesh with parts.

use super::accessor::{Data, Fault};
use super::draco::FromDraco;
use super::findings::Findings;
use super::json::Json;
use super::morph::Target;
use super::primitive::{self, Corners, FromAccessors, Influences, Surface};
use super::topology::Mode;
use super::{morph, skin};
use crate::Limits;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicU64, Ordering};
use vastlight_math::{Affine3, Vec2, Vec3, Vec4};
use vastlight_scene::{Mesh, Part};

/// What meshes are built from.
#[derive(Debug)]
pub(super) struct Context {
    /// The document's meshes.
    pub(super) meshes: Vec<Json<'static>>,
    pub(super) data: Data,
    /// Material of primitives that name none.
    pub(super) default_material: u32,
    /// World space from bind pose for each joint of each skin in use.
    pub(super) joints: BTreeMap<usize, Vec<Affine3>>,
    /// Skins in use that have joints which move.
    pub(super) moving_skins: BTreeSet<usize>,
    /// Bounds on what decoders make.
    pub(super) limits: Limits,
    /// Bytes of geometry that may still be made.
    pub(super) budget: AtomicU64,
}

/// A mesh as nodes show it: with their morph weights and skin.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Shape {
    /// Index of the glTF mesh.
    pub(super) mesh: usize,
    /// Bits of the morph weights; empty if none is at work.
    pub(super) weights: Vec<u32>,
    /// Index of the skin.
    pub(super) skin: Option<usize>,
    /// Number of the keys that move the weights.
    pub(super) track: Option<usize>,
}

/// A mesh as it was built.
#[derive(Debug, Default)]
pub(super) struct Built {
    pub(super) mesh: Mesh,
    /// What poses it, if it moves.
    pub(super) bases: Vec<Base>,
    pub(super) findings: Findings,
}

impl Shape {
    /// The morph weights at rest.
    pub(super) fn weights(&self) -> Vec<f32> {
        self.weights.iter().map(|&bits| f32::from_bits(bits)).collect()
    }
}

impl Context {
    /// Whether vertices of a mesh move.
    pub(super) fn moves(&self, shape: &Shape) -> bool {
        shape.track.is_some() || shape.skin.is_some_and(|skin| self.moving_skins.contains(&skin))
    }
}

/// The part of a mesh that a primitive is, before it is posed.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Base {
    /// Without texture coordinates and colours, which stay.
    surface: Surface,
    influences: Vec<Influences>,
    /// Targets whose weights move; others are in `surface`.
    targets: Vec<Target>,
}

impl Base {
    /// What of a surface is posed.
    fn of(surface: &Surface, context: &Context, place: &str) -> Result<Self, Fault> {
        let Surface { positions, normals, tangents, triangles, .. } = surface;
        // With joints and weights of one set, which most skins have.
        let influences = 32 * positions.len() as u64;
        take_budget(&context.budget, bytes_of(surface).saturating_add(influences), place)?;
        let surface = Surface {
            positions: positions.clone(),
            normals: normals.clone(),
            tangents: tangents.clone(),
            triangles: triangles.clone(),
            ..Surface::default()
        };
        Ok(Self { surface, ..Self::default() })
    }

    /// Whether it can be posed: triangles have vertices, and attributes are of all vertices.
    pub(super) fn is_sound(&self) -> bool {
        let Surface { positions, normals, tangents, uvs, colors, triangles, .. } = &self.surface;
        let fits = |length: usize| length == 0 || length == positions.len();
        triangles.iter().flatten().all(|&vertex| (vertex as usize) < positions.len())
            && fits(normals.len())
            && fits(tangents.len())
            && uvs.is_empty()
            && colors.is_empty()
    }

    fn posed(&self, weights: &[f32], joints: Option<&[Affine3]>) -> Surface {
        let mut surface = self.surface.clone();
        for (target, &weight) in self.targets.iter().zip(weights).filter(|(_, w)| **w != 0.0) {
            target.add(&mut surface, weight);
        }
        if let Some(joints) = joints {
            skin::apply(&mut surface, &self.influences, joints);
        }
        finish(&mut surface);
        surface
    }
}

/// The vertices of a mesh with other morph weights, and other places of its joints.
pub(super) fn pose(bases: &[Base], weights: &[f32], joints: Option<&[Affine3]>) -> Mesh {
    let mut mesh = Mesh::default();
    merge(&mut mesh, bases.iter().map(|base| (base.posed(weights, joints), 0)).collect());
    mesh
}

/// Builds a mesh; primitives that cannot be used are left out with a finding.
pub(super) fn build(context: &Context, shape: &Shape) -> Built {
    let (mut findings, mut bases) = (Findings::default(), Vec::new());
    let json = &context.meshes[shape.mesh];
    let mut mesh = Mesh { name: name_of(json, shape.mesh), ..Mesh::default() };
    let mut surfaces = Vec::new();
    for (i, primitive) in json.list("primitives").iter().enumerate() {
        let place = format!("/meshes/{}/primitives/{i}", shape.mesh);
        let mode = Mode::from_code(primitive.index("mode"));
        if let Mode::NoSurface(name) = mode {
            findings.warn(
                "MODE_WITHOUT_SURFACE",
                format!("{name} have no surface"),
                &place,
                "they are left out",
            );
            continue;
        }
        match surface_of(context, shape, primitive, mode, &place) {
            Ok((surface, _)) if surface.triangles.is_empty() => {}
            Ok((surface, base)) => {
                surfaces.push((surface, material_of(context, primitive)));
                bases.extend(base);
            }
            Err(fault) => findings.fault("UNUSABLE_PRIMITIVE", fault),
        }
        if shape.track.is_some() {
            warn_of_looks(primitive, &place, &mut findings);
        }
    }
    merge(&mut mesh, surfaces);
    Built { mesh, bases, findings }
}

/// Morph weights that move leave texture coordinates and colours as they are at rest.
fn warn_of_looks(primitive: &Json<'_>, place: &str, findings: &mut Findings) {
    let is_look = |name: &str| name.starts_with("TEXCOORD_") || name.starts_with("COLOR_");
    if primitive.list("targets").iter().any(|target| target.members().iter().any(|(name, _)| is_look(name))) {
        let what = "texture coordinates and colours of morph targets do not move";
        findings.warn(
            "STILL_MORPH_TARGETS",
            what,
            &format!("{place}/targets"),
            "they are those of the scene at rest",
        );
    }
}

fn material_of(context: &Context, primitive: &Json<'_>) -> u32 {
    primitive.index("material").map_or(context.default_material, |m| m as u32)
}

/// A mesh's name, or its number.
pub(super) fn name_of(json: &Json<'_>, index: usize) -> String {
    match json.at("name").text() {
        Some(name) if !name.is_empty() => name.to_owned(),
        _ => format!("mesh {index}"),
    }
}

/// Reads a primitive, morphs it, and moves it with its joints. Also returns what poses it, if it moves.
fn surface_of(
    context: &Context,
    shape: &Shape,
    primitive: &Json<'_>,
    mode: Mode,
    place: &str,
) -> Result<(Surface, Option<Base>), Fault> {
    let (mut surface, selection) = match FromDraco::read(&context.data, primitive, &context.limits, place)? {
        Some(source) => (read_draco(context, &source, place)?, None),
        None => read_accessors(context, primitive, mode, place)?,
    };
    let (influences, selection) = (std::mem::take(&mut surface.influences), selection.as_deref());
    let mut base = None;
    if shape.track.is_some() {
        let targets = read_targets(context, primitive, selection, place)?;
        base = Some(Base { targets, ..Base::of(&surface, context, place)? });
    }
    morph::apply(&mut surface, primitive, &shape.weights(), &context.data, selection)?;
    if base.is_none() && context.moves(shape) {
        base = Some(Base::of(&surface, context, place)?);
    }
    if let Some(joints) = shape.skin.and_then(|skin| context.joints.get(&skin)) {
        skin::apply(&mut surface, &influences, joints);
    }
    finish(&mut surface);
    Ok((surface, base.map(|base| Base { influences, ..base })))
}

/// All targets of a primitive.
fn read_targets(
    context: &Context,
    primitive: &Json<'_>,
    selection: Option<&[u32]>,
    place: &str,
) -> Result<Vec<Target>, Fault> {
    let targets = primitive.list("targets");
    // A compressed primitive may have fewer vertices than the accessors of its targets have elements.
    let accessors = targets
        .iter()
        .flat_map(|target| target.members())
        .filter_map(|(_, index)| context.data.accessor(index.integer()?));
    let vertices = accessors.map(|accessor| selection.map_or(accessor.count, <[u32]>::len) as u64);
    let bytes = vertices.fold(0_u64, |sum, count| sum.saturating_add(count.saturating_mul(12)));
    take_budget(&context.budget, bytes, place)?;
    targets.iter().map(|target| Target::read(target, &context.data, selection)).collect()
}

fn read_draco(context: &Context, source: &FromDraco<'_>, place: &str) -> Result<Surface, Fault> {
    let surface = primitive::read(source, Mode::Triangles, &source.corners(), place)?;
    take_budget(&context.budget, bytes_of(&surface), place)?;
    Ok(surface)
}

/// Reads a primitive from accessors; also returns which vertices were read, if not all.
fn read_accessors(
    context: &Context,
    primitive: &Json<'_>,
    mode: Mode,
    place: &str,
) -> Result<(Surface, Option<Vec<u32>>), Fault> {
    let data = &context.data;
    let positions = primitive.at("attributes").index("POSITION").and_then(|i| data.accessor(i));
    let Some(count) = positions.map(|accessor| accessor.count) else { return Ok((Surface::default(), None)) };
    let index_accessor = primitive.index("indices");
    let corner_count = index_accessor.and_then(|i| data.accessor(i)).map_or(count, |accessor| accessor.count);
    // At least a position for each vertex and an index for each corner, before memory is taken for them.
    let least = (corner_count.min(count) as u64).saturating_mul(12).saturating_add(corner_count as u64 * 4);
    take_budget(&context.budget, least, place)?;
    let indices = index_accessor.map(|i| data.whole::<1>(i)).transpose()?.map(Vec::into_flattened);
    let corners = Corners::new(indices, count, place)?;
    let attributes = FromAccessors { data, primitive, selection: corners.selection.as_deref() };
    let surface = primitive::read(&attributes, mode, &corners.vertices, place)?;
    take_budget(&context.budget, bytes_of(&surface), place)?;
    Ok((surface, corners.selection))
}

/// Unit normals and tangents. Tangents without normals do not count; the scene derives missing ones.
fn finish(surface: &mut Surface) {
    repair_normals(surface);
    if surface.normals.is_empty() {
        surface.tangents.clear();
    }
    for (tangent, normal) in surface.tangents.iter_mut().zip(&surface.normals) {
        let direction = unit(tangent.truncate());
        let sign = 1.0_f32.copysign(tangent.w);
        *tangent = direction.unwrap_or_else(|| normal.any_orthonormal_vector()).extend(sign);
    }
}

/// The vector with unit length. One that has it to the last digits is kept as it is, so that what was written is read
/// again.
fn unit(vector: Vec3) -> Option<Vec3> {
    let is_unit = (vector.length_squared() - 1.0).abs() < 1e-6;
    if is_unit { Some(vector) } else { vector.try_normalize() }
}

/// Normals get unit length; those without a direction get that of a triangle at their vertex.
fn repair_normals(surface: &mut Surface) {
    let mut broken = false;
    for normal in &mut surface.normals {
        *normal = unit(*normal).unwrap_or_else(|| {
            broken = true;
            Vec3::ZERO
        });
    }
    if broken {
        for triangle in &surface.triangles {
            let [a, b, c] = triangle.map(|i| surface.positions[i as usize]);
            for vertex in triangle.map(|i| i as usize) {
                if surface.normals[vertex] == Vec3::ZERO {
                    surface.normals[vertex] = face_normal(a, b, c);
                }
            }
        }
        surface.normals.iter_mut().filter(|n| **n == Vec3::ZERO).for_each(|n| *n = Vec3::Z);
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

/// Takes bytes that are about to be made from what may still be made.
pub(super) fn take_budget(budget: &AtomicU64, bytes: u64, place: &str) -> Result<(), Fault> {
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
