//! Movements of scenes in stores.

use crate::Error;
use std::sync::Arc;
use vastlight_import::gltf_motion;
use vastlight_scene::{Motion, MotionRecord, SceneDesc, generate, renumbered};

/// What moves a scene, from the record in its store; `desc` is the scene at rest.
///
/// # Errors
/// The record is damaged, or of a kind that nobody here reads.
pub(crate) fn read(record: MotionRecord, desc: &SceneDesc) -> Result<Arc<dyn Motion>, Error> {
    let known = match gltf_motion(&record, desc)? {
        Some(motion) => Some(motion),
        None => generate::motion(&record, desc)?,
    };
    match known {
        Some(motion) => Ok(renumbered(motion, record.numbers)),
        None => Err(MotionRecord::damaged(&format!("nobody reads the kind \"{}\"", record.kind)).into()),
    }
}
