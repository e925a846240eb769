//! A scene over kd-trees: one over each mesh, one over the instances, both walked alike.

mod scene;
mod walk;
mod words;

pub(crate) use scene::KdScene;
pub(crate) use walk::{KdBatch, Place, Threads, Walk};
