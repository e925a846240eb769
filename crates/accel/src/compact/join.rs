//! A tree above parts of a mesh that were packed by themselves.

use super::mesh::CompactMesh;
use super::write::PageBytes;
use crate::wide::{ChildRef, Node8, TopBvh};
use crate::{BuildConfig, BuildError, Scratch};
use vastlight_math::Aabb;

impl CompactMesh {
    /// Puts parts of a mesh under one tree with the builder `name`. Parts have the scale and the extent of the whole mesh, and their pages
    /// the numbers that they keep. None for no parts.
    ///
    /// # Errors
    /// Those of [`build()`](crate::build()).
    pub fn join(name: &str, parts: &[Self], config: &BuildConfig) -> Result<Option<Self>, BuildError> {
        let Some(any) = parts.first() else { return Ok(None) };
        let boxes: Vec<Aabb> = parts.iter().map(|part| part.bounds).collect();
        let top = TopBvh::build(name, &boxes, |_| 1.0, config, &mut Scratch::default())?;
        let places = Places::new(top.nodes.len(), parts);
        let of_part = |leaf: ChildRef| match leaf {
            ChildRef::NONE => leaf,
            leaf if leaf.is_leaf() => places.root(leaf.index(), &parts[leaf.index()]),
            node => node,
        };
        let mut nodes = top.nodes;
        nodes.iter_mut().for_each(|node| node.children = node.children.map(of_part));
        let below = parts.iter().map(|part| part.levels).max().unwrap_or(0);
        let mut whole = Self {
            nodes,
            roots: Vec::with_capacity(parts.iter().map(|part| part.roots.len()).sum()),
            root: top.root.map(of_part).filter(|&root| root != ChildRef::NONE),
            levels: top.levels + below,
            bounds: boxes.iter().fold(Aabb::EMPTY, |a, b| a.union(*b)),
            extent: any.extent,
            scale: any.scale,
            shares: PageBytes::default(),
        };
        for (number, part) in parts.iter().enumerate() {
            let moved = |node: &Node8| Node8 {
                children: node.children.map(|child| places.moved(number, child)),
                ..*node
            };
            whole.nodes.extend(part.nodes.iter().map(moved));
            whole.roots.extend(&part.roots);
            whole.shares = whole.shares.add(part.shares);
        }
        Ok(Some(whole))
    }
}

/// Where the nodes and roots of each part stand in the whole.
struct Places {
    nodes: Vec<u32>,
    roots: Vec<u32>,
}

impl Places {
    fn new(top_nodes: usize, parts: &[CompactMesh]) -> Self {
        let (mut node, mut root) = (top_nodes as u32, 0);
        let mut places = Self { nodes: Vec::new(), roots: Vec::new() };
        for part in parts {
            places.nodes.push(node);
            places.roots.push(root);
            node += part.nodes.len() as u32;
            root += part.roots.len() as u32;
        }
        places
    }

    fn moved(&self, part: usize, child: ChildRef) -> ChildRef {
        match child {
            ChildRef::NONE => child,
            leaf if leaf.is_leaf() => ChildRef::leaf(leaf.index() as u32 + self.roots[part]),
            node => ChildRef::node(node.index() as u32 + self.nodes[part]),
        }
    }

    fn root(&self, number: usize, part: &CompactMesh) -> ChildRef {
        part.root.map_or(ChildRef::NONE, |root| self.moved(number, root))
    }
}
