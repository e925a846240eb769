//! Putting things back in order: nodes, blocks and wide nodes in the order of a walk, without free places between.
//!
//! The arena keeps nodes near their parents as long as few of them change. After many changes it pays to lay all out afresh.

use super::arena::Arena;
use super::leaves::Leaves;
use super::tree::{DynamicTree, NONE};
use super::wide::WideMap;
use crate::memory::Pages;
use crate::wide::{ChildRef, MeshBvh, Node8};

/// Lays the binary nodes out depth first, children in pairs.
pub(super) fn tidy_nodes(tree: &mut DynamicTree, wide: &mut WideMap) {
    if tree.root == NONE {
        return;
    }
    let mut order = Vec::with_capacity(tree.links.len());
    order.push(tree.root);
    let mut new = vec![NONE; tree.links.len()];
    new[tree.root as usize] = 0;
    let mut waiting = vec![tree.root];
    while let Some(node) = waiting.pop() {
        if tree.is_leaf(node) {
            continue;
        }
        let [a, b] = tree.link(node).children;
        for child in [a, b] {
            new[child as usize] = order.len() as u32;
            order.push(child);
        }
        waiting.extend([b, a]);
    }
    let moved = |node: u32| new.get(node as usize).copied().unwrap_or(NONE);
    let links = order.iter().map(|&node| {
        let mut link = *tree.link(node);
        link.parent = moved(link.parent);
        if link.children[0] != NONE {
            link.children = link.children.map(moved);
        }
        link
    });
    tree.links = links.collect();
    tree.boxes = order.iter().map(|&node| tree.boxes[node as usize].clone()).collect();
    tree.arena = Arena::full(order.len());
    tree.root = 0;
    wide.rename(moved);
}

/// Lays wide nodes and blocks out in the order of a walk.
pub(super) fn tidy_wide(tree: &mut DynamicTree, leaves: &mut Leaves, wide: &mut WideMap, bvh: &mut MeshBvh) {
    let Some(root) = bvh.root else { return };
    let (mut nodes, mut blocks) = (Vec::new(), Vec::new());
    let mut of_node = vec![0; bvh.nodes.len()];
    let mut of_block = vec![0; bvh.blocks.len()];
    let mut see = |child: ChildRef, nodes: &mut Vec<usize>| {
        let (seen, new) = if child.is_leaf() { (&mut blocks, &mut of_block) } else { (nodes, &mut of_node) };
        new[child.index()] = seen.len() as u32;
        seen.push(child.index());
    };
    see(root, &mut nodes);
    let mut waiting = vec![root];
    while let Some(node) = waiting.pop().filter(|child| !child.is_leaf()) {
        let children = bvh.nodes[node.index()].children;
        children.iter().filter(|&&c| c != ChildRef::NONE).for_each(|&child| see(child, &mut nodes));
        waiting.extend(children.into_iter().rev().filter(|child| !child.is_leaf()));
    }
    let moved = |child: ChildRef| match child {
        ChildRef::NONE => child,
        leaf if leaf.is_leaf() => ChildRef::leaf(of_block[leaf.index()]),
        node => ChildRef::node(of_node[node.index()]),
    };
    let mut new: Pages<Node8> = Pages::zeroed(nodes.len());
    for (new, &old) in new.iter_mut().zip(&nodes) {
        *new = Node8 { children: bvh.nodes[old].children.map(moved), ..bvh.nodes[old] };
    }
    bvh.nodes = new;
    bvh.root = Some(moved(root));
    wide.reorder(&nodes);
    leaves.reorder(&mut bvh.blocks, &blocks);
    for link in &mut tree.links {
        if link.children[0] == NONE && link.children[1] != NONE {
            link.children[1] = of_block[link.children[1] as usize];
        }
        if link.wide != NONE {
            link.wide = of_node[link.wide as usize];
        }
    }
}
