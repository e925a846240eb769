//! Whether pages hold what they should.

use super::{CompactMesh, Page};
use crate::wide::{
    Block8, Boxes, ChildRef, Leaf, MeshView, Node8, WideNode, validate_blocks, validate_nodes,
};
use crate::{Report, Violation};
use vastlight_simd::{Kernel, Level, Simd8};

/// A tree with full boxes.
struct Unpacked {
    nodes: Vec<Node8>,
    blocks: Vec<Block8>,
    root: Option<ChildRef>,
}

impl CompactMesh {
    /// Checks the tree over all pages, which `pages` finds by number, and that its leaves hold exactly the mesh's
    /// triangles, scaled.
    ///
    /// # Errors
    /// The first violation.
    pub fn validate<'p>(
        &self,
        pages: impl Fn(u32) -> Option<Page<'p>>,
        mesh: &MeshView<'_>,
    ) -> Result<Report, Violation> {
        let Unpacked { nodes, blocks, root } = self.unpacked(&pages)?;
        validate_blocks(&blocks, mesh, self.scale)?;
        let corners = |prim: u32| mesh.corners(prim).map(|p| p * self.scale);
        let covered = |prim: u32, boxes: &[vastlight_math::Aabb]| {
            crate::validate::covers_triangle(corners(prim), boxes)
        };
        let leaf = |leaf: usize| blocks.get(leaf).map(Block8::boxes);
        validate_nodes(&nodes, root, mesh.triangles.len(), Boxes::Rounded, leaf, covered)
    }

    /// Nodes, those above pages first, and blocks of all pages, and the root.
    fn unpacked<'p>(&self, pages: &impl Fn(u32) -> Option<Page<'p>>) -> Result<Unpacked, Violation> {
        let (mut nodes, mut blocks) = (self.nodes.clone(), Vec::new());
        for node in 0..self.nodes.len() {
            for slot in 0..8 {
                let child = self.nodes[node].children[slot];
                if child != ChildRef::NONE && child.is_leaf() {
                    nodes[node].children[slot] =
                        self.unpack_root(pages, child.index(), &mut nodes, &mut blocks)?;
                }
            }
        }
        let root = match self.root {
            Some(root) if root.is_leaf() => {
                Some(self.unpack_root(pages, root.index(), &mut nodes, &mut blocks)?)
            }
            root => root,
        };
        Ok(Unpacked { nodes, blocks, root })
    }

    /// Appends what is below a page's root; gives its place.
    fn unpack_root<'p>(
        &self,
        pages: &impl Fn(u32) -> Option<Page<'p>>,
        root: usize,
        nodes: &mut Vec<Node8>,
        blocks: &mut Vec<Block8>,
    ) -> Result<ChildRef, Violation> {
        let fault = |what| Violation::Shape { node: root, what };
        let (page, root) = (self.roots.get(root))
            .and_then(|root| Some((pages(root.page)?, root.node())))
            .ok_or(fault("is the root of a page that does not exist"))?;
        let mut append = |child: ChildRef, nodes: &mut Vec<Node8>| {
            if child.is_leaf() {
                blocks.push(Level::detect().dispatch(Unpack { page, leaf: child.index() }));
                return Ok(ChildRef::leaf(blocks.len() as u32 - 1));
            }
            let node = page.node(child.index()).ok_or(fault("has a child that the page has not"))?;
            nodes.push(node.to_wide(child.index()));
            Ok(ChildRef::node(nodes.len() as u32 - 1))
        };
        let first = nodes.len();
        let root = append(root, nodes)?;
        let mut next = first;
        while next < nodes.len() {
            // More than there are places.
            if nodes.len() - first > 1 << 16 {
                return Err(fault("has a page whose nodes are no trees"));
            }
            for slot in 0..8 {
                let child = nodes[next].children[slot];
                if child != ChildRef::NONE {
                    nodes[next].children[slot] = append(child, nodes)?;
                }
            }
            next += 1;
        }
        Ok(root)
    }
}

/// Unpacks a leaf.
struct Unpack<'a> {
    page: Page<'a>,
    leaf: usize,
}

impl Kernel for Unpack<'_> {
    type Output = Block8;

    #[inline(always)]
    fn run<S: Simd8>(self, simd: S) -> Block8 {
        let leaf = self.page.leaf(simd, self.leaf);
        let mut block = Block8 { corners: *leaf.corners(), ..Block8::EMPTY };
        for lane in (0..8).filter(|&lane| leaf.lanes() >> lane & 1 == 1) {
            block.prims[lane] = leaf.prim(lane);
        }
        block
    }
}
