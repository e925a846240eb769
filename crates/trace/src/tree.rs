//! The trees that a ray crosses in a mesh, and what it finds at their leaves, whatever the layout.

use vastlight_accel::compact::{CompactMesh, PackedNode, Page, PageRoot};
use vastlight_accel::wide::traverse::{Memory, Prefetch};
use vastlight_accel::wide::{
    BlendedNode, Block8, InstanceNode, InstanceNodes, Leaf, MeshKeys, Node8, WideNode,
};
use vastlight_math::Between;
use vastlight_paging::Table;
use vastlight_simd::Simd8;

/// Wide nodes by place.
pub(crate) trait Nodes {
    type Node<'n>: WideNode
    where
        Self: 'n;

    /// The node at a place; none in a damaged tree.
    fn node<S: Simd8>(&self, simd: S, place: usize) -> Option<Self::Node<'_>>;
}

/// Wide nodes over leaves.
pub(crate) trait Tree: Nodes {
    type Memory: Prefetch;

    fn memory(&self) -> &Self::Memory;

    /// Nodes and leaves that a walk comes to at most, unless the tree is damaged so that ways in it meet again.
    #[inline(always)]
    fn most_steps(&self) -> usize {
        usize::MAX
    }

    /// Brings a visitor to what a leaf is; whether it found anything.
    fn visit<S: Simd8>(&self, simd: S, visitor: &mut impl Visitor<S>, leaf: usize) -> bool;
}

/// Comes to leaves.
pub(crate) trait Visitor<S: Simd8> {
    /// Looks for hits of triangles; whether there was one.
    fn triangles(&mut self, simd: S, triangles: &impl Leaf) -> bool;
    /// Looks for hits in a part of a page; whether there was one.
    fn subtree(&mut self, simd: S, subtree: &Subtree<'_>) -> bool;
    /// Looks for hits of triangles, each ray at its own time; whether there was one.
    fn moving(&mut self, simd: S, keys: &MeshKeys, leaf: usize) -> bool;
}

/// A part of a page.
pub(crate) struct Subtree<'a> {
    /// By leaves of the mesh's upper nodes.
    pub(crate) number: u32,
    pub(crate) root: &'a PageRoot,
    /// The page, if it is in memory.
    pub(crate) page: Option<Page<'a>>,
}

impl Nodes for InstanceNodes {
    type Node<'n> = InstanceNode<'n>;

    #[inline(always)]
    fn node<S: Simd8>(&self, _simd: S, place: usize) -> Option<InstanceNode<'_>> {
        self.get(place)
    }
}

/// A mesh with full boxes and unpacked triangles.
#[derive(Clone, Copy)]
pub(crate) struct OverBlocks<'a> {
    pub(crate) nodes: &'a [Node8],
    pub(crate) blocks: &'a [Block8],
    pub(crate) memory: Memory,
}

impl Nodes for OverBlocks<'_> {
    type Node<'n>
        = &'n Node8
    where
        Self: 'n;

    #[inline(always)]
    fn node<S: Simd8>(&self, _simd: S, place: usize) -> Option<&Node8> {
        self.nodes.get(place)
    }
}

impl Tree for OverBlocks<'_> {
    type Memory = Memory;

    #[inline(always)]
    fn memory(&self) -> &Memory {
        &self.memory
    }

    #[inline(always)]
    fn visit<S: Simd8>(&self, simd: S, visitor: &mut impl Visitor<S>, leaf: usize) -> bool {
        // Where numbers overflow, a ray meets the box of a slot without child.
        self.blocks.get(leaf).is_some_and(|block| visitor.triangles(simd, block))
    }
}

/// A mesh at a moment of an open shutter.
#[derive(Clone, Copy)]
pub(crate) struct AtMoment<'a> {
    keys: &'a MeshKeys,
    between: Between,
    memory: Memory,
}

