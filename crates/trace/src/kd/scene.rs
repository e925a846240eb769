//! The kd-trees of a scene.

use crate::instance::Places;
use crate::tracer::view;
use rayon::prelude::*;
use vastlight_accel::BuildError;
use vastlight_accel::kdtree::{KdConfig, KdKind, KdMesh, KdTree, build};
use vastlight_math::Aabb;
use vastlight_scene::Mesh;

/// Kd-trees over meshes and over instances.
#[derive(Debug)]
pub(crate) struct KdScene {
    pub(crate) meshes: Vec<KdMesh>,
    /// Over the boxes of instances.
    pub(crate) top: KdTree,
    /// By instance.
    pub(crate) boxes: Vec<Aabb>,
    /// Walked with a stack; otherwise by threads.
    pub(crate) stacked: bool,
    cost: f64,
}

impl KdScene {
    /// The trees of meshes, empty for those that are not there.
    pub(crate) fn meshes(meshes: &[Option<&Mesh>], kind: &KdKind) -> Result<Vec<KdMesh>, BuildError> {
        meshes.par_iter().map(|mesh| KdMesh::build(&view(*mesh), &kind.config())).collect()
    }

    /// Joins the trees of meshes under one over instances.
    pub(crate) fn new(meshes: Vec<KdMesh>, places: &Places, kind: &KdKind) -> Result<Self, BuildError> {
        let boxes: Vec<Aabb> = (0..places.len() as u32).into_par_iter().map(|i| places.bounds(i)).collect();
        let top = build(&boxes, &KdConfig { max_leaf: 1, ..kind.config() })?;
        let cost = top.cost(|instance| meshes[places.mesh(instance as usize) as usize].cost);
        Ok(Self { meshes, top, boxes, stacked: kind.stacked, cost })
    }

    pub(crate) fn nodes(&self) -> u64 {
        (self.top.nodes.len() + self.meshes.iter().map(|m| m.nodes.len()).sum::<usize>()) as u64
    }

    /// Triangles in leaves.
    pub(crate) fn references(&self) -> u64 {
        self.meshes.iter().map(|m| m.references as u64).sum()
    }

    pub(crate) fn cost(&self) -> f64 {
        self.cost
    }

    pub(crate) fn bytes(&self) -> usize {
        let meshes: usize = self.meshes.iter().map(KdMesh::bytes).sum();
        meshes + self.top.bytes() + size_of_val(&self.boxes[..])
    }
}
