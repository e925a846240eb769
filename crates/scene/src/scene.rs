//! The validated scene.

use crate::tangents::{self, tangent_sets};
use crate::world::WorldBounds;
use crate::{
    Camera, Diagnostic, Diagnostics, Environment, Image, Instance, Instances, Lattice, Light, Material, Mesh,
    Motion, Part, Pose, SceneDesc, SceneError, Shutter, Sky, Texture,
};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;
use vastlight_math::{Aabb, Affine3, Vec3};

/// A scene that has been checked: every index is in range, every position finite and on its mesh's lattice, there is
/// at least one material and one camera, and something shines.
#[derive(Clone, Debug)]
pub struct Scene {
    desc: SceneDesc,
    instances: Arc<Instances>,
    environment: Environment,
    bounds: WorldBounds,
    extents: Vec<MeshExtent>,
    /// In scenes that move, by place in the description's table of instances, their numbers; empty where these are the same.
    numbers: Vec<u32>,
    /// In scenes that move, meshes as they were described of which preparation changes more than vertices.
    described: BTreeMap<u32, Mesh>,
    /// What moves on from here, where a shutter is open.
    shutter: Option<Arc<Shutter>>,
    /// Whether the description had no camera.
    framed: bool,
}

/// What a moment made of the one before.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Change {
    /// Meshes with other vertices, ascending.
    pub meshes: Vec<u32>,
    /// Instances that were placed, be it where they were, ascending.
    pub instances: Vec<u32>,
}

/// Size of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshExtent {
    /// Around all triangles.
    pub bounds: Aabb,
    /// Number of triangles.
    pub triangles: u64,
}

/// Makes meshes fit for a scene, each by itself: see [`Scene::new`].
#[derive(Clone, Debug)]
pub struct MeshPreparation {
    /// By material: the texture coordinates that tangents follow.
    tangent_sets: Vec<Option<u32>>,
    materials: usize,
}

impl MeshPreparation {
    /// For the meshes of a scene with the materials and textures of `desc`.
    #[must_use]
    pub fn new(desc: &SceneDesc) -> Self {
        let tangent_sets = tangent_sets(&desc.materials, &desc.textures);
        Self { tangent_sets, materials: desc.materials.len() }
    }

    /// Collapses unusable triangles, snaps positions, derives tangents; says what was found.
    ///
    /// # Errors
    /// An index out of range.
    pub fn prepare(&self, mesh: &mut Mesh) -> Result<Vec<Diagnostic>, SceneError> {
        check_mesh(mesh, self.materials)?;
        let found = repair_mesh(mesh);
        tangents::derive(mesh, &self.tangent_sets);
        Ok(found)
    }

    /// Refuses a mesh that [`MeshPreparation::prepare`] does.
    ///
    /// # Errors
    /// An index out of range.
    pub fn check(&self, mesh: &Mesh) -> Result<(), SceneError> {
        check_mesh(mesh, self.materials)
    }

    /// Those of the meshes of which preparation changes more than vertices, as they are before it.
    fn described<'m>(&self, meshes: impl Iterator<Item = (u32, &'m Mesh)>) -> BTreeMap<u32, Mesh> {
        let changed = meshes.filter(|(_, mesh)| self.changes_triangles(mesh));
        changed.map(|(number, mesh)| (number, mesh.clone())).collect()
    }

    /// Whether a mesh gets other triangles, or more vertices: some of its triangles are unusable, or need tangents.
    fn changes_triangles(&self, mesh: &Mesh) -> bool {
        let is_broken = || !mesh.positions.iter().copied().all(is_usable);
        check_mesh(mesh, self.materials).is_ok()
            && (tangents::are_missing(mesh, &self.tangent_sets) || is_broken())
    }

    /// Whether tangents are derived for triangles of a material, if the mesh has normals and texture coordinates but none.
    #[must_use]
    pub fn needs_tangents(&self, material: u32) -> bool {
        self.tangent_sets.get(material as usize).is_some_and(Option::is_some)
    }
}

