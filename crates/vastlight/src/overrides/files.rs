//! Files that changes name: one that was read is not read again as long as it stays what it was, or is gone.

use crate::Error;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;
use vastlight_import::{Limits, load_environment, load_ies};
use vastlight_scene::{Diagnostics, Environment, IesProfile, Image, SceneDesc};

/// A file as it was read: its length and when it was written, where that can be had.
#[derive(Clone, Debug)]
struct Known {
    path: PathBuf,
    state: Option<(u64, SystemTime)>,
}

impl Known {
    fn new(path: &Path) -> Self {
        Self { path: path.to_owned(), state: state(path) }
    }

    /// Whether it is this file and has not changed, or is taken as it was read.
    fn is(&self, path: &Path, as_read: bool) -> bool {
        self.path == path && (as_read || state(path).is_none_or(|now| Some(now) == self.state))
    }
}

fn state(path: &Path) -> Option<(u64, SystemTime)> {
    let found = std::fs::metadata(path).ok()?;
    Some((found.len(), found.modified().ok()?))
}

/// What was read. A map stands at the end of the scene's images, and is moved, for it is large.
#[derive(Debug)]
pub(crate) struct Files {
    limits: Limits,
    /// Whether files count as they were read, whatever became of them: on the way back to what was.
    pub(crate) as_read: bool,
    /// The map among the scene's images.
    shown: Option<Known>,
    /// Maps that are in no scene.
    spare: Vec<(Known, Image)>,
    profiles: BTreeMap<PathBuf, (Known, Arc<IesProfile>)>,
}

impl Files {
    /// Files within bounds, of which none was read.
    pub(crate) fn new(limits: Limits) -> Self {
        Self { limits, as_read: false, shown: None, spare: Vec::new(), profiles: BTreeMap::new() }
    }

    /// Puts a latitude-longitude map around the scene.
    pub(crate) fn use_map(&mut self, desc: &mut SceneDesc, path: &Path) -> Result<(), Error> {
        let as_read = self.as_read;
        let (known, image) = match self.spare.iter().position(|(known, _)| known.is(path, as_read)) {
            Some(number) => self.spare.swap_remove(number),
            None => (Known::new(path), load_environment(path, &self.limits, &mut desc.diagnostics)?),
        };
        self.shown = Some(known);
        desc.images.push(image);
        let image = (desc.images.len() - 1) as u32;
        desc.environment = Some(Environment::Map { image, rotation: 0.0, strength: 1.0 });
        Ok(())
    }

    /// Takes the images beyond the first `count` out of the scene.
    pub(crate) fn take_back(&mut self, desc: &mut SceneDesc, count: usize) {
        let beyond = desc.images.split_off(count.min(desc.images.len()));
        self.spare.extend(self.shown.take().zip(beyond.into_iter().next_back()));
    }

    /// Forgets maps that are in no scene.
    pub(crate) fn drop_spare(&mut self) {
        self.spare.clear();
    }

    /// A measured distribution.
    pub(crate) fn profile(&mut self, path: &Path, found: &mut Diagnostics) -> Result<Arc<IesProfile>, Error> {
        if let Some((_, profile)) = self.profiles.get(path).filter(|(known, _)| known.is(path, self.as_read))
        {
            return Ok(Arc::clone(profile));
        }
        let read = (Known::new(path), Arc::new(load_ies(path, &self.limits, found)?));
        let profile = Arc::clone(&read.1);
        self.profiles.insert(path.to_owned(), read);
        Ok(profile)
    }
}
