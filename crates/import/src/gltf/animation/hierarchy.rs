//! Nodes that move, and those below them.

use super::channels::{Channels, Tracks};
use super::keys::Keys;
use crate::gltf::json::Json;
use crate::gltf::node::{self, Parts, Placed};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use vastlight_math::glam::{DAffine3, DVec3};
use vastlight_scene::SceneError;

/// Where a node's parent is.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
enum Parent {
    /// At one place for ever.
    Still(DAffine3),
    /// The moving node of that number.
    Moving(usize),
}

/// A node's transform relative to its parent.
#[derive(Clone, Debug, Serialize, Deserialize)]
enum Local {
    Still(DAffine3),
    Moving { at_rest: Parts, tracks: Tracks },
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct MovingNode {
    parent: Parent,
    local: Local,
}

/// All nodes of a scene whose places depend on time, parents before children.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Hierarchy {
    nodes: Vec<MovingNode>,
    /// Their numbers by those of the document.
    numbers: BTreeMap<usize, usize>,
}

impl Hierarchy {
    /// What of the placed nodes the channels move.
    pub(super) fn new(root: &Json<'_>, placed: &[Placed], channels: &Channels) -> Self {
        let mut hierarchy = Self::default();
        for Placed { node, parent, .. } in placed {
            let tracks = channels.of_node.get(node).filter(|tracks| tracks.moves());
            let moving_parent = parent.and_then(|p| hierarchy.numbers.get(&placed[p].node).copied());
            if tracks.is_none() && moving_parent.is_none() {
                continue;
            }
            let json = &root.list("nodes")[*node];
            let still = || Parent::Still(parent.map_or(DAffine3::IDENTITY, |p| placed[p].world_from_node));
            let local = match tracks {
                Some(tracks) => {
                    // Weights are a mesh's.
                    let tracks = Tracks { weights: None, ..tracks.clone() };
                    Local::Moving { at_rest: Parts::read(json), tracks }
                }
                None => Local::Still(node::local_transform(json)),
            };
            hierarchy.numbers.insert(*node, hierarchy.nodes.len());
            hierarchy
                .nodes
                .push(MovingNode { parent: moving_parent.map_or_else(still, Parent::Moving), local });
        }
        hierarchy
    }

    /// The number of a node of the document among those that move.
    pub(super) fn number(&self, node: usize) -> Option<usize> {
        self.numbers.get(&node).copied()
    }

    /// The numbers of the keys that nodes follow.
    pub(super) fn numbers_of_keys(&mut self) -> impl Iterator<Item = &mut usize> {
        let tracks = self.nodes.iter_mut().filter_map(|node| match &mut node.local {
            Local::Moving { tracks, .. } => Some(tracks),
            Local::Still(_) => None,
        });
        tracks.flat_map(Tracks::numbers_mut)
    }

    /// How many nodes move.
    pub(super) fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Whether parents stand before their children, numbers are those of nodes, and tracks have some of so many keys.
    pub(super) fn is_sound(&self, keys: usize) -> bool {
        let sound = |(number, node): (usize, &MovingNode)| {
            let behind = matches!(node.parent, Parent::Moving(parent) if parent >= number);
            !behind && !matches!(&node.local, Local::Moving { tracks, .. } if !tracks.are_sound(keys))
        };
        self.nodes.iter().enumerate().all(sound) && self.numbers.values().all(|&number| number < self.len())
    }

    /// World space from the space of each node that moves.
    pub(super) fn places(&self, keys: &[Keys], time: f32) -> Result<Vec<DAffine3>, SceneError> {
        let mut places: Vec<DAffine3> = Vec::with_capacity(self.nodes.len());
        for MovingNode { parent, local } in &self.nodes {
            let world_from_parent = match parent {
                Parent::Still(transform) => *transform,
                Parent::Moving(number) => places[*number],
            };
            let place = world_from_parent * local.at(keys, time);
            if !node::to_f32(&place).is_finite() {
                let what = format!("at {time} s a node is at no finite place");
                return Err(SceneError::new(what, "animation", "the numbers of the animation are too large"));
            }
            places.push(place);
        }
        Ok(places)
    }
}

impl Local {
    fn at(&self, keys: &[Keys], time: f32) -> DAffine3 {
        match self {
            Self::Still(transform) => *transform,
            Self::Moving { at_rest, tracks } => {
                let vector = |number: usize| DVec3::from_array(keys[number].vector(time));
                let rotation = |number: usize| keys[number].rotation(time);
                Parts {
                    scale: tracks.scale.map_or(at_rest.scale, vector),
                    rotation: tracks.rotation.map_or(at_rest.rotation, rotation),
                    translation: tracks.translation.map_or(at_rest.translation, vector),
                }
                .transform()
            }
        }
    }
}