impl MeshExtent {
    fn of(mesh: &Mesh) -> Self {
        Self { bounds: mesh.bounds(), triangles: mesh.triangles.len() as u64 }
    }
}

impl Scene {
    /// Checks `desc`, repairs what can be repaired (and says so in [`Scene::diagnostics`]).
    ///
    /// Triangles with non-finite corners collapse to a point, so that triangle numbers stay; positions are snapped to
    /// the mesh's [`Lattice`]; tangents are derived where a material needs them; instances with a non-finite or singular matrix are dropped, or hidden where the scene moves; a scene without material,
    /// camera or light gets a neutral one of each.
    ///
    /// # Errors
    /// The first error that the importer noted, or the first index out of range.
    pub fn new(mut desc: SceneDesc) -> Result<Self, SceneError> {
        if let Some(error) = desc.diagnostics.first_error() {
            return Err(error.clone().into());
        }
        if desc.materials.is_empty() {
            desc.materials.push(Material::new("neutral"));
        }
        let numbers = if desc.motion.is_some() { sorted_numbers(&desc.instances) } else { Vec::new() };
        let instances = Instances::new(std::mem::take(&mut desc.instances), desc.meshes.len())?;
        check_indices(&desc)?;
        let preparation = MeshPreparation::new(&desc);
        let mut meshes = std::mem::take(&mut desc.meshes);
        let kept = (0..).zip(&meshes).filter(|_| desc.motion.is_some());
        let described = preparation.described(kept);
        let found: Vec<_> = meshes.par_iter_mut().map(|mesh| preparation.prepare(mesh)).collect();
        for found in found {
            found?.into_iter().for_each(|diagnostic| desc.diagnostics.push(diagnostic));
        }
        let extents = meshes.par_iter().map(MeshExtent::of).collect();
        desc.meshes = meshes;
        Ok(Self { numbers, described, ..Self::complete(desc, instances, extents) })
    }

    /// What moves in the scene, if anything does.
    #[must_use]
    pub fn motion(&self) -> Option<&Arc<dyn Motion>> {
        self.desc.motion.as_ref()
    }

    /// Gives what moves the places and the vertices of a moment: the scene is then the one that [`Scene::new`] makes of
    /// [`SceneDesc::at`], but for a camera that it added.
    ///
    /// The table of instances is changed in place where nobody else keeps it ([`Scene::shared_instances`]). A shutter is closed.
    ///
    /// # Errors
    /// The pose does not fit; then nothing is changed.
    pub fn pose(&mut self, pose: Pose) -> Result<Change, SceneError> {
        let bare = pose.meshes.iter().filter(|posed| posed.tangents.is_empty());
        bare.for_each(|posed| self.keep_described(posed.mesh));
        let Self { desc, numbers, extents, described, .. } = self;
        let at_rest = |mesh: usize| described.get(&(mesh as u32)).unwrap_or(&desc.meshes[mesh]);
        desc.check_pose(&pose, self.instances.len(), at_rest)?;
        let number = |place: u32| numbers.get(place as usize).copied().unwrap_or(place);
        let places = Arc::make_mut(&mut self.instances);
        pose.instances.iter().for_each(|&(place, map)| places.put(number(place), map));
        let instances = ascending(pose.instances.iter().map(|&(place, _)| number(place)));
        let meshes = ascending(pose.meshes.iter().map(|posed| posed.mesh));
        for mesh in &meshes {
            if let Some(described) = described.get(mesh) {
                desc.meshes[*mesh as usize].clone_from(described);
            }
        }
        desc.apply_but_instances(pose);
        let preparation = MeshPreparation::new(desc);
        let posed = desc.meshes.par_iter_mut().zip(extents).enumerate();
        posed.filter(|(i, _)| meshes.binary_search(&(*i as u32)).is_ok()).try_for_each(
            |(_, (mesh, extent))| {
                preparation.prepare(mesh)?;
                *extent = MeshExtent::of(mesh);
                Ok::<_, SceneError>(())
            },
        )?;
        let change = Change { meshes, instances };
        self.bounds.update(&self.instances, &self.extents, &change);
        self.shutter = None;
        Ok(change)
    }

