//! Changes of a session's scene that are no looks: places, vertices, things that come and go.

use crate::{Error, Session};
use std::collections::{BTreeSet, HashMap, HashSet};
use std::f32::consts::PI;
use vastlight_math::{Affine3, Vec3};
use vastlight_scene::{
    Camera, Instance, Light, LightKind, Material, Mesh, MeshPose, MeshPreparation, Part, Pose, Projection,
    Scene, SceneDesc, SceneError, can_be_placed, is_usable,
};
use vastlight_trace::PoseReport;

/// Something that is put into a scene.
#[derive(Clone, Debug)]
pub enum Addition {
    /// A mesh, placed once under its name.
    Mesh {
        /// The mesh; its parts are set to the material.
        mesh: Box<Mesh>,
        /// Its material by name; none for a neutral one.
        material: Option<String>,
        /// Where it stands.
        world_from_object: Affine3,
    },
    /// A material, in place of one of that name if there is one.
    Material(Box<Material>),
    /// A light without surface.
    Light(Light),
    /// A camera.
    Camera(Camera),
}

/// The name of what has no material of its own.
const NEUTRAL: &str = "neutral";

/// Things of a scene that have names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Table {
    /// Materials.
    Materials,
    /// Lights without surface.
    Lights,
    /// Cameras.
    Cameras,
}

impl Table {
    /// All tables.
    pub(crate) const ALL: [Self; 3] = [Self::Materials, Self::Lights, Self::Cameras];
}

impl Addition {
    /// Refuses what a scene does not take: a mesh with an index or an attribute that is wrong, a place that is singular or not
    /// finite, numbers that mean nothing.
    fn checked(mut self) -> Result<Self, Error> {
        match &mut self {
            Self::Mesh { mesh, world_from_object, .. } => {
                mesh.parts.clear();
                if let Some(vertex) = mesh.positions.iter().position(|&p| !is_usable(p)) {
                    let what = format!("vertex {vertex} is not finite or beyond 1e15");
                    return Err(Error::scene(what, format!("mesh \"{}\"", mesh.name), ""));
                }
                check_normals(&mesh.normals, &mesh.name)?;
                MeshPreparation::new(&SceneDesc::default()).check(mesh)?;
                check_place(world_from_object, &mesh.name)?;
            }
            Self::Material(_) => {}
            Self::Light(light) => check_light(light)?,
            Self::Camera(camera) => check_camera(camera)?,
        }
        Ok(self)
    }

    /// The name that it brings into a table.
    fn name_in(&self, table: Table) -> Option<&str> {
        match (self, table) {
            (Self::Mesh { material: None, .. }, Table::Materials) => Some(NEUTRAL),
            (Self::Material(material), Table::Materials) => Some(&material.name),
            (Self::Light(light), Table::Lights) => Some(&light.name),
            (Self::Camera(camera), Table::Cameras) => Some(&camera.name),
            _ => None,
        }
    }
}

/// Notes the names that an addition brings.
fn wait(waiting: &mut [HashSet<String>; Table::ALL.len()], addition: &Addition) {
    for table in Table::ALL {
        if let Some(name) = addition.name_in(table) {
            waiting[table as usize].insert(name.to_owned());
        }
    }
}

/// A description into which things are put.
struct Incoming<'d> {
    desc: &'d mut SceneDesc,
    /// The first material of each name.
    materials: HashMap<String, u32>,
}

impl<'d> Incoming<'d> {
    fn new(desc: &'d mut SceneDesc) -> Self {
        let mut materials = HashMap::new();
        for (number, material) in (0..).zip(&desc.materials) {
            materials.entry(material.name.clone()).or_insert(number);
        }
        Self { desc, materials }
    }

