//! Animations: what moves a document's nodes, skins and morph targets, at any moment.
//!
//! `choice` finds the animation, `channels` reads its keys (`keys`), `hierarchy` follows nodes and those below them. [`Movement`] notes
//! which instances, cameras, lights and meshes hang on them while the scene is assembled, and is the scene's motion in the end.

mod channels;
mod choice;
mod hierarchy;
mod keys;

pub(super) use choice::choose;

use super::accessor::Data;
use super::camera::without_scale;
use super::findings::Findings;
use super::json::Json;
use super::mesh::{self, Base, Shape};
use super::node::{self, Copies, Placed};
use super::skin::Skin;
use channels::Channels;
use hierarchy::Hierarchy;
use keys::Keys;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use vastlight_math::Affine3;
use vastlight_math::glam::DAffine3;
use vastlight_scene::{Camera, MeshPose, Motion, MotionRecord, Pose, SceneDesc, SceneError};

/// What moves a scene. Numbers of nodes are those of the hierarchy, others those of the scene.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Movement {
    duration: f32,
    hierarchy: Hierarchy,
    /// Those of all samplers in use: others have their numbers.
    keys: Vec<Keys>,
    /// By node of the document, the keys of its morph weights.
    #[serde(skip)]
    weights: BTreeMap<usize, usize>,
    instances: Vec<MovingInstances>,
    /// Cameras at rest, with their nodes.
    cameras: Vec<(u32, usize, Option<Camera>)>,
    lights: Vec<(u32, usize)>,
    skins: BTreeMap<usize, MovingSkin>,
    meshes: Vec<MovingMesh>,
}

/// Instances that a node places.
#[derive(Debug, Serialize, Deserialize)]
struct MovingInstances {
    node: usize,
    first: usize,
    copies: Option<Copies>,
}

/// A skin in use that has joints which move.
#[derive(Debug, Serialize, Deserialize)]
struct MovingSkin {
    skin: Skin,
    /// Joints that do not move, by node of the document.
    still: BTreeMap<usize, DAffine3>,
}

/// A mesh whose vertices move.
#[derive(Debug, Serialize, Deserialize)]
struct MovingMesh {
    mesh: u32,
    bases: Vec<Base>,
    /// Of morph weights.
    keys: Option<usize>,
    /// Matrices of joints that move.
    skin: Option<usize>,
    /// Matrices of joints that do not.
    joints: Option<Vec<Affine3>>,
}

impl Movement {
    /// What an animation of that number moves.
    pub(super) fn new(
        root: &Json<'_>,
        (index, animation): (usize, &Json<'_>),
        placed: &[Placed],
        data: &Data,
        budget: &AtomicU64,
        findings: &mut Findings,
    ) -> Self {
        let place = format!("/animations/{index}");
        let channels = Channels::read(animation, &place, data, budget, findings);
        let hierarchy = Hierarchy::new(root, placed, &channels);
        let Channels { of_node, keys, duration } = channels;
        let weights = of_node.into_iter().filter_map(|(node, tracks)| Some((node, tracks.weights?)));
        Self { duration, hierarchy, keys, weights: weights.collect(), ..Self::default() }
    }

    /// The keys that move the morph weights of a node of the document, by number.
    pub(super) fn weights_of(&self, node: usize) -> Option<usize> {
        self.weights.get(&node).copied()
    }

    /// Notes the instances of a node of the document, from that number on.
    pub(super) fn add_instances(&mut self, node: usize, first: usize, copies: Option<Copies>) {
        if let Some(node) = self.hierarchy.number(node) {
            self.instances.push(MovingInstances { node, first, copies });
        }
    }

    /// Notes the cameras of a node of the document.
    pub(super) fn add_cameras(&mut self, node: usize, cameras: Range<usize>) {
        let Some(node) = self.hierarchy.number(node) else { return };
        self.cameras.extend(cameras.map(|camera| (camera as u32, node, None)));
    }

    /// Notes the lights of a node of the document.
    pub(super) fn add_lights(&mut self, node: usize, lights: Range<usize>) {
        let Some(node) = self.hierarchy.number(node) else { return };
        self.lights.extend(lights.map(|light| (light as u32, node)));
    }

    /// Notes a skin in use if it has joints that move; `at_rest` says where nodes of the document are.
    pub(super) fn add_skin(&mut self, index: usize, skin: Skin, at_rest: impl Fn(usize) -> Option<DAffine3>) {
        let (moving, still): (Vec<usize>, Vec<usize>) =
            skin.nodes().partition(|&node| self.hierarchy.number(node).is_some());
        if !moving.is_empty() {
            let still = still.into_iter().filter_map(|node| Some((node, at_rest(node)?))).collect();
            self.skins.insert(index, MovingSkin { skin, still });
        }
    }

    /// Skins with joints that move.
    pub(super) fn moving_skins(&self) -> impl Iterator<Item = usize> {
        self.skins.keys().copied()
    }

    /// Notes a mesh of the scene if its vertices move; `at_rest` are the matrices of its joints if it has some.
    pub(super) fn add_mesh(
        &mut self,
        mesh: usize,
        shape: &Shape,
        bases: Vec<Base>,
        at_rest: Option<&Vec<Affine3>>,
    ) {
        if bases.is_empty() {
            return;
        }
        let skin = shape.skin.filter(|skin| self.skins.contains_key(skin));
        let joints = at_rest.filter(|_| skin.is_none()).cloned();
        self.meshes.push(MovingMesh { mesh: mesh as u32, bases, keys: shape.track, skin, joints });
    }

    /// The motion of a scene whose tables are complete; `None` if nothing moves.
    pub(super) fn finish(mut self, desc: &SceneDesc) -> Option<Arc<dyn Motion>> {
        for (camera, _, at_rest) in &mut self.cameras {
            *at_rest = desc.cameras.get(*camera as usize).cloned();
        }
        self.forget_unused_keys();
        let counts = [self.instances.len(), self.cameras.len(), self.lights.len(), self.meshes.len()];
        (counts != [0; 4]).then(|| Arc::new(self) as Arc<dyn Motion>)
    }

    /// Leaves out keys that nothing of the scene follows, such as those of nodes of the file's other scenes.
    fn forget_unused_keys(&mut self) {
        let mut all: Vec<Option<Keys>> = std::mem::take(&mut self.keys).into_iter().map(Some).collect();
        let mut renumbered = BTreeMap::new();
        let of_meshes = self.meshes.iter_mut().filter_map(|mesh| mesh.keys.as_mut());
        for number in self.hierarchy.numbers_of_keys().chain(of_meshes) {
            if let Some(keys) = all.get_mut(*number).and_then(Option::take) {
                renumbered.insert(*number, self.keys.len());
                self.keys.push(keys);
            }
            *number = renumbered.get(number).copied().unwrap_or(*number);
        }
    }
}

/// The reader's name in records.
const KIND: &str = "gltf";

/// The movement of a document, for the scene that it belongs to; none if the record is no document's.
///
/// # Errors
/// The record is damaged.
pub fn motion(record: &MotionRecord, desc: &SceneDesc) -> Result<Option<Arc<dyn Motion>>, SceneError> {
    if record.kind != KIND {
        return Ok(None);
    }
    let movement: Movement = record.read()?;
    if movement.is_sound(desc) {
        return Ok(Some(Arc::new(movement)));
    }
    Err(MotionRecord::damaged("it does not fit the scene"))
}

impl Movement {
    /// Whether every moment can be made, whatever else the numbers are.
    fn is_sound(&self, desc: &SceneDesc) -> bool {
        let nodes = self.hierarchy.len();
        let fits = |instances: &MovingInstances| {
            let copies = instances.copies.as_ref();
            let last = instances.first.checked_add(copies.map_or(1, Copies::len));
            instances.node < nodes
                && copies.is_none_or(Copies::is_sound)
                && last.is_some_and(|last| u32::try_from(last).is_ok())
        };
        let poses = |mesh: &MovingMesh| {
            (mesh.mesh as usize) < desc.meshes.len()
                && mesh.bases.iter().all(Base::is_sound)
                && mesh.keys.is_none_or(|number| number < self.keys.len())
        };
        self.keys.iter().all(Keys::is_sound)
            && self.hierarchy.is_sound(self.keys.len())
            && self.instances.iter().all(fits)
            && self.cameras.iter().all(|(_, node, _)| *node < nodes)
            && self.lights.iter().all(|(_, node)| *node < nodes)
            && self.meshes.iter().all(poses)
    }
}

impl Motion for Movement {
    fn duration(&self) -> f32 {
        self.duration
    }