    /// What moves while the shutter is open, if it is: see [`Scene::open_shutter`].
    #[inline]
    #[must_use]
    pub fn shutter(&self) -> Option<&Arc<Shutter>> {
        self.shutter.as_ref()
    }

    pub(crate) fn set_shutter(&mut self, shutter: Shutter) {
        self.shutter = Some(Arc::new(shutter));
    }

    /// Changes materials, lights without surface, the environment, and images that these need; whatever else `change` does is an error.
    /// Meshes keep the tangents that they have. After an error all is as it was.
    ///
    /// # Errors
    /// Those of `change`, and of what it leaves.
    pub fn revise<E: From<SceneError>>(
        &mut self,
        change: impl FnOnce(&mut SceneDesc) -> Result<(), E>,
    ) -> Result<(), E> {
        let Self { desc, environment, .. } = self;
        let before =
            (desc.materials.clone(), desc.lights.clone(), desc.environment.clone(), desc.images.len());
        let sizes = |desc: &SceneDesc| [desc.materials.len(), desc.lights.len(), desc.meshes.len()];
        let expected = sizes(desc);
        let outcome = change(desc).and_then(|()| {
            if sizes(desc) != expected {
                return Err(SceneError::new("a table has another length", "scene", "").into());
            }
            Ok(check_indices(desc)?)
        });
        if outcome.is_err() {
            (desc.materials, desc.lights, desc.environment) = (before.0, before.1, before.2);
            desc.images.truncate(before.3);
        }
        *environment = desc.surroundings();
        outcome
    }

    /// A scene whose meshes went through [`MeshPreparation`] and of which some are elsewhere: those have names and parts
    /// alone. The meshes `deforming`, ascending, get other vertices with each pose, are here, and were not prepared. `instances`
    /// stand in the place of those of `desc`; `extents` says what all meshes are.
    ///
    /// # Errors
    /// The first index out of range.
    pub fn with_meshes_elsewhere(
        mut desc: SceneDesc,
        instances: Instances,
        mut extents: Vec<MeshExtent>,
        deforming: &[u32],
    ) -> Result<Self, SceneError> {
        let meshes = desc.meshes.len();
        if desc.materials.is_empty() || extents.len() != meshes || instances.starts().len() != meshes {
            return Err(SceneError::new("a table is missing", "scene", ""));
        }
        check_indices(&desc)?;
        desc.meshes.iter().try_for_each(|mesh| check_mesh(mesh, desc.materials.len()))?;
        let preparation = MeshPreparation::new(&desc);
        let deforms = |number: usize| deforming.binary_search(&(number as u32)).is_ok();
        let described = (0..).zip(&desc.meshes).filter(|(number, _)| deforms(*number as usize));
        let described = preparation.described(described);
        let all = desc.meshes.par_iter_mut().zip(&mut extents).enumerate();
        all.filter(|(number, _)| deforms(*number)).try_for_each(|(_, (mesh, extent))| {
            preparation.prepare(mesh)?;
            *extent = MeshExtent::of(mesh);
            Ok::<_, SceneError>(())
        })?;
        Ok(Self { described, ..Self::complete(desc, instances, extents) })
    }

    /// Adds what a description lacks.
    fn complete(mut desc: SceneDesc, mut instances: Instances, extents: Vec<MeshExtent>) -> Self {
        desc.instances = Vec::new();
        if desc.motion.is_none() {
            drop_singular_instances(&mut instances, &mut desc.diagnostics);
        }
        let bounds = WorldBounds::new(&instances, &extents);
        let framed = desc.cameras.is_empty();
        if framed {
            desc.cameras.push(Camera::framing(&bounds.all));
        }
        warn_of_implicit_lamps(&mut desc);
        warn_of_black_surroundings(&mut desc);
        let environment = desc.surroundings();
        Self {
            desc,
            instances: Arc::new(instances),
            environment,
            bounds,
            extents,
            numbers: Vec::new(),
            described: BTreeMap::new(),
            shutter: None,
            framed,
        }
    }