    fn put(&mut self, addition: Addition) -> Result<(), Error> {
        match addition {
            Addition::Mesh { mut mesh, material, world_from_object } => {
                let material = self.material(material.as_deref())?;
                let desc = &mut *self.desc;
                mesh.parts = vec![Part { first_triangle: 0, material }];
                let (number, name) = (desc.meshes.len() as u32, desc.names.len() as u32);
                desc.names.push(mesh.name.clone());
                desc.instances.push(Instance { world_from_object, mesh: number, name });
                desc.meshes.push(*mesh);
            }
            Addition::Material(material) => match self.materials.get(&material.name) {
                Some(&number) => self.desc.materials[number as usize] = *material,
                None => drop(self.add_material(*material)),
            },
            Addition::Light(light) => self.desc.lights.push(light),
            Addition::Camera(camera) => self.desc.cameras.push(camera),
        }
        Ok(())
    }

    fn add_material(&mut self, material: Material) -> u32 {
        let number = self.desc.materials.len() as u32;
        self.materials.insert(material.name.clone(), number);
        self.desc.materials.push(material);
        number
    }

    /// The number of a material; a neutral one is added if none was asked for and there is none.
    fn material(&mut self, name: Option<&str>) -> Result<u32, Error> {
        let wanted = name.unwrap_or(NEUTRAL);
        match self.materials.get(wanted) {
            Some(&number) => Ok(number),
            None if name.is_none() => Ok(self.add_material(Material::new(NEUTRAL))),
            None => Err(no_material(wanted)),
        }
    }
}

fn no_material(name: &str) -> Error {
    Error::scene(format!("no material is named \"{name}\""), "material", "add it first")
}

/// Refuses what is not so, in words.
fn expect(is_so: bool, what: &str, name: &str) -> Result<(), Error> {
    if is_so { Ok(()) } else { Err(Error::scene(what, format!("\"{name}\""), "")) }
}

fn check_normals(normals: &[Vec3], name: &str) -> Result<(), Error> {
    expect(normals.iter().all(|normal| normal.is_finite()), "a normal is not finite", name)
}

fn check_light(light: &Light) -> Result<(), Error> {
    let Light { name, kind, world_from_light, intensity, .. } = light;
    expect(
        intensity.is_finite() && intensity.min_element() >= 0.0,
        "the intensity must be 0 or more, and finite",
        name,
    )?;
    if let LightKind::Spot { inner, outer } = *kind {
        let fits = inner >= 0.0 && inner <= outer && outer > 0.0 && outer <= PI;
        expect(fits, "angles of a spot go from 0 over the inner and the outer one to half a turn", name)?;
    }
    check_place(world_from_light, name)
}

fn check_camera(camera: &Camera) -> Result<(), Error> {
    let Camera { name, world_from_camera, projection, .. } = camera;
    if let Projection::Perspective { vertical_fov, lens_radius, focus_distance } = *projection {
        expect(
            vertical_fov > 0.0 && vertical_fov < PI,
            "the angle of view is between 0 and 180 degrees",
            name,
        )?;
        expect(
            lens_radius >= 0.0 && lens_radius.is_finite(),
            "the lens's radius must be 0 or more, and finite",
            name,
        )?;
        let is_in_front = focus_distance > 0.0 && focus_distance.is_finite();
        expect(is_in_front, "the focus distance must be more than 0, and finite", name)?;
    }
    check_place(world_from_camera, name)
}

fn check_place(map: &Affine3, name: &str) -> Result<(), Error> {
    if can_be_placed(map) {
        return Ok(());
    }
    let hint = "give a matrix with an inverse";
    Err(Error::scene("the transform is singular or not finite", format!("\"{name}\""), hint))
}

/// Shading normals of a mesh: those of its triangles at each vertex, weighted by their areas.
fn vertex_normals(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let mut sums = vec![Vec3::ZERO; positions.len()];
    for triangle in triangles.iter().filter(|t| t.iter().all(|&i| (i as usize) < positions.len())) {
        let [a, b, c] = triangle.map(|i| positions[i as usize]);
        let normal = (b - a).cross(c - a);
        triangle.iter().for_each(|&i| sums[i as usize] += normal);
    }
    sums.into_iter().map(|sum| sum.normalize_or(Vec3::Y)).collect()
}

