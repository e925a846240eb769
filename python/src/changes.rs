//! What is in a scene, and changes of it.

use crate::arrays::{array2, map_of, matrix_of, points, rows};
use crate::errors::{OrRaise, usage};
use crate::scene::{Scene, State, changes_of};
use numpy::{PyArray1, PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;
use serde::Serialize;
use serde_json::json;
use std::collections::BTreeSet;
use vastlight::math::{Vec2, Vec3};
use vastlight::scene::{Camera, Light, LightKind, Material, Mesh, Projection};
use vastlight::{Addition, Error, SceneCounts, Table};

/// A value as JSON.
fn json_of(value: &impl Serialize) -> String {
    json!(value).to_string()
}

/// An entry of a table.
fn entry<'t, T>(table: &'t [T], number: usize, kind: &str) -> Result<&'t T, Error> {
    table.get(number).ok_or_else(|| Error::scene(format!("{kind} {number} does not exist"), "scene", ""))
}

/// A mesh in arrays.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct MeshArrays<'py> {
    name: String,
    vertices: PyReadonlyArray2<'py, f32>,
    faces: PyReadonlyArray2<'py, u32>,
    normals: Option<PyReadonlyArray2<'py, f32>>,
    uvs: Option<PyReadonlyArray2<'py, f32>>,
    transform: PyReadonlyArray2<'py, f64>,
    material: Option<String>,
    /// The looks of that material, if it is a new one, in JSON.
    looks: Option<String>,
}

impl MeshArrays<'_> {
    /// The mesh, after its material if that is a new one.
    fn additions(self) -> PyResult<Vec<Addition>> {
        let py = self.vertices.py();
        let normals = self.normals.as_ref().map(|normals| points(normals, "normals")).transpose()?;
        if !normals.iter().flatten().all(|normal| normal.is_finite()) {
            return Err(usage(py, "a normal is not finite", "normals", ""));
        }
        let unit = |normals: Vec<Vec3>| normals.into_iter().map(|n| n.normalize_or(Vec3::Y)).collect();
        let uvs = self.uvs.as_ref().map(|uvs| rows::<f32, 2>(uvs, "uvs")).transpose()?;
        let uvs = uvs.map(|uvs| uvs.iter().copied().map(Vec2::from_array).collect());
        let mesh = Mesh {
            name: self.name,
            positions: points(&self.vertices, "vertices")?,
            triangles: rows::<u32, 3>(&self.faces, "faces")?.to_vec(),
            normals: normals.map(unit).unwrap_or_default(),
            uvs: uvs.into_iter().collect(),
            ..Mesh::default()
        };
        let world_from_object = map_of(&self.transform)?;
        let dressed = self.material.as_ref().zip(self.looks);
        let material =
            dressed.map(|(name, looks)| dressed_material(name, &looks)).transpose().or_raise(py)?;
        let mesh = Addition::Mesh { mesh: Box::new(mesh), material: self.material, world_from_object };
        Ok(material.into_iter().chain([mesh]).collect())
    }
}

/// A new material with the looks that are given to its name, in JSON.
fn dressed_material(name: &str, looks: &str) -> Result<Addition, Error> {
    let mut material = Material::new(name);
    changes_of(looks)?.dress(&mut material);
    Ok(Addition::Material(Box::new(material)))
}

/// A table by its name.
fn table_of(kind: &str) -> Table {
    match kind {
        "materials" => Table::Materials,
        "lights" => Table::Lights,
        _ => Table::Cameras,
    }
}

#[pymethods]
impl Scene {
    /// Names of the instances, in their order; that of the mesh where one has none.
    fn names(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        self.with(py, |state| {
            let scene = &state.session.open().scene;
            let name = |i: u32| match scene.instance_name(i) {
                "" => scene.meshes()[scene.instances().mesh(i as usize) as usize].name.clone(),
                name => name.to_owned(),
            };
            Ok((0..scene.instances().len() as u32).map(name).collect())
        })
    }

    /// The mesh of an instance.
    fn mesh_of(&self, py: Python<'_>, instance: usize) -> PyResult<u32> {
        self.with(py, |state| {
            let instances = state.session.open().scene.instances();
            entry(instances.maps(), instance, "instance")?;
            Ok(instances.mesh(instance))
        })
    }