    /// Keeps a mesh as it is now, if tangents are derived for it with each pose, which may split vertices.
    fn keep_described(&mut self, number: u32) {
        let Some(mesh) = self.desc.meshes.get(number as usize) else { return };
        if mesh.uvs.is_empty() || self.described.contains_key(&number) {
            return;
        }
        let preparation = MeshPreparation::new(&self.desc);
        let mut materials = mesh.parts.iter().map(|part| part.material).chain([mesh.material_of(0)]);
        if materials.any(|material| preparation.needs_tangents(material)) {
            self.described.insert(number, Mesh { tangents: Vec::new(), ..mesh.clone() });
        }
    }

    /// The vertices of a mesh that a pose gives other places: copies that preparation made come after them.
    ///
    /// # Panics
    /// If there is no such mesh.
    #[must_use]
    pub fn posed_vertices(&self, mesh: u32) -> &[Vec3] {
        let positions = &self.desc.meshes[mesh as usize].positions;
        let count = self.described.get(&mesh).map_or(positions.len(), |described| described.positions.len());
        &positions[..count]
    }

    /// Where an instance stands in the description's table, as poses count.
    #[must_use]
    pub fn place_in_table(&self, instance: u32) -> u32 {
        let place = self.numbers.iter().position(|&number| number == instance);
        place.map_or(instance, |place| place as u32)
    }

    /// The description, completed, with the instances and all else as it is at the moment; a camera that was added is not in it.
    #[must_use]
    pub fn into_whole_desc(mut self) -> SceneDesc {
        for (number, mut mesh) in std::mem::take(&mut self.described) {
            let now = &mut self.desc.meshes[number as usize];
            let count = mesh.positions.len();
            mesh.positions.copy_from_slice(&now.positions[..count]);
            let normals = mesh.normals.len();
            mesh.normals.copy_from_slice(&now.normals[..normals]);
            *now = mesh;
        }
        let place = |i: usize| self.numbers.get(i).map_or(i, |&number| number as usize);
        self.desc.instances =
            (0..self.instances.len()).filter_map(|i| self.instances.get(place(i))).collect();
        if self.framed {
            self.desc.cameras.clear();
        }
        self.desc
    }

    /// The description, completed, without the instances.
    #[must_use]
    pub fn desc(&self) -> &SceneDesc {
        &self.desc
    }

    /// The description, completed, without the instances, for one who needs nothing else of the scene. Meshes that move are such
    /// that poses fit them.
    #[must_use]
    pub fn into_desc(mut self) -> SceneDesc {
        for (number, mesh) in self.described {
            self.desc.meshes[number as usize] = mesh;
        }
        self.desc
    }

    /// What the meshes are, in their order, be they in memory or elsewhere.
    #[must_use]
    pub fn extents(&self) -> &[MeshExtent] {
        &self.extents
    }

    /// Meshes, shared by instances.
    #[must_use]
    pub fn meshes(&self) -> &[Mesh] {
        &self.desc.meshes
    }

    /// Placements of meshes, in the order of the meshes; an instance's number is its id.
    #[must_use]
    pub fn instances(&self) -> &Instances {
        &self.instances
    }

    /// The same to be kept.
    #[must_use]
    pub fn shared_instances(&self) -> Arc<Instances> {
        Arc::clone(&self.instances)
    }

    /// The name of an instance.
    #[must_use]
    pub fn instance_name(&self, instance: u32) -> &str {
        self.name(self.instances.name(instance as usize))
    }

    /// The name that instances refer to by this number; empty where there is none.
    #[must_use]
    pub fn name(&self, name: u32) -> &str {
        self.desc.names.get(name as usize).map_or("", String::as_str)
    }

    /// Materials, at least one.
    #[must_use]
    pub fn materials(&self) -> &[Material] {
        &self.desc.materials
    }

    /// Textures.
    #[must_use]
    pub fn textures(&self) -> &[Texture] {
        &self.desc.textures
    }

    /// Images.
    #[must_use]
    pub fn images(&self) -> &[Image] {
        &self.desc.images
    }

