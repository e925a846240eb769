//! Writing a page, subtree by subtree.

use super::cluster::{Cluster, Numbered, TRIANGLES};
use super::node::{LeafRun, PackedChild, PackedNode};
use super::page::UNIT;
use crate::wide::{ChildRef, MeshBvh, Node8};
use vastlight_math::Aabb;

const NODE: usize = size_of::<PackedNode>();

/// A page in the making.
#[derive(Debug)]
pub(super) struct Writer<'a> {
    mesh: &'a MeshBvh,
    /// Most bytes of the page.
    slot: usize,
    bytes: Vec<u8>,
    /// Numbers in the mesh, in the order of the page.
    triangles: Vec<u32>,
    shares: PageBytes,
}

/// A finished page.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PackedPage {
    /// Nodes and clusters.
    pub bytes: Vec<u8>,
    /// Numbers in the mesh of the page's triangles, in its own order. A triangle that was cut may stand in several pages.
    pub triangles: Vec<u32>,
}

/// Why a subtree was not added.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Refusal {
    /// The page has no room: another one may have.
    Page,
    /// No page can hold a triangle of this block.
    Lattice(usize),
}

/// What the bytes of pages are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PageBytes {
    /// Nodes.
    pub nodes: usize,
    /// Anchors of clusters, and what fills them up to whole words.
    pub anchors: usize,
    /// Triangles' vertices.
    pub corners: usize,
    /// Positions of vertices.
    pub vertices: usize,
    /// Numbers of the triangles in the mesh.
    pub numbers: usize,
}

impl PageBytes {
    /// All together.
    #[must_use]
    pub fn sum(&self) -> usize {
        self.nodes + self.anchors + self.corners + self.vertices + self.numbers
    }

    pub(super) fn add(self, other: Self) -> Self {
        Self {
            nodes: self.nodes + other.nodes,
            anchors: self.anchors + other.anchors,
            corners: self.corners + other.corners,
            vertices: self.vertices + other.vertices,
            numbers: self.numbers + other.numbers,
        }
    }
}

impl<'a> Writer<'a> {
    pub(super) fn new(mesh: &'a MeshBvh, slot: usize) -> Self {
        // Places of nodes have 16 bits.
        let slot = slot.min(UNIT << 16);
        let bytes = Vec::with_capacity(slot);
        Self { mesh, slot, bytes, triangles: Vec::new(), shares: PageBytes::default() }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    /// Bytes that are left.
    pub(super) fn room(&self) -> usize {
        self.slot - self.bytes.len()
    }

    /// Adds all that is below `root` in the mesh, which has this box; gives the place of the root's node. If that does not
    /// fit, nothing is added.
    pub(super) fn add(&mut self, root: ChildRef, bounds: &Aabb) -> Result<u16, Refusal> {
        let (length, triangles, shares) = (self.bytes.len(), self.triangles.len(), self.shares);
        let added = self.add_below(root, bounds);
        if added.is_err() {
            self.bytes.truncate(length);
            self.triangles.truncate(triangles);
            self.shares = shares;
        }
        added
    }

    fn add_below(&mut self, root: ChildRef, bounds: &Aabb) -> Result<u16, Refusal> {
        if root.is_leaf() {
            // A leaf needs a node to stand behind.
            let mut node = Node8::EMPTY;
            node.set(0, root, bounds);
            return self.add_node(&node, None, &mut Vec::new());
        }
        let mut waiting = Vec::new();
        let place = self.add_node(&self.mesh.nodes[root.index()], None, &mut waiting)?;
        while let Some((child, parent)) = waiting.pop() {
            self.add_node(&self.mesh.nodes[child.index()], Some(parent), &mut waiting)?;
        }
        Ok(place)
    }

    /// Adds a node and the cluster behind it, and tells its place to its parent, given by place and slot. The nodes below
    /// are left waiting, the first on top, each with its parent.
    fn add_node(
        &mut self,
        node: &Node8,
        parent: Option<(u16, usize)>,
        waiting: &mut Vec<(ChildRef, (u16, usize))>,
    ) -> Result<u16, Refusal> {
        let place = (self.bytes.len() / UNIT) as u16;
        let mut children = [None; 8];
        let mut leaves: Vec<Vec<Numbered>> = Vec::with_capacity(8);
        let mut first = 0;
        for slot in (0..8).rev().filter(|&slot| node.children[slot] != ChildRef::NONE) {
            let child = node.children[slot];
            children[slot] = Some(if child.is_leaf() {
                let triangles = self.triangles(child.index());
                let run = LeafRun { first, count: triangles.len() as u8 };
                first += run.count;
                leaves.push(triangles);
                PackedChild::Leaf(run)
            } else {
                waiting.push((child, (place, slot)));
                PackedChild::Node
            });
        }
        debug_assert!(usize::from(first) <= TRIANGLES);
        let block = node.children.iter().find(|c| c.is_leaf()).map_or(0, |leaf| leaf.index());
        let cluster = Cluster::new(&leaves).ok_or(Refusal::Lattice(block))?;
        let packed = PackedNode::new(node, &children, cluster.packing, self.triangles.len() as u16);
        self.triangles.extend(leaves.iter().flatten().map(|triangle| triangle.1));
        self.write(&packed, (!leaves.is_empty()).then_some(&cluster))?;
        if let Some((parent, slot)) = parent {
            self.set_child(parent, slot, place);
        }
        Ok(place)
    }

    fn triangles(&self, block: usize) -> Vec<Numbered> {
        let block = &self.mesh.blocks[block];
        let corners = |lane: usize| block.triangle(lane).map(|corner| corner.to_array());
        block.used().map(|lane| (corners(lane), block.prims[lane])).collect()
    }

    fn write(&mut self, node: &PackedNode, cluster: Option<&Cluster>) -> Result<(), Refusal> {
        self.bytes.extend(bytemuck::bytes_of(node));
        self.shares.nodes += NODE;
        if let Some(Cluster { anchor, corners, vertices, numbers, .. }) = cluster {
            let before = self.bytes.len();
            self.bytes.extend(bytemuck::bytes_of(anchor));
            [corners, vertices, numbers].into_iter().for_each(|part| self.bytes.extend(part));
            self.bytes.resize(self.bytes.len().next_multiple_of(UNIT), 0);
            let inside = corners.len() + vertices.len() + numbers.len();
            self.shares = self.shares.add(PageBytes {
                nodes: 0,
                anchors: self.bytes.len() - before - inside,
                corners: corners.len(),
                vertices: vertices.len(),
                numbers: numbers.len(),
            });
        }
        if self.bytes.len() > self.slot { Err(Refusal::Page) } else { Ok(()) }
    }

    /// Makes a slot of the node at `parent` point to the node at `place`.
    fn set_child(&mut self, parent: u16, slot: usize, place: u16) {
        let bytes = self.bytes.get_mut(UNIT * usize::from(parent)..).and_then(|rest| rest.get_mut(..NODE));
        if let Some(bytes) = bytes {
            let mut node: PackedNode = bytemuck::pod_read_unaligned(bytes);
            node.set_node(slot, parent, place);
            bytes.copy_from_slice(bytemuck::bytes_of(&node));
        }
    }

    /// The page, and what its bytes are; the writer starts anew.
    pub(super) fn finish(&mut self) -> (PackedPage, PageBytes) {
        let next = Vec::with_capacity(self.slot);
        let bytes = std::mem::replace(&mut self.bytes, next);
        let triangles = std::mem::take(&mut self.triangles);
        (PackedPage { bytes, triangles }, std::mem::take(&mut self.shares))
    }
}
