//! Objects of the scene that is shown: which may be put elsewhere, and where they were.

use crate::objects::{Places, map};
use std::collections::{BTreeMap, BTreeSet};
use vastlight::math::Affine3;
use vastlight::scene::Scene;
use vastlight::{Error, Session};

/// Why an object stays where it is.
const ANIMATED: &str = "an animation moves this object";
const REMADE: &str = "this scene is made anew for each moment, without changes of places";

/// Places since a scene was opened.
#[derive(Debug)]
pub(crate) struct Objects {
    /// Where instances stood that were put elsewhere.
    opened: BTreeMap<u32, Affine3>,
    /// What was put elsewhere.
    placed: Places,
    /// Instances that an animation moves, by their places in the description's table.
    animated: BTreeSet<u32>,
    is_remade: bool,
}

impl Objects {
    /// Objects of a scene that was opened.
    pub(crate) fn new(session: &Session) -> Self {
        let motion = session.open().scene.motion();
        // A moment that cannot be had is told when it is asked for.
        let pose = motion.and_then(|motion| motion.pose(0.0).ok()).unwrap_or_default();
        Self {
            opened: BTreeMap::new(),
            placed: Places::default(),
            animated: pose.instances.iter().map(|(place, _)| *place).collect(),
            is_remade: session.movement() == Some(None),
        }
    }

    pub(crate) fn placed(&self) -> &Places {
        &self.placed
    }

    /// Where an instance stood when the scene was opened.
    pub(crate) fn opened(&self, scene: &Scene, instance: u32) -> Affine3 {
        let now = || *scene.instances().map(instance as usize);
        self.opened.get(&instance).copied().unwrap_or_else(now)
    }

    /// Why an instance cannot be put elsewhere, if it cannot.
    pub(crate) fn held(&self, scene: &Scene, instance: u32) -> Option<&'static str> {
        let is_animated = || self.animated.contains(&scene.place_in_table(instance));
        match () {
            () if self.is_remade => Some(REMADE),
            () if !self.animated.is_empty() && is_animated() => Some(ANIMATED),
            () => None,
        }
    }

    /// Puts instances where they are wanted; gives those that stay where they are, and why.
    pub(crate) fn arrange(&mut self, session: &mut Session, wanted: &Places) -> Vec<(u32, Error)> {
        let known: BTreeSet<u32> =
            self.placed.iter().chain(wanted.iter()).map(|(instance, _)| instance).collect();
        let mut refused = Vec::new();
        for instance in known {
            let place = wanted.of(instance);
            if place == self.placed.of(instance) {
                continue;
            }
            match self.put(session, instance, place.map(|rows| map(&rows))) {
                Ok(()) => self.placed.put(instance, place),
                Err(error) => refused.push((instance, error)),
            }
        }
        refused
    }

    fn put(&mut self, session: &mut Session, instance: u32, place: Option<Affine3>) -> Result<(), Error> {
        let scene = &session.open().scene;
        if instance as usize >= scene.instances().len() {
            return Err(Error::scene(format!("instance {instance} does not exist"), "object", ""));
        }
        if let Some(reason) = self.held(scene, instance) {
            let name = format!("\"{}\"", scene.instance_name(instance));
            return Err(Error::usage(reason, name, "change the file itself"));
        }
        let opened = self.opened(scene, instance);
        // Also where structures cannot follow, it is elsewhere then.
        self.opened.entry(instance).or_insert(opened);
        session.place(instance, place.unwrap_or(opened))?;
        Ok(())
    }
}
