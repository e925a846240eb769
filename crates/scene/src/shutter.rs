//! What moves while a shutter is open: its state at keys at equal distances, and straight ways between them.
//!
//! A shutter's time runs from 0, when it opens, to 1. Elements of matrices and vertices are blended ([`Between`]), so that every
//! point of an instance or of a mesh goes straight on from key to key. Vertices are on their mesh's lattice at keys alone.

use crate::{Camera, Change, Mesh, Pose, Scene, SceneError, can_be_placed};
use vastlight_math::{Affine3, Between, Vec3, Vec4};

/// What moves in a scene while its shutter is open.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shutter {
    keys: usize,
    /// Ascending.
    instances: Vec<(u32, InstanceKeys)>,
    meshes: Vec<(u32, Vec<MeshKey>)>,
    /// All cameras of the scene at each key.
    cameras: Vec<Vec<Camera>>,
    sharp: Vec<u32>,
}

/// The places of an instance.
#[derive(Clone, Debug, PartialEq)]
pub struct InstanceKeys {
    maps: Vec<Affine3>,
    /// Between which keys it is not to be seen: one of the two has no place for it.
    hidden: Vec<bool>,
}

/// What a mesh has at a key.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshKey {
    /// On the lattice of this key.
    pub positions: Vec<Vec3>,
    /// As many, or none.
    pub normals: Vec<Vec3>,
    /// As many, or none.
    pub tangents: Vec<Vec4>,
}

impl InstanceKeys {
    fn new(maps: Vec<Affine3>) -> Self {
        let hidden = maps.windows(2).map(|ends| !ends.iter().all(can_be_placed)).collect();
        Self { maps, hidden }
    }

    /// The places at the keys.
    #[must_use]
    pub fn maps(&self) -> &[Affine3] {
        &self.maps
    }

    /// The place at a moment; none where the instance is not to be seen.
    #[inline]
    #[must_use]
    pub fn at(&self, between: &Between) -> Option<Affine3> {
        let [a, b] = between.ends(&self.maps)?;
        (!self.hidden[between.key]).then(|| between.map(a, b))
    }

    /// The places at the ends of each part of the way on which the instance is to be seen.
    pub fn ways(&self) -> impl Iterator<Item = [&Affine3; 2]> {
        let ways = self.maps.windows(2).zip(&self.hidden).filter(|(_, hidden)| !**hidden);
        ways.map(|(ends, _)| [&ends[0], &ends[1]])
    }
}

impl MeshKey {
    fn of(mesh: &Mesh) -> Self {
        let Mesh { positions, normals, tangents, .. } = mesh;
        Self { positions: positions.clone(), normals: normals.clone(), tangents: tangents.clone() }
    }

    /// Whether the values of both belong to the same vertices.
    fn fits(&self, other: &Self) -> bool {
        let lengths = |key: &Self| [key.positions.len(), key.normals.len(), key.tangents.len()];
        lengths(self) == lengths(other)
    }
}

impl Shutter {
    /// How many keys there are, at least two.
    #[must_use]
    pub fn keys(&self) -> usize {
        self.keys
    }

    /// A time, from 0 to 1, among the keys.
    #[inline(always)]
    #[must_use]
    pub fn between(&self, time: f32) -> Between {
        Between::new(time, self.keys)
    }

    /// Whether nothing but cameras moves.
    #[must_use]
    pub fn is_still(&self) -> bool {
        self.instances.is_empty() && self.meshes.is_empty()
    }

    /// The instances that move, ascending.
    pub fn instances(&self) -> impl Iterator<Item = (u32, &InstanceKeys)> {
        self.instances.iter().map(|(number, keys)| (*number, keys))
    }

    /// The meshes whose vertices move, ascending.
    pub fn meshes(&self) -> impl Iterator<Item = (u32, &[MeshKey])> {
        self.meshes.iter().map(|(number, keys)| (*number, &keys[..]))
    }

    /// The places of an instance; none if it does not move.
    #[inline]
    #[must_use]
    pub fn instance(&self, number: u32) -> Option<&InstanceKeys> {
        let place = self.instances.binary_search_by_key(&number, |(number, _)| *number).ok()?;
        Some(&self.instances[place].1)
    }