/// Takes instances out of a description, and meshes of which none is left.
fn take_out(desc: &mut SceneDesc, instances: &BTreeSet<usize>) {
    let gone: BTreeSet<u32> = instances.iter().map(|&i| desc.instances[i].mesh).collect();
    let mut number = 0..;
    desc.instances.retain(|_| !number.next().is_some_and(|i| instances.contains(&i)));
    let used: BTreeSet<u32> = desc.instances.iter().map(|i| i.mesh).collect();
    let is_left_out = |mesh: &u32| gone.contains(mesh) && !used.contains(mesh);
    let mut mesh = 0..;
    desc.meshes.retain(|_| !mesh.next().is_some_and(|mesh| is_left_out(&mesh)));
    for instance in &mut desc.instances {
        instance.mesh -= gone.range(..instance.mesh).filter(|mesh| is_left_out(mesh)).count() as u32;
    }
    keep_used_names(desc);
}

/// Drops names that no instance has.
fn keep_used_names(desc: &mut SceneDesc) {
    let used: BTreeSet<u32> = desc.instances.iter().map(|i| i.name).collect();
    let numbers: Vec<u32> = used.iter().copied().collect();
    desc.names = numbers.iter().map(|&i| desc.names.get(i as usize).cloned().unwrap_or_default()).collect();
    for instance in &mut desc.instances {
        instance.name = numbers.partition_point(|&number| number < instance.name) as u32;
    }
}

impl Session {
    /// Puts an instance in another place; structures follow. A moment of what moves ([`Session::pose`], [`Session::expose`]) takes it back
    /// where it moves.
    ///
    /// # Errors
    /// There is no such instance, or the place is singular.
    pub fn place(&mut self, instance: u32, world_from_object: Affine3) -> Result<PoseReport, Error> {
        if instance as usize >= self.open().scene.instances().len() {
            return Err(no_instance(instance, "scene"));
        }
        check_place(&world_from_object, self.open().scene.instance_name(instance))?;
        let place = self.open().scene.place_in_table(instance);
        self.apply(Pose { instances: vec![(place, world_from_object)], ..Pose::default() })
    }

    /// Gives a mesh other vertices, in object space; the structures are refitted, updated or rebuilt, whichever suits. Normals are
    /// derived where the mesh has some and none are given.
    ///
    /// # Errors
    /// There is no such mesh, it is not in memory, or the vertices do not fit it.
    pub fn deform(
        &mut self,
        mesh: u32,
        positions: Vec<Vec3>,
        normals: Option<Vec<Vec3>>,
    ) -> Result<PoseReport, Error> {
        let scene = &self.open().scene;
        let Some(known) = scene.meshes().get(mesh as usize) else {
            return Err(Error::scene(format!("mesh {mesh} does not exist"), "scene", ""));
        };
        if known.triangles.is_empty() {
            let place = format!("mesh \"{}\"", known.name);
            return Err(Error::usage(
                "its triangles are not in memory",
                place,
                "load the file, not its store",
            ));
        }
        check_normals(normals.as_deref().unwrap_or_default(), &known.name)?;
        let derive = || vertex_normals(&positions, &known.triangles);
        let normals = match (known.normals.is_empty(), normals) {
            (true, None) => Vec::new(),
            (true, Some(_)) => {
                let place = format!("mesh \"{}\"", known.name);
                return Err(Error::usage(
                    "the mesh has no normals to be given others",
                    place,
                    "leave them out",
                ));
            }
            (false, normals) => normals.unwrap_or_else(derive),
        };
        let posed = MeshPose { mesh, positions, normals, tangents: Vec::new() };
        self.apply(Pose { meshes: vec![posed], ..Pose::default() })
    }

    /// Puts things into the scene, all or none; instances and meshes get other numbers. Structures are built anew when they are needed.
    ///
    /// # Errors
    /// Those of [`Session::put`].
    pub fn add(&mut self, additions: Vec<Addition>) -> Result<(), Error> {
        self.put(additions)?;
        self.settle()
    }