    /// Lights without surface.
    #[must_use]
    pub fn lights(&self) -> &[Light] {
        &self.desc.lights
    }

    /// Cameras, at least one.
    #[must_use]
    pub fn cameras(&self) -> &[Camera] {
        &self.desc.cameras
    }

    /// Light from infinity.
    #[must_use]
    pub fn environment(&self) -> &Environment {
        &self.environment
    }

    /// An implicit surface, if the scene has one.
    #[must_use]
    pub fn implicit_mesh(&self) -> Option<&Mesh> {
        self.desc.meshes.iter().find(|mesh| mesh.implicit.is_some())
    }

    /// Findings of the importer and of the validation.
    #[must_use]
    pub fn diagnostics(&self) -> &Diagnostics {
        &self.desc.diagnostics
    }

    /// The box around all instances in world space; empty for an empty scene.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.bounds.all
    }

    /// Triangles in all meshes, each mesh counted once.
    #[must_use]
    pub fn unique_triangles(&self) -> u64 {
        self.extents.iter().map(|m| m.triangles).sum()
    }

    /// Triangles in all instances.
    #[must_use]
    pub fn instanced_triangles(&self) -> u64 {
        let placed =
            |(mesh, extent): (u32, &MeshExtent)| extent.triangles * self.instances.of_mesh(mesh).len() as u64;
        (0..).zip(&self.extents).map(placed).sum()
    }
}

/// The numbers that instances get when they are sorted by mesh; none where they are.
pub(crate) fn sorted_numbers(instances: &[Instance]) -> Vec<u32> {
    if instances.is_sorted_by_key(|i| i.mesh) {
        return Vec::new();
    }
    let mut places: Vec<u32> = (0..instances.len() as u32).collect();
    places.sort_by_key(|&place| instances[place as usize].mesh);
    let mut numbers = vec![0; places.len()];
    (0..).zip(places).for_each(|(number, place)| numbers[place as usize] = number);
    numbers
}

fn ascending(numbers: impl Iterator<Item = u32>) -> Vec<u32> {
    let mut numbers: Vec<u32> = numbers.collect();
    numbers.sort_unstable();
    numbers.dedup();
    numbers
}

/// Every index between tables is in range, every attribute array has its length.
fn check_indices(desc: &SceneDesc) -> Result<(), SceneError> {
    for (i, texture) in desc.textures.iter().enumerate() {
        if texture.image as usize >= desc.images.len() {
            return Err(SceneError::new(
                format!("image {} does not exist", texture.image),
                format!("texture {i}"),
                "",
            ));
        }
    }
    Ok(())
}

fn check_mesh(mesh: &Mesh, materials: usize) -> Result<(), SceneError> {
    let error = |what: String| Err(SceneError::new(what, format!("mesh \"{}\"", mesh.name), ""));
    if let Some(shape) = &mesh.implicit {
        if !mesh.triangles.is_empty() || mesh.parts.len() > 1 {
            return error("an implicit surface has no triangles and one material".into());
        }
        if let Err(what) = shape.check() {
            return error(what);
        }
    }
    let vertices = mesh.positions.len();
    if let Some(i) = mesh.triangles.iter().flatten().find(|&&i| i as usize >= vertices) {
        return error(format!("vertex index {i} is out of range, there are {vertices} vertices"));
    }
    let lengths = [mesh.normals.len(), mesh.tangents.len(), mesh.colors.len()];
    let uv_lengths = mesh.uvs.iter().map(Vec::len);
    if let Some(n) = lengths.into_iter().chain(uv_lengths).find(|&n| n != 0 && n != vertices) {
        return error(format!("an attribute has {n} values for {vertices} vertices"));
    }
    let ascending = mesh.parts.windows(2).all(|w| w[0].first_triangle < w[1].first_triangle);
    if !ascending || mesh.parts.first().is_some_and(|p| p.first_triangle != 0) {
        return error("material parts do not follow each other from triangle 0".into());
    }
    match mesh.parts.iter().find(|p: &&Part| p.material as usize >= materials) {
        Some(part) => error(format!("material {} does not exist", part.material)),
        None => Ok(()),
    }
}