impl<'a> AtMoment<'a> {
    #[inline(always)]
    pub(crate) fn new(keys: &'a MeshKeys, between: Between) -> Self {
        let (nodes, blocks) = keys.earlier(&between);
        Self { keys, between, memory: Memory::new(nodes, blocks) }
    }
}

impl Nodes for AtMoment<'_> {
    type Node<'n>
        = BlendedNode<'n>
    where
        Self: 'n;

    #[inline(always)]
    fn node<S: Simd8>(&self, _simd: S, place: usize) -> Option<BlendedNode<'_>> {
        self.keys.node(place, &self.between)
    }
}

impl Tree for AtMoment<'_> {
    type Memory = Memory;

    #[inline(always)]
    fn memory(&self) -> &Memory {
        &self.memory
    }

    #[inline(always)]
    fn visit<S: Simd8>(&self, simd: S, visitor: &mut impl Visitor<S>, leaf: usize) -> bool {
        self.keys.block(simd, leaf, &self.between).is_some_and(|block| visitor.triangles(simd, &block))
    }
}

/// The same mesh for rays of all times.
#[derive(Clone, Copy)]
pub(crate) struct AllMoments<'a> {
    keys: &'a MeshKeys,
    memory: Memory,
}

impl<'a> AllMoments<'a> {
    #[inline(always)]
    pub(crate) fn new(keys: &'a MeshKeys) -> Self {
        let (_, blocks) = keys.earlier(&keys.between(0.0));
        Self { keys, memory: Memory::new(keys.swept(), blocks) }
    }
}

impl Nodes for AllMoments<'_> {
    type Node<'n>
        = &'n Node8
    where
        Self: 'n;

    #[inline(always)]
    fn node<S: Simd8>(&self, _simd: S, place: usize) -> Option<&Node8> {
        self.keys.swept().get(place)
    }
}

impl Tree for AllMoments<'_> {
    type Memory = Memory;

    #[inline(always)]
    fn memory(&self) -> &Memory {
        &self.memory
    }

    #[inline(always)]
    fn visit<S: Simd8>(&self, simd: S, visitor: &mut impl Visitor<S>, leaf: usize) -> bool {
        visitor.moving(simd, self.keys, leaf)
    }
}

/// What is above the pages of a mesh.
#[derive(Clone, Copy)]
pub(crate) struct OverPages<'a> {
    pub(crate) mesh: &'a CompactMesh,
    pub(crate) pages: &'a Table,
    pub(crate) memory: Memory,
}

impl Nodes for OverPages<'_> {
    type Node<'n>
        = &'n Node8
    where
        Self: 'n;

    #[inline(always)]
    fn node<S: Simd8>(&self, _simd: S, place: usize) -> Option<&Node8> {
        self.mesh.nodes.get(place)
    }
}

impl Tree for OverPages<'_> {
    type Memory = Memory;

    #[inline(always)]
    fn memory(&self) -> &Memory {
        &self.memory
    }

    #[inline(always)]
    fn visit<S: Simd8>(&self, simd: S, visitor: &mut impl Visitor<S>, leaf: usize) -> bool {
        let Some(root) = self.mesh.roots.get(leaf) else { return false };
        let page = self.pages.page(root.page).map(Page::new);
        visitor.subtree(simd, &Subtree { number: leaf as u32, root, page })
    }
}

impl Nodes for Page<'_> {
    type Node<'n>
        = &'n PackedNode
    where
        Self: 'n;

    #[inline(always)]
    fn node<S: Simd8>(&self, simd: S, place: usize) -> Option<&PackedNode> {
        self.prefetch_cluster(simd, place);
        Page::node(self, place)
    }
}

impl Tree for Page<'_> {
    type Memory = Self;

    #[inline(always)]
    fn memory(&self) -> &Self {
        self
    }

    #[inline(always)]
    fn most_steps(&self) -> usize {
        self.most_children()
    }

    #[inline(always)]
    fn visit<S: Simd8>(&self, simd: S, visitor: &mut impl Visitor<S>, leaf: usize) -> bool {
        visitor.triangles(simd, &self.leaf(simd, leaf))
    }
}