    fn pose(&self, time: f32) -> Result<Pose, SceneError> {
        let places = self.hierarchy.places(&self.keys, time)?;
        let matrices: BTreeMap<usize, Vec<Affine3>> = self
            .skins
            .iter()
            .map(|(index, skin)| (*index, skin.matrices(&self.hierarchy, &places)))
            .collect();
        let weights = |number: usize| self.keys[number].numbers(time);
        let camera = |(camera, node, at_rest): &(u32, usize, Option<Camera>)| {
            let world_from_camera = node::to_f32(&without_scale(&places[*node]));
            Some((*camera, Camera { world_from_camera, ..at_rest.clone()? }))
        };
        let light = |(light, node): &(u32, usize)| (*light, node::to_f32(&without_scale(&places[*node])));
        Ok(Pose {
            meshes: self.meshes.par_iter().map(|mesh| mesh.pose(weights, &matrices)).collect(),
            instances: self
                .instances
                .iter()
                .flat_map(|instances| instances.places(&places[instances.node]))
                .collect(),
            cameras: self.cameras.iter().filter_map(camera).collect(),
            lights: self.lights.iter().map(light).collect(),
        })
    }

    fn record(&self) -> Option<MotionRecord> {
        MotionRecord::new(KIND, self)
    }
}

impl MovingInstances {
    fn places(&self, world_from_node: &DAffine3) -> impl Iterator<Item = (u32, Affine3)> {
        let count = self.copies.as_ref().map_or(1, Copies::len);
        (0..count).map(move |i| {
            let copies = self.copies.as_ref();
            let node_from_copy = copies.map_or(DAffine3::IDENTITY, |copies| copies.node_from_copy(i));
            ((self.first + i) as u32, node::to_f32(&(*world_from_node * node_from_copy)))
        })
    }
}

impl MovingSkin {
    fn matrices(&self, hierarchy: &Hierarchy, places: &[DAffine3]) -> Vec<Affine3> {
        let moving = |node: usize| hierarchy.number(node).map(|number| places[number]);
        self.skin.matrices(|node| moving(node).or_else(|| self.still.get(&node).copied()))
    }
}

impl MovingMesh {
    fn pose(
        &self,
        weights: impl Fn(usize) -> Vec<f32>,
        matrices: &BTreeMap<usize, Vec<Affine3>>,
    ) -> MeshPose {
        let weights = self.keys.map_or_else(Vec::new, weights);
        let moving = self.skin.and_then(|skin| matrices.get(&skin));
        let joints = moving.or(self.joints.as_ref()).map(Vec::as_slice);
        let mesh = mesh::pose(&self.bases, &weights, joints);
        MeshPose {
            mesh: self.mesh,
            positions: mesh.positions,
            normals: mesh.normals,
            tangents: mesh.tangents,
        }
    }
}