    /// World from object, (4, 4) float64.
    fn transform<'py>(&self, py: Python<'py>, instance: usize) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let map = self.with(py, |state| {
            entry(state.session.open().scene.instances().maps(), instance, "instance").copied()
        })?;
        matrix_of(py, &map)
    }

    /// Puts an instance in another place.
    fn set_transform(
        &self,
        py: Python<'_>,
        instance: usize,
        matrix: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<()> {
        let map = map_of(&matrix)?;
        self.with(py, |state| {
            entry(state.session.open().scene.instances().maps(), instance, "instance")?;
            state.session.place(instance as u32, map).map(drop)
        })
    }

    /// Vertices of a mesh in object space, (N, 3) float32.
    fn vertices<'py>(&self, py: Python<'py>, mesh: usize) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let rows = self.with(py, |state| {
            let scene = &state.session.open().scene;
            entry(scene.meshes(), mesh, "mesh")?;
            Ok(scene.posed_vertices(mesh as u32).iter().map(Vec3::to_array).collect())
        })?;
        array2::<f32, 3>(py, rows)
    }

    /// Gives a mesh other vertices.
    fn set_vertices(
        &self,
        py: Python<'_>,
        mesh: u32,
        vertices: PyReadonlyArray2<'_, f32>,
        normals: Option<PyReadonlyArray2<'_, f32>>,
    ) -> PyResult<()> {
        let vertices = points(&vertices, "vertices")?;
        let normals = normals.map(|normals| points(&normals, "normals")).transpose()?;
        self.with(py, |state| state.session.deform(mesh, vertices, normals).map(drop))
    }

    /// Triangles of a mesh, (M, 3) uint32.
    fn faces<'py>(&self, py: Python<'py>, mesh: usize) -> PyResult<Bound<'py, PyArray2<u32>>> {
        let rows = self.with(py, |state| {
            Ok(entry(state.session.open().scene.meshes(), mesh, "mesh")?.triangles.clone())
        })?;
        array2::<u32, 3>(py, rows)
    }

    /// Puts a mesh into the scene.
    fn add_mesh(&self, py: Python<'_>, mesh: MeshArrays<'_>) -> PyResult<()> {
        self.put(py, mesh.additions()?)
    }

    /// Puts a material into the scene, with the looks that are given to its name, in JSON.
    fn add_material(&self, py: Python<'_>, name: &str, looks: &str) -> PyResult<()> {
        self.put(py, vec![dressed_material(name, looks).or_raise(py)?])
    }

    /// Puts a light without surface into the scene; the angles of a spot are half ones, in radians.
    fn add_light(
        &self,
        py: Python<'_>,
        name: String,
        kind: &str,
        intensity: [f32; 3],
        transform: PyReadonlyArray2<'_, f64>,
        angles: (f32, f32),
    ) -> PyResult<()> {
        let kind = match kind {
            "point" => LightKind::Point,
            "spot" => LightKind::Spot { inner: angles.0, outer: angles.1 },
            "directional" => LightKind::Directional,
            _ => return Err(usage(py, "known are point, spot and directional", "kind", "")),
        };
        let (world_from_light, intensity) = (map_of(&transform)?, Vec3::from_array(intensity));
        let light = Light { name, kind, world_from_light, intensity, range: f32::INFINITY, profile: None };
        self.put(py, vec![Addition::Light(light)])
    }

    /// Puts a camera into the scene; the angle of view is the full vertical one, in radians.
    fn add_camera(
        &self,
        py: Python<'_>,
        name: String,
        transform: PyReadonlyArray2<'_, f64>,
        lens: (f32, f32, f32),
    ) -> PyResult<()> {
        let (vertical_fov, lens_radius, focus_distance) = lens;
        let projection = Projection::Perspective { vertical_fov, lens_radius, focus_distance };
        let camera = Camera { name, world_from_camera: map_of(&transform)?, projection, aspect: None };
        self.put(py, vec![Addition::Camera(camera)])
    }

    /// Takes instances out of the scene.
    fn remove(&self, py: Python<'_>, instances: Vec<u32>) -> PyResult<()> {
        self.with(py, |state| state.session.remove(&instances))
    }

    /// Gives the scene looks that differ from those it was opened with by these changes, in JSON.
    fn revise(&self, py: Python<'_>, changes: &str) -> PyResult<()> {
        self.with(py, |state| state.session.revise(&changes_of(changes)?))
    }

    /// Names of the tables `materials`, `lights` and `cameras`, each once.
    fn table(&self, py: Python<'_>, kind: &str) -> PyResult<Vec<String>> {
        let table = table_of(kind);
        let names = |state: &mut State| {
            let mut seen = BTreeSet::new();
            let names = state.session.names_in(table).into_iter();
            Ok(names.filter(|name| seen.insert(*name)).map(str::to_owned).collect())
        };
        // The camera that an empty scene is given goes when another comes.
        if table == Table::Cameras { self.with(py, names) } else { self.with_unsettled(py, names) }
    }

    /// Whether a name is in the table `materials` or `lights`.
    fn has(&self, py: Python<'_>, kind: &str, name: &str) -> PyResult<bool> {
        self.with_unsettled(py, |state| Ok(state.session.has(table_of(kind), name)))
    }

    /// The first entry of a name in one of the tables, or the environment, as JSON.
    fn entry(&self, py: Python<'_>, kind: &str, name: &str) -> PyResult<Option<String>> {
        self.with(py, |state| {
            let scene = &state.session.open().scene;
            let desc = scene.desc();
            Ok(match kind {
                "materials" => desc.materials.iter().find(|m| m.name == name).map(json_of),
                "lights" => desc.lights.iter().find(|l| l.name == name).map(json_of),
                "cameras" => desc.cameras.iter().find(|c| c.name == name).map(json_of),
                _ => Some(json_of(scene.environment())),
            })
        })
    }

    /// Brings the scene to a moment, in seconds.
    fn set_time(&self, py: Python<'_>, time: f32) -> PyResult<()> {
        self.with(py, |state| {
            state.session.pose(time)?;
            (state.time, state.exposed) = (Some(time), None);
            Ok(())
        })
    }

    /// Whether the scene moves, the time from the first moment to the last in seconds if there is a last, and the moment that was
    /// set.
    fn movement(&self, py: Python<'_>) -> PyResult<(bool, Option<f32>, Option<f32>)> {
        self.with(py, |state| {
            let movement = state.session.movement();
            Ok((movement.is_some(), movement.flatten(), state.time))
        })
    }

    /// The smallest and the largest corner of the box around all instances; none of an empty scene.
    fn bounds<'py>(&self, py: Python<'py>) -> PyResult<Option<[Bound<'py, PyArray1<f32>>; 2]>> {
        let bounds = self.with(py, |state| Ok(state.session.open().scene.bounds()))?;
        let corner = |corner: Vec3| PyArray1::from_slice(py, &corner.to_array());
        Ok((!bounds.is_empty()).then(|| [corner(bounds.min), corner(bounds.max)]))
    }

    /// Sizes of the scene as JSON.
    fn counts(&self, py: Python<'_>) -> PyResult<String> {
        self.with(py, |state| Ok(json_of(&SceneCounts::new(&state.session.open().scene))))
    }

    /// Warnings: what, where, hint.
    fn warnings(&self, py: Python<'_>) -> PyResult<Vec<(String, String, String)>> {
        self.with(py, |state| {
            let mut seen = BTreeSet::new();
            let items = state.session.open().scene.diagnostics().items().iter();
            let said = items.map(|item| (item.what.clone(), item.place.clone(), item.hint.clone()));
            Ok(said.filter(|item| seen.insert(item.clone())).collect())
        })
    }

    /// What tells the scene from others by its contents.
    fn fingerprint(&self, py: Python<'_>) -> PyResult<String> {
        self.with(py, |state| state.session.fingerprint())
    }
}

impl Scene {
    /// Lets things wait for the next use of the scene.
    fn put(&self, py: Python<'_>, additions: Vec<Addition>) -> PyResult<()> {
        self.with_unsettled(py, |state| state.session.put(additions))
    }
}
