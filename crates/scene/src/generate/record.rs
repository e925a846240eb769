//! Movements of demos as stores keep them.

use super::{bodies, cloth, explosion, traffic, walker};
use crate::{Motion, MotionRecord, SceneDesc, SceneError};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::sync::Arc;
use vastlight_math::Vec3;

/// Metres from the origin beyond which no demo has anything.
const FAR: f32 = 1e4;

/// A movement that is written and read again.
pub(super) trait Recorded: Motion + Serialize + DeserializeOwned + 'static {
    /// The reader's name in records.
    const KIND: &'static str;

    /// Whether every moment can be made, whatever else the numbers are; the scene is at rest.
    fn is_sound(&self, desc: &SceneDesc) -> bool;
}

/// The readers' names.
const KINDS: [&str; 5] = [
    <bodies::Swarm as Recorded>::KIND,
    <cloth::Falling as Recorded>::KIND,
    <explosion::Burst as Recorded>::KIND,
    <traffic::Traffic as Recorded>::KIND,
    <walker::Walk as Recorded>::KIND,
];

/// Whether a demo of this name has a movement; others that move are made anew at each moment.
#[must_use]
pub fn has_motion(name: &str) -> bool {
    KINDS.iter().any(|kind| kind.strip_prefix("demo:") == Some(name))
}

/// The movement of a demo, for the scene that it belongs to; none if the record is no demo's.
///
/// # Errors
/// The record is damaged.
pub fn motion(record: &MotionRecord, desc: &SceneDesc) -> Result<Option<Arc<dyn Motion>>, SceneError> {
    let read = match record.kind.as_str() {
        <bodies::Swarm as Recorded>::KIND => read::<bodies::Swarm>,
        <cloth::Falling as Recorded>::KIND => read::<cloth::Falling>,
        <explosion::Burst as Recorded>::KIND => read::<explosion::Burst>,
        <traffic::Traffic as Recorded>::KIND => read::<traffic::Traffic>,
        <walker::Walk as Recorded>::KIND => read::<walker::Walk>,
        _ => return Ok(None),
    };
    read(record, desc).map(Some)
}

fn read<M: Recorded>(record: &MotionRecord, desc: &SceneDesc) -> Result<Arc<dyn Motion>, SceneError> {
    let motion: M = record.read()?;
    if motion.is_sound(desc) {
        return Ok(Arc::new(motion));
    }
    Err(MotionRecord::damaged("it does not fit the scene"))
}

/// Whether points are where demos have some.
pub(super) fn are_near(points: &[Vec3]) -> bool {
    points.iter().all(|p| p.abs().cmple(Vec3::splat(FAR)).all())
}
