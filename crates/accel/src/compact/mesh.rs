//! A mesh in pages.

use super::pack::pack;
use super::page::{Page, SLACK};
use super::write::PageBytes;
use crate::Pages;
use crate::wide::{ChildRef, MeshBvh, Node8};
use vastlight_math::Aabb;

/// Memory of pages comes in cache lines.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(64))]
struct Line([u8; LINE]);

const LINE: usize = 64;

/// A subtree of a page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PageRoot {
    /// Number of the page.
    pub(super) page: u32,
    /// Place of the root's node in the page.
    pub(super) place: u16,
}

/// A mesh in the compact layout, in its own space times [`CompactMesh::scale`].
#[derive(Clone, Debug)]
pub struct CompactMesh {
    /// The tree above the pages; its leaves are indices of `roots`.
    pub nodes: Vec<Node8>,
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
    roots: Vec<PageRoot>,
    /// First line of each page, and of what follows the last.
    starts: Vec<u32>,
    lines: Pages<Line>,
    shares: PageBytes,
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
    /// Bytes of a page, unless chosen otherwise.
    pub const SLOT: usize = 1 << 16;

    /// Packs a mesh into pages of at most `slot` bytes, with all threads of the current pool.
    ///
    /// # Errors
    /// [`CompactError::Lattice`] for a mesh whose positions are on no lattice of 24 bits, [`CompactError::Slot`] for
    /// pages smaller than about 400 bytes.
    pub fn new(mesh: &MeshBvh, slot: usize) -> Result<Self, CompactError> {
        let (packed, root) = pack(mesh, slot)?;
        let mut starts = vec![0];
        for page in &packed.pages {
            starts.push(starts[starts.len() - 1] + page.len().div_ceil(LINE) as u32);
        }
        let used = starts[starts.len() - 1] as usize;
        let slack = if used == 0 { 0 } else { SLACK / LINE };
        let mut lines: Pages<Line> = Pages::zeroed(used + slack);
        for (page, &start) in packed.pages.iter().zip(&starts) {
            bytemuck::cast_slice_mut(&mut lines[start as usize..])[..page.len()].copy_from_slice(page);
        }
        Ok(Self {
            nodes: packed.nodes,
            root,
            levels: mesh.levels,
            bounds: mesh.bounds,
            extent: mesh.extent,
            scale: mesh.scale,
            roots: packed.roots,
            starts,
            lines,
            shares: packed.shares,
        })
    }

    /// The page of a leaf of the tree above the pages, and the node of the page where it goes on.
    #[inline(always)]
    #[must_use]
    pub fn enter(&self, leaf: usize) -> Option<(Page<'_>, ChildRef)> {
        let PageRoot { page, place } = *self.roots.get(leaf)?;
        let start = *self.starts.get(page as usize)?;
        let page = Page::new(bytemuck::cast_slice(self.lines.get(start as usize..)?));
        Some((page, ChildRef::node(u32::from(place))))
    }

    /// The bytes of a page.
    #[must_use]
    pub fn page_bytes(&self, page: usize) -> Option<&[u8]> {
        let lines = *self.starts.get(page)? as usize..*self.starts.get(page + 1)? as usize;
        self.lines.get(lines).map(bytemuck::cast_slice)
    }

    /// Number of pages.
    #[must_use]
    pub fn pages(&self) -> usize {
        self.starts.len() - 1
    }

    /// The subtrees in pages, by the leaves of the tree above.
    #[must_use]
    pub fn roots(&self) -> &[PageRoot] {
        &self.roots
    }

    /// Memory of everything.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let above =
            size_of_val(&self.nodes[..]) + size_of_val(&self.roots[..]) + size_of_val(&self.starts[..]);
        above + size_of_val(&self.lines[..])
    }

    /// What the pages' bytes are.
    #[must_use]
    pub fn shares(&self) -> PageBytes {
        self.shares
    }
}
