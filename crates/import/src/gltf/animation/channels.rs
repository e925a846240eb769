//! The channels of one animation: which property of which node follows which keys.

use super::keys::{Interpolation, Keys};
use crate::gltf::accessor::{Data, Fault};
use crate::gltf::findings::Findings;
use crate::gltf::json::Json;
use crate::gltf::mesh::take_budget;
use crate::gltf::model::Shape;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::atomic::AtomicU64;

/// What moves a node, by number among all keys.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Tracks {
    pub(super) translation: Option<usize>,
    pub(super) rotation: Option<usize>,
    pub(super) scale: Option<usize>,
    /// Morph weights.
    pub(super) weights: Option<usize>,
}

impl Tracks {
    /// Whether the node itself moves.
    pub(super) fn moves(&self) -> bool {
        self.translation.is_some() || self.rotation.is_some() || self.scale.is_some()
    }

    /// The numbers of all its keys.
    pub(super) fn numbers_mut(&mut self) -> impl Iterator<Item = &mut usize> {
        let Self { translation, rotation, scale, weights } = self;
        [translation, rotation, scale, weights].into_iter().flatten()
    }

    /// Whether its keys are among so many.
    pub(super) fn are_sound(&self, keys: usize) -> bool {
        let Self { translation, rotation, scale, weights } = *self;
        [translation, rotation, scale, weights].into_iter().flatten().all(|number| number < keys)
    }
}

/// Everything that an animation moves.
#[derive(Clone, Debug, Default)]
pub(super) struct Channels {
    pub(super) of_node: BTreeMap<usize, Tracks>,
    /// Those of all samplers that channels name and that can be read.
    pub(super) keys: Vec<Keys>,
    /// The last time of all keys, seconds.
    pub(super) duration: f32,
}

impl Channels {
    /// Reads an animation; `place` points at it. What cannot be read is a finding.
    pub(super) fn read(
        animation: &Json<'_>,
        place: &str,
        data: &Data,
        budget: &AtomicU64,
        findings: &mut Findings,
    ) -> Self {
        let mut channels = Self::default();
        let mut samplers = Samplers {
            list: animation.list("samplers"),
            place,
            data,
            budget,
            read: BTreeMap::new(),
            keys: Vec::new(),
        };
        for channel in animation.list("channels") {
            let target = channel.at("target");
            let (Some(node), Some(path)) = (target.index("node"), target.at("path").text()) else { continue };
            let Some(sampler) = channel.index("sampler") else { continue };
            let Some(number) = samplers.number(sampler, findings) else { continue };
            channels.add(node, path, number, &samplers.keys[number]);
        }
        channels.keys = samplers.keys;
        channels
    }

    fn add(&mut self, node: usize, path: &str, number: usize, keys: &Keys) {
        let tracks = self.of_node.entry(node).or_default();
        let track = match (path, keys.width()) {
            ("translation", 3) => &mut tracks.translation,
            ("rotation", 4) => &mut tracks.rotation,
            ("scale", 3) => &mut tracks.scale,
            ("weights", _) => &mut tracks.weights,
            _ => return,
        };
        *track = Some(number);
        self.duration = self.duration.max(keys.end());
    }
}

/// Samplers of an animation, each read once.
struct Samplers<'a> {
    list: &'a [Json<'a>],
    place: &'a str,
    data: &'a Data,
    budget: &'a AtomicU64,
    /// By sampler, the number of its keys; none if they cannot be read.
    read: BTreeMap<usize, Option<usize>>,
    keys: Vec<Keys>,
}

impl Samplers<'_> {
    fn number(&mut self, index: usize, findings: &mut Findings) -> Option<usize> {
        if let Some(number) = self.read.get(&index) {
            return *number;
        }
        let number = match self.read_keys(index) {
            Ok(keys) => {
                self.keys.push(keys);
                Some(self.keys.len() - 1)
            }
            Err(fault) => {
                findings.fault("UNUSABLE_SAMPLER", fault);
                None
            }
        };
        self.read.insert(index, number);
        number
    }

    fn read_keys(&self, index: usize) -> Result<Keys, Fault> {
        let place = format!("{}/samplers/{index}", self.place);
        let sampler = self.list.get(index).unwrap_or(&Json::Null);
        let times = self.numbers(sampler, "input", &place)?;
        let values = self.numbers(sampler, "output", &place)?;
        let interpolation = Interpolation::from_name(sampler.at("interpolation").text());
        let unequal = || Fault::new("there are not as many values for each time", place, "");
        Keys::new(times, values, interpolation).ok_or_else(unequal)
    }

    /// All numbers of an accessor.
    fn numbers(&self, sampler: &Json<'_>, key: &str, place: &str) -> Result<Vec<f32>, Fault> {
        let accessor = sampler.index(key).and_then(|index| Some((index, self.data.accessor(index)?)));
        let Some((index, accessor)) = accessor else {
            return Err(Fault::new(format!("the sampler has no {key}"), place, ""));
        };
        let bytes = (accessor.count as u64).saturating_mul(4 * accessor.shape.components() as u64);
        take_budget(self.budget, bytes, place)?;
        Ok(match accessor.shape {
            Shape::Scalar => self.data.floats::<1>(index, 0.0)?.into_flattened(),
            Shape::Vec3 => self.data.floats::<3>(index, 0.0)?.into_flattened(),
            Shape::Vec4 => self.data.floats::<4>(index, 0.0)?.into_flattened(),
            _ => {
                return Err(Fault::new(format!("the format {} moves nothing", accessor.format()), place, ""));
            }
        })
    }
}