/// Whether a position can be kept. Coordinates beyond 1e15 overflow in products; a lattice through them would swallow
/// everything else as well.
#[must_use]
pub fn is_usable(p: Vec3) -> bool {
    const LIMIT: f32 = 1e15;
    p.abs().cmple(Vec3::splat(LIMIT)).all()
}

/// Collapses unusable triangles, snaps positions, and says what was found.
fn repair_mesh(mesh: &mut Mesh) -> Vec<Diagnostic> {
    if mesh.implicit.is_some() {
        return Vec::new();
    }
    let mut found = TriangleFindings::default();
    for triangle in &mut mesh.triangles {
        if !found.look_at(triangle.map(|i| mesh.positions[i as usize])) {
            *triangle = [0; 3];
        }
    }
    let mut max_abs = 0.0_f32;
    for p in &mut mesh.positions {
        if is_usable(*p) {
            max_abs = max_abs.max(p.abs().max_element());
        } else {
            *p = Vec3::ZERO;
        }
    }
    let lattice = Lattice::for_extent(max_abs);
    mesh.positions.iter_mut().for_each(|p| *p = lattice.snap(*p));
    found.of_mesh(&mesh.name)
}

/// What is wrong with the triangles of a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TriangleFindings {
    triangles: u64,
    broken: u64,
    degenerate: u64,
}

impl TriangleFindings {
    /// Looks at the corners of the next triangle as they came; false for one that must collapse to the first vertex.
    pub fn look_at(&mut self, [a, b, c]: [Vec3; 3]) -> bool {
        self.triangles += 1;
        let usable = is_usable(a) && is_usable(b) && is_usable(c);
        if !usable {
            self.broken += 1;
        } else if a == b || b == c || c == a {
            self.degenerate += 1;
        }
        usable
    }

    /// What to say about it.
    #[must_use]
    pub fn of_mesh(&self, name: &str) -> Vec<Diagnostic> {
        let Self { triangles, broken, degenerate } = self;
        let mut found = Vec::new();
        let mut warn = |what: String, hint: &str| {
            found.push(Diagnostic {
                severity: crate::Severity::Warning,
                what,
                place: format!("mesh \"{name}\""),
                hint: hint.into(),
            });
        };
        if *broken > 0 {
            warn(
                format!("{broken} triangles have coordinates that are not finite or beyond 1e15"),
                "they are left out",
            );
        }
        if *degenerate > 0 {
            warn(format!("{degenerate} triangles have two equal corners"), "no ray hits them");
        }
        if *triangles == 0 {
            warn("the mesh has no triangles".into(), "");
        }
        found
    }
}

/// Whether a mesh can be placed by this map: it is finite, and so is its inverse.
#[must_use]
pub fn can_be_placed(world_from_object: &Affine3) -> bool {
    world_from_object.is_finite() && world_from_object.inverse().is_finite()
}

fn drop_singular_instances(instances: &mut Instances, diagnostics: &mut Diagnostics) {
    let dropped = instances.drop_singular();
    if dropped > 0 {
        diagnostics.warn(
            format!("{dropped} instances have a matrix that is singular or not finite"),
            "instances",
            "they are left out",
        );
    }
}

/// Only triangles are lights that can be asked for.
fn warn_of_implicit_lamps(desc: &mut SceneDesc) {
    let shines =
        |mesh: &&Mesh| mesh.implicit.is_some() && desc.materials[mesh.material_of(0) as usize].is_emissive();
    if let Some(mesh) = desc.meshes.iter().find(shines) {
        let place = format!("mesh \"{}\"", mesh.name);
        let what = "an implicit surface that emits lights others by chance alone, with much noise";
        desc.diagnostics.warn(what, place, "put a lamp of triangles beside it");
    }
}

fn has_lamp(desc: &SceneDesc) -> bool {
    desc.materials.iter().any(|m| m.is_emissive() && m.emission.factor.max_element() > 1.0)
}

