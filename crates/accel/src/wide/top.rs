//! The tree over instances: wide nodes whose leaves are single primitives.

use super::collapse::{emit, plan};
use super::{ChildRef, Node8};
use crate::quality::counts;
use crate::{BuildConfig, BuildError, Quality, Reference, Scratch, build, quality_with};
use vastlight_math::Aabb;

/// A wide tree over boxes; its leaves are the boxes' numbers.
#[derive(Clone, Debug, Default)]
pub struct TopBvh {
    /// Wide nodes.
    pub nodes: Vec<Node8>,
    /// Where rays start; none without boxes.
    pub root: Option<ChildRef>,
    /// Nodes on the longest way from the root to a leaf.
    pub levels: usize,
    /// Of the binary tree.
    pub quality: Quality,
}

impl TopBvh {
    /// Builds over the boxes that are not empty; box `i` becomes leaf `i`, for whose cost
    /// `costs` is asked.
    ///
    /// # Errors
    /// Those of [`build()`](crate::build()).
    pub fn build(
        name: &str,
        boxes: &[Aabb],
        costs: impl Fn(u32) -> f64 + Sync,
        config: &BuildConfig,
        scratch: &mut Scratch,
    ) -> Result<Self, BuildError> {
        let config = BuildConfig { max_leaf: 1, ..*config };
        let mut references: Vec<Reference> = boxes
            .iter()
            .enumerate()
            .filter(|(_, b)| !b.is_empty())
            .map(|(i, b)| Reference::new(b, i as u32))
            .collect();
        let tree = build(name, &mut references, None, &config, scratch)?;
        let plan = plan(&tree.nodes, 1, config.level);
        let prim = |leaf: ChildRef| {
            let binary = plan.leaves[leaf.index()];
            ChildRef::leaf(tree.prims[tree.nodes[binary as usize].first as usize])
        };
        let bounds = |binary: u32| {
            let node = &tree.nodes[binary as usize];
            // A leaf has its own box, also where the builder saw one that was pulled in.
            if node.is_leaf() { boxes[tree.prims[node.first as usize] as usize] } else { outer(node.bounds) }
        };
        let mut nodes = vec![Node8::EMPTY; plan.nodes.len()];
        emit(&plan, &mut nodes, bounds, prim);
        let root = plan.root.map(|root| if root.is_leaf() { prim(root) } else { root });
        let quality = if config.measure { quality_with(&tree, costs) } else { counts(&tree.nodes) };
        Ok(Self { nodes, root, levels: plan.levels, quality })
    }

    /// Memory of the nodes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice())
    }
}

/// The box with the planes that stand at a builder's limit moved to infinity, since boxes below may go on.
fn outer(bounds: Aabb) -> Aabb {
    use vastlight_math::Vec3;
    let limit = Vec3::splat(Reference::LIMIT);
    Aabb {
        min: Vec3::select(bounds.min.cmple(-limit), Vec3::NEG_INFINITY, bounds.min),
        max: Vec3::select(bounds.max.cmpge(limit), Vec3::INFINITY, bounds.max),
    }
}
