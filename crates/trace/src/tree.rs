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

impl Nodes for &[Node8] {
    type Node<'n>
        = &'n Node8
    where
        Self: 'n;

    #[inline(always)]
    fn node<S: Simd8>(&self, _simd: S, place: usize) -> Option<&Node8> {
        self.get(place)
    }
}

/// What stands below the nodes of a mesh.
pub(crate) trait Below {
    /// See [`Tree::visit`].
    fn visit<S: Simd8>(&self, simd: S, visitor: &mut impl Visitor<S>, leaf: usize) -> bool;
}

/// Unpacked triangles.
impl Below for &[Block8] {
    #[inline(always)]
    fn visit<S: Simd8>(&self, simd: S, visitor: &mut impl Visitor<S>, leaf: usize) -> bool {
        // Where numbers overflow, a ray meets the box of a slot without child.
        self.get(leaf).is_some_and(|block| visitor.triangles(simd, block))
    }
}

/// Triangles at keys of an open shutter.
impl Below for &MeshKeys {
    #[inline(always)]
    fn visit<S: Simd8>(&self, simd: S, visitor: &mut impl Visitor<S>, leaf: usize) -> bool {
        visitor.moving(simd, self, leaf)
    }
}

/// The pages of a mesh.
#[derive(Clone, Copy)]
pub(crate) struct InPages<'a> {
    pub(crate) mesh: &'a CompactMesh,
    pub(crate) pages: &'a Table,
}

impl Below for InPages<'_> {
    #[inline(always)]
    fn visit<S: Simd8>(&self, simd: S, visitor: &mut impl Visitor<S>, leaf: usize) -> bool {
        let Some(root) = self.mesh.roots.get(leaf) else { return false };
        let page = self.pages.page(root.page).map(Page::new);
        visitor.subtree(simd, &Subtree { number: leaf as u32, root, page })
    }
}

/// A mesh at a moment of an open shutter.
#[derive(Clone, Copy)]
pub(crate) struct Moment<'a> {
    keys: &'a MeshKeys,
    between: Between,
}

impl Nodes for Moment<'_> {
    type Node<'n>
        = BlendedNode<'n>
    where
        Self: 'n;

    #[inline(always)]
    fn node<S: Simd8>(&self, _simd: S, place: usize) -> Option<BlendedNode<'_>> {
        self.keys.node(place, &self.between)
    }
}

impl Below for Moment<'_> {
    #[inline(always)]
    fn visit<S: Simd8>(&self, simd: S, visitor: &mut impl Visitor<S>, leaf: usize) -> bool {
        self.keys.block(simd, leaf, &self.between).is_some_and(|block| visitor.triangles(simd, &block))
    }
}

/// A mesh: nodes over what is below them.
#[derive(Clone, Copy)]
pub(crate) struct Over<N, L> {
    pub(crate) nodes: N,
    pub(crate) leaves: L,
    pub(crate) memory: Memory,
}

impl<'a> Over<Moment<'a>, Moment<'a>> {
    /// A mesh whose vertices move, at a time.
    #[inline(always)]
    pub(crate) fn at(keys: &'a MeshKeys, time: f32) -> Self {
        let moment = Moment { keys, between: keys.between(time) };
        let (nodes, blocks) = keys.earlier(&moment.between);
        Self { nodes: moment, leaves: moment, memory: Memory::new(nodes, blocks) }
    }
}

impl<'a> Over<&'a [Node8], &'a MeshKeys> {
    /// The same for rays of all times.
    #[inline(always)]
    pub(crate) fn all_times(keys: &'a MeshKeys) -> Self {
        let (_, blocks) = keys.earlier(&keys.between(0.0));
        Self { nodes: keys.swept(), leaves: keys, memory: Memory::new(keys.swept(), blocks) }
    }
}

impl<N: Nodes, L> Nodes for Over<N, L> {
    type Node<'n>
        = N::Node<'n>
    where
        Self: 'n;

    #[inline(always)]
    fn node<S: Simd8>(&self, simd: S, place: usize) -> Option<N::Node<'_>> {
        self.nodes.node(simd, place)
    }
}

impl<N: Nodes, L: Below> Tree for Over<N, L> {
    type Memory = Memory;

    #[inline(always)]
    fn memory(&self) -> &Memory {
        &self.memory
    }

    #[inline(always)]
    fn visit<S: Simd8>(&self, simd: S, visitor: &mut impl Visitor<S>, leaf: usize) -> bool {
        self.leaves.visit(simd, visitor, leaf)
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
