//! What is above a mesh's pages.

use super::pack::pack;
use super::page::SLACK;
use super::write::{PackedPage, PageBytes};
use crate::wide::{ChildRef, MeshBvh, Node8};
use vastlight_math::Aabb;

/// A subtree of a page.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct PageRoot {
    /// Number of the page.
    pub page: u32,
    /// Place of the root's node in the page.
    place: u32,
    /// Around the subtree: smallest and largest corner.
    bounds: [[f32; 3]; 2],
}

impl PageRoot {
    pub(super) fn new(page: u32, place: u16, bounds: &Aabb) -> Self {
        Self { page, place: u32::from(place), bounds: [bounds.min.to_array(), bounds.max.to_array()] }
    }

    /// The same with pages counted from another number on.
    #[must_use]
    pub fn moved(self, by: u32) -> Self {
        Self { page: self.page + by, ..self }
    }

    /// The node of the page where the subtree begins.
    #[inline(always)]
    #[must_use]
    pub fn node(&self) -> ChildRef {
        ChildRef::node(self.place)
    }

    /// Around the subtree.
    #[inline(always)]
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        Aabb { min: self.bounds[0].into(), max: self.bounds[1].into() }
    }
}

/// A mesh in the compact layout, in its own space times [`CompactMesh::scale`]: what is above its pages.
#[derive(Clone, Debug)]
pub struct CompactMesh {
    /// The tree above the pages; its leaves are indices of `roots`.
    pub nodes: Vec<Node8>,
    /// The subtrees in pages.
    pub roots: Vec<PageRoot>,
    /// Where rays start; none for a mesh without triangles.
    pub root: Option<ChildRef>,
    /// Nodes on the longest way from the root to a leaf of a page.
    pub levels: usize,
    /// Around all triangles, scaled.
    pub bounds: Aabb,
    /// Largest absolute coordinate of the mesh's vertices, used or not, scaled.
    pub extent: f32,
    /// Positions here are the mesh's times this power of two.
    pub scale: f32,
    /// What the pages' bytes are.
    pub shares: PageBytes,
}

/// Why a mesh has no compact layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CompactError {
    /// Coordinates of a triangle are no multiples of a power of two within 24 bits.
    #[error("triangle {triangle} is not on a lattice of 24 bits")]
    Lattice {
        /// The triangle, or one beside it.
        triangle: u32,
    },
    /// A page has no room for a single leaf.
    #[error("{bytes} bytes are too few for a page")]
    Slot {
        /// Bytes of a page.
        bytes: usize,
    },
}

impl CompactMesh {
    /// Without triangles.
    pub const EMPTY: Self = Self {
        nodes: Vec::new(),
        roots: Vec::new(),
        root: None,
        levels: 0,
        bounds: Aabb::EMPTY,
        extent: 0.0,
        scale: 1.0,
        shares: PageBytes { nodes: 0, anchors: 0, corners: 0, vertices: 0, numbers: 0 },
    };

    /// Most bytes of a page, unless chosen otherwise: with what must follow it in memory, 64 KiB.
    pub const SLOT: usize = (1 << 16) - SLACK;

    /// Packs a mesh into pages of at most `slot` bytes, with all threads of the current pool. Pages are numbered from 0.
    ///
    /// # Errors
    /// [`CompactError::Lattice`] for a mesh whose positions are on no lattice of 24 bits, [`CompactError::Slot`] for
    /// pages smaller than about 400 bytes.
    pub fn pack(mesh: &MeshBvh, slot: usize) -> Result<(Self, Vec<PackedPage>), CompactError> {
        let (packed, root) = pack(mesh, slot)?;
        let above = Self {
            nodes: packed.nodes,
            roots: packed.roots,
            root,
            levels: mesh.levels,
            bounds: mesh.bounds,
            extent: mesh.extent,
            scale: mesh.scale,
            shares: packed.shares,
        };
        Ok((above, packed.pages))
    }

    /// Counts pages from another number on.
    pub fn renumber(&mut self, first_page: u32) {
        self.roots.iter_mut().for_each(|root| *root = root.moved(first_page));
    }

    /// Memory of what is above the pages.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.roots[..])
    }
}