fn warn_of_black_surroundings(desc: &mut SceneDesc) {
    if desc.environment.is_none() && !desc.lights.is_empty() && !has_lamp(desc) {
        let hint = "viewers may add some; --sun AZ,EL or --env FILE does here";
        desc.diagnostics.warn("the scene has lights but no surroundings, so those are black", "lights", hint);
    }
}

impl SceneDesc {
    /// What the description says, or a sky where nothing else lights the scene.
    ///
    /// A material that emits no more than a radiance of 1 is a glowing label or display, not a lamp: files full of those
    /// are meant to be seen under a viewer's own light. Lights without surface alone are a choice of the author's, but not
    /// what a viewer with surroundings of its own would show, so a hint stands in the diagnostics.
    #[must_use]
    pub fn surroundings(&self) -> Environment {
        match &self.environment {
            Some(environment) => environment.clone(),
            None if !self.lights.is_empty() || has_lamp(self) => Environment::Constant(Vec3::ZERO),
            None => Environment::Sky(Sky::default()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ImplicitShape, Metaball, Metaballs};

    fn one_ball(threshold: f32) -> SceneDesc {
        let balls = vec![Metaball { center: Vec3::X, radius: 2.0, strength: 1.0 }];
        let shape = ImplicitShape::Metaballs(Metaballs { balls, threshold });
        let mut desc = one_triangle();
        desc.meshes[0] = Mesh { name: "ball".into(), implicit: Some(Arc::new(shape)), ..Mesh::default() };
        desc
    }

    #[test]
    fn looks_change_alone_and_whole_or_not_at_all() {
        let mut scene = Scene::new(one_triangle()).expect("valid");
        let before = scene.clone();
        let darken = |desc: &mut SceneDesc| {
            desc.materials[0].roughness = crate::ScalarInput::new(0.25);
            desc.environment = Some(Environment::Constant(Vec3::ONE));
            Ok::<_, SceneError>(())
        };
        scene.revise(darken).expect("revised");
        assert_eq!(scene.materials()[0].roughness.factor, 0.25);
        assert_eq!(*scene.environment(), Environment::Constant(Vec3::ONE));
        let mut other = before.clone();
        let wrong = |desc: &mut SceneDesc| {
            darken(desc)?;
            desc.materials.clear();
            Ok::<_, SceneError>(())
        };
        assert!(other.revise(wrong).is_err());
        assert_eq!((other.materials(), other.environment()), (before.materials(), before.environment()));
    }

    #[test]
    fn implicit_surfaces_are_meshes_without_triangles() {
        let scene = Scene::new(one_ball(0.5)).expect("valid");
        assert!(scene.diagnostics().items().is_empty());
        // The field of strength 1 and radius 2 is one half at this distance.
        let reach = 2.0 * (1.0 - 0.5_f32.cbrt()).sqrt();
        let around = |reach: f32| Aabb { min: Vec3::X - reach, max: Vec3::X + reach };
        assert!(scene.bounds().contains(&around(reach)), "{:?}", scene.bounds());
        assert!(around(reach + 0.35).contains(&scene.bounds()), "{:?}", scene.bounds());
        assert_eq!(scene.implicit_mesh().map(|mesh| mesh.name.as_str()), Some("ball"));
        let error = Scene::new(one_ball(2.0)).expect_err("nothing is inside");
        assert!(error.to_string().contains("ball"), "{error}");
        let mut both = one_ball(0.5);
        both.meshes[0].positions = vec![Vec3::ZERO];
        both.meshes[0].triangles = vec![[0; 3]];
        assert!(Scene::new(both).expect_err("both").to_string().contains("no triangles"));
        let mut lamp = one_ball(0.5);
        lamp.materials.push(Material::emitter("lamp", Vec3::ONE, true));
        let lamp = Scene::new(lamp).expect("valid");
        assert!(lamp.diagnostics().items().iter().any(|item| item.what.contains("by chance")));
    }

    fn one_triangle() -> SceneDesc {
        SceneDesc {
            meshes: vec![Mesh {
                positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
                triangles: vec![[0, 1, 2]],
                ..Mesh::default()
            }],
            instances: vec![Instance { world_from_object: Affine3::IDENTITY, mesh: 0, name: 0 }],
            ..SceneDesc::default()
        }
    }

    #[test]
    fn a_bare_mesh_becomes_a_scene_with_material_camera_and_sky() {
        let scene = Scene::new(one_triangle()).expect("valid");
        assert_eq!((scene.materials().len(), scene.cameras().len()), (1, 1));
        assert!(matches!(scene.environment(), Environment::Sky(_)));
        assert_eq!(scene.bounds(), Aabb { min: Vec3::ZERO, max: Vec3::new(1.0, 1.0, 0.0) });
    }

    #[test]
    fn lamps_replace_the_default_sky_and_labels_do_not() {
        for (radiance, lit_by_sky) in [(1.0, true), (5.0, false)] {
            let mut desc = one_triangle();
            desc.materials.push(Material::emitter("glow", Vec3::splat(radiance), false));
            let scene = Scene::new(desc).expect("valid");
            assert_eq!(matches!(scene.environment(), Environment::Sky(_)), lit_by_sky);
        }
    }

    #[test]
    fn lights_alone_shine_as_authored_with_a_hint_about_black_surroundings() {
        let light = Light {
            name: "bulb".into(),
            kind: crate::LightKind::Point,
            world_from_light: Affine3::IDENTITY,
            intensity: Vec3::ONE,
            range: f32::INFINITY,
            profile: None,
        };
        let dark = Environment::Constant(Vec3::ZERO);
        for (environment, hints) in [(None, 1), (Some(dark.clone()), 0)] {
            let desc = SceneDesc { lights: vec![light.clone()], environment, ..one_triangle() };
            let scene = Scene::new(desc).expect("valid");
            let found = scene.diagnostics().items();
            assert_eq!((scene.environment(), found.len()), (&dark, hints));
            assert!(found.iter().all(|f| f.what.contains("surroundings")), "{found:?}");
        }
    }

    #[test]
    fn wrong_indices_are_errors_and_nan_is_survived() {
        let mut desc = one_triangle();
        desc.meshes[0].triangles.push([0, 1, 3]);
        assert!(Scene::new(desc).expect_err("out of range").what.contains("vertex index 3"));

        let mut desc = one_triangle();
        desc.meshes[0].positions.push(Vec3::splat(f32::NAN));
        desc.meshes[0].triangles.push([0, 1, 3]);
        let scene = Scene::new(desc).expect("survived");
        assert_eq!(scene.meshes()[0].triangles.len(), 2);
        assert_eq!(scene.diagnostics().items().len(), 1);
        assert!(scene.bounds().max.is_finite());
    }

    #[test]
    fn a_mesh_prepared_alone_is_that_of_the_scene() {
        let mut desc = one_triangle();
        desc.meshes[0].positions = vec![Vec3::ZERO, Vec3::new(1234.567, 0.1, 0.0), Vec3::Y * 1e-5];
        let mut mesh = desc.meshes[0].clone();
        let scene = Scene::new(desc).expect("valid");
        assert_ne!(mesh, scene.meshes()[0]);
        MeshPreparation::new(scene.desc()).prepare(&mut mesh).expect("valid");
        assert_eq!(mesh, scene.meshes()[0]);
        mesh.triangles.push([0, 1, 9]);
        assert!(
            MeshPreparation::new(scene.desc())
                .prepare(&mut mesh)
                .expect_err("out of range")
                .what
                .contains("vertex index 9")
        );
    }

    #[test]
    fn singular_instances_are_dropped_with_a_warning() {
        let mut desc = one_triangle();
        let flat = Affine3::from_scale(Vec3::new(1.0, 0.0, 1.0));
        desc.instances.push(Instance { world_from_object: flat, mesh: 0, name: 0 });
        let scene = Scene::new(desc).expect("valid");
        assert_eq!(scene.instances().len(), 1);
        assert_eq!(scene.diagnostics().items().len(), 1);
    }
}