    /// Lets things wait for [`Session::settle`], all or none: many that are put in together cost no more than one.
    ///
    /// # Errors
    /// A mesh with an index or an attribute that is wrong, a place that is singular or not finite, numbers that mean nothing, a
    /// material that is not there; or the scene is in a store.
    pub fn put(&mut self, additions: Vec<Addition>) -> Result<(), Error> {
        self.refuse_store()?;
        let before = self.pending.len();
        let outcome = additions.into_iter().try_for_each(|addition| self.put_one(addition));
        if outcome.is_err() {
            self.pending.truncate(before);
            self.waiting = Default::default();
            self.pending.iter().for_each(|addition| wait(&mut self.waiting, addition));
        }
        outcome
    }

    fn put_one(&mut self, addition: Addition) -> Result<(), Error> {
        let addition = addition.checked()?;
        match &addition {
            Addition::Mesh { material: Some(name), .. } if !self.has(Table::Materials, name) => {
                return Err(no_material(name));
            }
            _ => {}
        }
        wait(&mut self.waiting, &addition);
        self.pending.push(addition);
        Ok(())
    }

    /// Puts what waits into the scene.
    ///
    /// # Errors
    /// Those of a scene.
    pub fn settle(&mut self) -> Result<(), Error> {
        if self.pending.is_empty() {
            return Ok(());
        }
        self.waiting = Default::default();
        let mut additions = std::mem::take(&mut self.pending).into_iter();
        self.rebuild(|desc| {
            let mut incoming = Incoming::new(desc);
            additions.try_for_each(|addition| incoming.put(addition))
        })
    }

    /// Names in a table, in its order and with those of what waits; each as often as it is there.
    #[must_use]
    pub fn names_in(&self, table: Table) -> Vec<&str> {
        let desc = self.open().scene.desc();
        let mut names: Vec<&str> = match table {
            Table::Materials => desc.materials.iter().map(|m| m.name.as_str()).collect(),
            Table::Lights => desc.lights.iter().map(|l| l.name.as_str()).collect(),
            Table::Cameras => desc.cameras.iter().map(|c| c.name.as_str()).collect(),
        };
        names.extend(self.pending.iter().filter_map(|addition| addition.name_in(table)));
        names
    }

    /// Whether a name is in a table, or waits for it.
    #[must_use]
    pub fn has(&self, table: Table, name: &str) -> bool {
        let desc = self.open().scene.desc();
        let is_there = match table {
            Table::Materials => desc.materials.iter().any(|m| m.name == name),
            Table::Lights => desc.lights.iter().any(|l| l.name == name),
            Table::Cameras => desc.cameras.iter().any(|c| c.name == name),
        };
        is_there || self.waiting[table as usize].contains(name)
    }

    /// Takes instances out of the scene, and meshes of which none is left; others get other numbers.
    ///
    /// # Errors
    /// There is no such instance, the scene moves, or is in a store.
    pub fn remove(&mut self, instances: &[u32]) -> Result<(), Error> {
        self.settle()?;
        let scene = &self.open().scene;
        if scene.motion().is_some() {
            let hint = "put it out of sight by its transform";
            return Err(Error::usage("nothing is taken out of a scene that moves", "remove", hint));
        }
        let count = scene.instances().len();
        if let Some(outside) = instances.iter().find(|&&i| i as usize >= count) {
            return Err(no_instance(*outside, "remove"));
        }
        let instances = instances.iter().map(|&i| i as usize).collect();
        self.rebuild(|desc| {
            take_out(desc, &instances);
            Ok(())
        })
    }
}

fn no_instance(number: u32, place: &str) -> Error {
    Error::scene(format!("instance {number} does not exist"), place, "")
}

/// The scene of a changed description.
pub(crate) fn changed(
    scene: Scene,
    change: impl FnOnce(&mut SceneDesc) -> Result<(), Error>,
) -> Result<Scene, Error> {
    let mut desc = scene.into_whole_desc();
    change(&mut desc)?;
    Scene::new(desc).map_err(|error: SceneError| error.into())
}
