//! Changes of a session's scene that are no looks: places, vertices, things that come and go.

use crate::{Error, Session};
use std::collections::BTreeSet;
use vastlight_math::{Affine3, Vec3};
use vastlight_scene::{
    Camera, Instance, Light, Material, Mesh, MeshPose, MeshPreparation, Part, Pose, Scene, SceneDesc,
    SceneError, can_be_placed, is_usable,
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
    /// A material; one of that name stays what it is.
    Material(Box<Material>),
    /// A light without surface.
    Light(Light),
    /// A camera.
    Camera(Camera),
}

/// The name of what has no material of its own.
const NEUTRAL: &str = "neutral";

impl Addition {
    /// Refuses what a scene does not take.
    ///
    /// # Errors
    /// A mesh with an index or an attribute that is wrong, or a place that is singular or not finite.
    pub fn check(&self) -> Result<(), Error> {
        match self {
            Self::Mesh { mesh, world_from_object, .. } => {
                if let Some(vertex) = mesh.positions.iter().position(|&p| !is_usable(p)) {
                    let what = format!("vertex {vertex} is not finite or beyond 1e15");
                    return Err(Error::scene(what, format!("mesh \"{}\"", mesh.name), ""));
                }
                MeshPreparation::new(&SceneDesc::default()).check(mesh)?;
                check_place(world_from_object, &mesh.name)
            }
            Self::Material(_) => Ok(()),
            Self::Light(light) => check_place(&light.world_from_light, &light.name),
            Self::Camera(camera) => check_place(&camera.world_from_camera, &camera.name),
        }
    }

    /// Puts it into a description.
    fn put(self, desc: &mut SceneDesc) -> Result<(), Error> {
        match self {
            Self::Mesh { mut mesh, material, world_from_object } => {
                let material = material_number(desc, material.as_deref())?;
                mesh.parts = vec![Part { first_triangle: 0, material }];
                let (number, name) = (desc.meshes.len() as u32, desc.names.len() as u32);
                desc.names.push(mesh.name.clone());
                desc.instances.push(Instance { world_from_object, mesh: number, name });
                desc.meshes.push(*mesh);
            }
            Self::Material(material) => {
                if !desc.materials.iter().any(|known| known.name == material.name) {
                    desc.materials.push(*material);
                }
            }
            Self::Light(light) => desc.lights.push(light),
            Self::Camera(camera) => desc.cameras.push(camera),
        }
        Ok(())
    }
}

fn check_place(map: &Affine3, name: &str) -> Result<(), Error> {
    if can_be_placed(map) {
        return Ok(());
    }
    let hint = "give a matrix with an inverse";
    Err(Error::scene("the transform is singular or not finite", format!("\"{name}\""), hint))
}

/// The number of a material, which is added if none was asked for and there is none.
fn material_number(desc: &mut SceneDesc, name: Option<&str>) -> Result<u32, Error> {
    let wanted = name.unwrap_or(NEUTRAL);
    match desc.materials.iter().position(|material| material.name == wanted) {
        Some(number) => Ok(number as u32),
        None if name.is_none() => {
            desc.materials.push(Material::new(NEUTRAL));
            Ok(desc.materials.len() as u32 - 1)
        }
        None => Err(Error::scene(format!("no material is named \"{wanted}\""), "material", "add it first")),
    }
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
    /// Puts an instance in another place; structures follow. A moment of what moves ([`Session::pose`]) takes it back where it moves.
    ///
    /// # Errors
    /// There is no such instance, or the place is singular.
    pub fn place(&mut self, instance: u32, world_from_object: Affine3) -> Result<PoseReport, Error> {
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
    /// Those of [`Addition::check`], a material that is not there, or the scene is in a store.
    pub fn add(&mut self, additions: Vec<Addition>) -> Result<(), Error> {
        additions.iter().try_for_each(Addition::check)?;
        let materials = &self.open().scene.desc().materials;
        let mut known: BTreeSet<String> = materials.iter().map(|material| material.name.clone()).collect();
        for addition in &additions {
            match addition {
                Addition::Mesh { material: Some(name), .. } if !known.contains(name) => {
                    let what = format!("no material is named \"{name}\"");
                    return Err(Error::scene(what, "material", "add it first"));
                }
                Addition::Material(material) => drop(known.insert(material.name.clone())),
                _ => {}
            }
        }
        self.rebuild(|desc| additions.into_iter().try_for_each(|addition| addition.put(desc)))
    }

    /// Takes instances out of the scene, and meshes of which none is left; others get other numbers.
    ///
    /// # Errors
    /// There is no such instance, the scene moves, or is in a store.
    pub fn remove(&mut self, instances: &[u32]) -> Result<(), Error> {
        let scene = &self.open().scene;
        if scene.motion().is_some() {
            let hint = "put it out of sight by its transform";
            return Err(Error::usage("nothing is taken out of a scene that moves", "remove", hint));
        }
        let count = scene.instances().len();
        if let Some(outside) = instances.iter().find(|&&i| i as usize >= count) {
            return Err(Error::scene(format!("instance {outside} does not exist"), "remove", ""));
        }
        let instances = instances.iter().map(|&i| i as usize).collect();
        self.rebuild(|desc| {
            take_out(desc, &instances);
            Ok(())
        })
    }
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
