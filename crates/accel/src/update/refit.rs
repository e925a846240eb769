//! New boxes for the nodes of any wide tree, whose shape stays.
//!
//! Blocks are filled from the new positions, each with its box; then nodes get theirs level by level from the bottom up. In the order
//! of a walk by levels the children of a node stand in a row, and those of later nodes behind them. A triangle that a
//! builder cut is whole in every block that names it, and boxes contain it whole.

use super::leaves::fill_named;
use super::tree::SharedBox;
use crate::wide::{ChildRef, MeshBvh, MeshView, Node8};
use rayon::prelude::*;
use vastlight_math::Aabb;
use vastlight_simd::Level;

/// Moves `bvh` to the positions of `mesh`, whose triangles are those that it was built over. Triangles that do not exist
/// are left where they are.
pub fn refit(bvh: &mut MeshBvh, mesh: &MeshView<'_>) {
    bvh.scale_to(mesh);
    refit_scaled(bvh, mesh);
}

/// [`refit`] with the scale that `bvh` has.
pub(crate) fn refit_scaled(bvh: &mut MeshBvh, mesh: &MeshView<'_>) {
    let mut boxes = vec![Aabb::EMPTY; bvh.blocks.len()];
    fill_named(&mut bvh.blocks, &mut boxes, mesh, bvh.scale, Level::detect());
    bvh.bounds = match bvh.root {
        None => Aabb::EMPTY,
        Some(root) => refit_nodes(&mut bvh.nodes, root, &boxes),
    };
}

/// Gives all nodes below `root` their boxes, from those of leaves; gives the root's.
fn refit_nodes(nodes: &mut [Node8], root: ChildRef, leaves: &[Aabb]) -> Aabb {
    let (order, levels) = by_levels(nodes, root);
    let mut of_nodes = Vec::new();
    of_nodes.resize_with(nodes.len(), SharedBox::default);
    let of_child = |child: ChildRef| {
        let of_node = || of_nodes.get(child.index()).map(SharedBox::get);
        let bounds = if child.is_leaf() { leaves.get(child.index()).copied() } else { of_node() };
        bounds.unwrap_or(Aabb::EMPTY)
    };
    let mut end = order.len();
    for &first in levels.iter().rev() {
        order[first..end].par_iter().with_min_len(512).for_each(|&node| {
            let children = nodes[node as usize].children.map(of_child);
            let around = children.into_iter().fold(Aabb::EMPTY, Aabb::union);
            of_nodes[node as usize].set(&around);
        });
        end = first;
    }
    nodes.par_iter_mut().with_min_len(256).for_each(|node| {
        for slot in 0..8 {
            let child = node.children[slot];
            node.set(slot, child, &of_child(child));
        }
    });
    of_child(root)
}

/// The nodes, those near the root first, and where each level starts.
fn by_levels(nodes: &[Node8], root: ChildRef) -> (Vec<u32>, Vec<usize>) {
    let mut order = Vec::with_capacity(nodes.len());
    let mut levels = Vec::new();
    if !root.is_leaf() {
        order.push(root.index() as u32);
    }
    let mut first = 0;
    // Nodes that are reached twice are those of a damaged tree.
    while first < order.len() && order.len() <= nodes.len() {
        let end = order.len();
        levels.push(first);
        for place in first..end {
            let below = nodes[order[place] as usize].children.into_iter().filter(|child| !child.is_leaf());
            order.extend(below.map(|child| child.index() as u32));
        }
        first = end;
    }
    (order, levels)
}