    /// The vertices of a mesh; none if they do not move.
    #[inline]
    #[must_use]
    pub fn mesh(&self, number: u32) -> Option<&[MeshKey]> {
        let place = self.meshes.binary_search_by_key(&number, |(number, _)| *number).ok()?;
        Some(&self.meshes[place].1)
    }

    /// All cameras of the scene, by key.
    #[must_use]
    pub fn cameras(&self) -> &[Vec<Camera>] {
        &self.cameras
    }

    /// Meshes that move and stay as they are when the shutter opens: they have other triangles or vertices at other keys, as
    /// tangents are derived for them.
    #[must_use]
    pub fn sharp(&self) -> &[u32] {
        &self.sharp
    }
}

/// Collects what a shutter holds, from the last key to the first.
struct Recorder {
    shutter: Shutter,
    triangles: Vec<Vec<[u32; 3]>>,
    change: Option<Change>,
}

impl Recorder {
    fn new(keys: usize) -> Self {
        Self { shutter: Shutter { keys, ..Shutter::default() }, triangles: Vec::new(), change: None }
    }

    /// Takes in a scene that was brought to the key before.
    fn record(&mut self, scene: &Scene, change: &Change) -> Result<(), SceneError> {
        if self.change.get_or_insert_with(|| change.clone()) != change {
            return Err(SceneError::new("moments of one shutter move different things", "motion", ""));
        }
        let Shutter { instances, meshes, cameras, .. } = &mut self.shutter;
        if cameras.is_empty() {
            let maps = |&number| (number, InstanceKeys { maps: Vec::new(), hidden: Vec::new() });
            instances.extend(change.instances.iter().map(maps));
            let triangular = change.meshes.iter().filter(|&&m| scene.meshes()[m as usize].implicit.is_none());
            meshes.extend(triangular.map(|&mesh| (mesh, Vec::new())));
            self.triangles.extend(meshes.iter().map(|(m, _)| scene.meshes()[*m as usize].triangles.clone()));
        }
        instances.iter_mut().for_each(|(i, keys)| keys.maps.push(*scene.instances().map(*i as usize)));
        for ((number, keys), triangles) in meshes.iter_mut().zip(&self.triangles) {
            let mesh = &scene.meshes()[*number as usize];
            // Keys without vertices fit no other.
            keys.push(if mesh.triangles == *triangles { MeshKey::of(mesh) } else { MeshKey::default() });
        }
        cameras.push(scene.cameras().to_vec());
        Ok(())
    }

    fn finish(self) -> Shutter {
        let Shutter { keys, instances, meshes, mut cameras, .. } = self.shutter;
        cameras.reverse();
        let moves = |maps: &[Affine3]| maps.windows(2).any(|ends| ends[0] != ends[1]);
        let instances = instances.into_iter().filter(|(_, keys)| moves(&keys.maps));
        let forwards = |(number, InstanceKeys { mut maps, .. }): (u32, InstanceKeys)| {
            maps.reverse();
            (number, InstanceKeys::new(maps))
        };
        let (fitting, others): (Vec<_>, Vec<_>) = meshes
            .into_iter()
            .filter(|(_, keys)| keys.windows(2).any(|ends| ends[0] != ends[1]))
            .partition(|(_, keys)| keys.windows(2).all(|ends| ends[0].fits(&ends[1])));
        let mut shutter = Shutter { keys, cameras, ..Shutter::default() };
        shutter.instances = instances.map(forwards).collect();
        shutter.sharp = others.into_iter().map(|(number, _)| number).collect();
        shutter.meshes = fitting;
        shutter.meshes.iter_mut().for_each(|(_, keys)| keys.reverse());
        shutter
    }
}

impl Scene {
    /// Opens a shutter over the moments of `poses`, which are at equal distances: the scene is posed as by the first of them,
    /// and knows what moves from there on, until it is posed again. A single pose opens nothing.
    ///
    /// # Errors
    /// A pose does not fit, or poses move different things; then the scene is at one of them.
    pub fn open_shutter(&mut self, mut poses: Vec<Pose>) -> Result<Change, SceneError> {
        if poses.len() < 2 {
            return poses.pop().map_or_else(|| Ok(Change::default()), |pose| self.pose(pose));
        }
        let mut recorder = Recorder::new(poses.len());
        let mut change = Change::default();
        for pose in poses.into_iter().rev() {
            change = self.pose(pose)?;
            recorder.record(self, &change)?;
        }
        self.set_shutter(recorder.finish());
        Ok(change)
    }
}
