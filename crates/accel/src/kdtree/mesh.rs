//! The kd-tree of one mesh: threaded nodes over blocks of triangles.

use super::{KdConfig, KdNode, KdReport, KdTree, KdViolation, build, validate};
use crate::BuildError;
use crate::wide::{Block8, MeshView, extent};
use rayon::prelude::*;
use vastlight_math::Aabb;

/// A mesh made traceable, in its own space times [`KdMesh::scale`].
#[derive(Clone, Debug, Default)]
pub struct KdMesh {
    /// Nodes; the items of leaves are indices of blocks.
    pub nodes: Vec<KdNode>,
    /// Triangles, those of a leaf together.
    pub blocks: Vec<Block8>,
    /// Nodes on the longest way from the root to a leaf.
    pub levels: usize,
    /// Triangles in leaves, a triangle counted in each.
    pub references: usize,
    /// `C(root)`, see [`crate::Quality`].
    pub cost: f64,
    /// Around all triangles, scaled.
    pub bounds: Aabb,
    /// Largest absolute coordinate of the mesh's vertices, used or not, scaled.
    pub extent: f32,
    /// Positions here are the mesh's times this power of two.
    pub scale: f32,
}

impl KdMesh {
    /// Builds with all threads of the current pool.
    ///
    /// # Errors
    /// Those of [`build()`](super::build()).
    pub fn build(mesh: &MeshView<'_>, config: &KdConfig) -> Result<Self, BuildError> {
        let vertices = mesh.bounds();
        let scale = mesh.scale(&vertices);
        let boxes: Vec<Aabb> = (0..mesh.triangles.len() as u32)
            .into_par_iter()
            .with_min_len(1 << 12)
            .map(|triangle| Aabb::from_points(mesh.corners(triangle).map(|p| p * scale)))
            .collect();
        let tree = build(&boxes, config)?;
        let bounds = tree.bounds();
        let (levels, references, cost) = (tree.levels, tree.items.len(), tree.cost(|_| 1.0));
        let (nodes, blocks) = into_blocks(tree, mesh, scale);
        let extent = extent(&vertices) * scale;
        Ok(Self { nodes, blocks, levels, references, cost, bounds, extent, scale })
    }

    /// Memory of nodes and blocks.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice()) + size_of_val(self.blocks.as_slice())
    }

    /// Checks the tree and its threads, and that its blocks hold the mesh's triangles, scaled.
    ///
    /// # Errors
    /// The first violation.
    pub fn validate(&self, mesh: &MeshView<'_>) -> Result<KdReport, KdViolation> {
        let boxes: Vec<Aabb> = (0..mesh.triangles.len() as u32)
            .map(|triangle| Aabb::from_points(mesh.corners(triangle).map(|p| p * self.scale)))
            .collect();
        for (block, lanes) in self.blocks.iter().enumerate() {
            for lane in lanes.used() {
                let prim = lanes.prims[lane];
                let exists = (prim as usize) < mesh.triangles.len();
                if !exists || lanes.triangle(lane) != mesh.corners(prim).map(|p| p * self.scale) {
                    return Err(KdViolation::Shape { node: block, what: "is a block with a wrong triangle" });
                }
            }
        }
        validate(&self.nodes, &boxes, |items| {
            let blocks = self.blocks.get(items)?;
            Some(blocks.iter().flat_map(|b| b.prims).filter(|&prim| prim != Block8::NO_PRIM).collect())
        })
    }
}

/// The tree with blocks of triangles instead of their numbers.
fn into_blocks(tree: KdTree, mesh: &MeshView<'_>, scale: f32) -> (Vec<KdNode>, Vec<Block8>) {
    let KdTree { mut nodes, items, .. } = tree;
    let mut runs = Vec::new();
    for node in nodes.iter_mut().filter(|node| node.is_leaf()) {
        let (first, run) = (runs.len() as u32, node.items());
        *node = KdNode { next: node.next, ..KdNode::leaf(node.bounds, first, run.len().div_ceil(8) as u32) };
        runs.extend(run.clone().step_by(8).map(|start| start..run.end.min(start + 8)));
    }
    let block = |run: &std::ops::Range<usize>| {
        Block8::new(items[run.clone()].iter().map(|&prim| (prim, mesh.corners(prim).map(|p| p * scale))))
    };
    let blocks = runs.par_iter().with_min_len(512).map(block).collect();
    (nodes, blocks)
}
