//! Pages as they were published: blocks of triangles that are neighbours in Morton order, each with a tree of its own.
//!
//! After K. Garanzha, thesis 2013, 6.2: a tree cuts the mesh into branches; the triangles of a branch are sorted by Morton
//! codes and cut into blocks of equal length; a block and the tree over it are a page. Deviations: triangles instead of
//! quads, so twice as many; above the blocks stands a tree instead of a grid; coordinates are on the mesh's lattice,
//! not on one of the branch's own, so that no cracks open between pages.

use super::mesh::{CompactError, CompactMesh};
use super::page::UNIT;
use super::write::{PackedPage, PageBytes};
use crate::build::sorted_codes;
use crate::sort::payload;
use crate::wide::{MeshBvh, MeshView};
use crate::{BinaryTree, BuildConfig, BuildError, Node, Reference, Scratch, build};
use rayon::prelude::*;
use vastlight_math::{Aabb, Vec3};

/// Sizes of blocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockSizes {
    /// Most triangles of a branch.
    pub branch: usize,
    /// Triangles of a block.
    pub block: usize,
}

impl Default for BlockSizes {
    /// Those of the publication: 64 Ki and 4 Ki quads.
    fn default() -> Self {
        Self { branch: 1 << 17, block: 1 << 13 }
    }
}

/// Why a mesh is not packed to blocks.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BlockError {
    /// A tree could not be built.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// A block could not be packed.
    #[error(transparent)]
    Compact(#[from] CompactError),
}

impl CompactMesh {
    /// Packs a mesh into blocks of whole triangles, with all threads of the current pool. Pages are numbered from 0.
    ///
    /// # Errors
    /// Those of [`build()`](crate::build()) and [`CompactMesh::pack`], also for blocks that need more than 256 KiB.
    pub fn pack_blocks(
        name: &str,
        mesh: &MeshView<'_>,
        sizes: BlockSizes,
        config: &BuildConfig,
    ) -> Result<(Self, Vec<PackedPage>), BlockError> {
        let vertices = Aabb::from_points(mesh.positions.iter().copied());
        let whole = Whole { name, mesh, scale: mesh.scale(&vertices), vertices, config };
        let blocks = whole.blocks(sizes)?;
        let packed =
            blocks.par_iter().map_init(Scratch::default, |scratch, block| whole.pack(block, scratch));
        whole.put_together(packed.collect::<Result<Vec<_>, _>>()?)
    }
}

/// A mesh that is cut into blocks.
struct Whole<'a> {
    name: &'a str,
    mesh: &'a MeshView<'a>,
    scale: f32,
    /// Around all vertices.
    vertices: Aabb,
    config: &'a BuildConfig,
}

impl Whole<'_> {
    fn reference(&self, triangle: u32) -> Reference {
        let corners = self.mesh.corners(triangle).map(|corner| corner * self.scale);
        Reference::new(&Aabb::from_points(corners), triangle)
    }

    /// The triangles of each block, in Morton order.
    fn blocks(&self, sizes: BlockSizes) -> Result<Vec<Vec<u32>>, BlockError> {
        let triangles = 0..self.mesh.triangles.len() as u32;
        let mut references: Vec<_> = triangles.into_par_iter().map(|i| self.reference(i)).collect();
        let tree = build(self.name, &mut references, None, self.config, &mut Scratch::default())?;
        let mut branches = Vec::new();
        collect_branches(&tree, 0, sizes.branch.max(1), &mut branches);
        let cut = |scratch: &mut Scratch, &branch: &u32| {
            let sorted = self.in_morton_order(&tree.nodes[branch as usize], &tree.prims, scratch);
            sorted.chunks(sizes.block.max(1)).map(<[u32]>::to_vec).collect::<Vec<_>>()
        };
        let cut: Vec<_> = branches.par_iter().map_init(Scratch::default, cut).collect();
        Ok(cut.into_iter().flatten().collect())
    }

    /// The triangles below a node, sorted by the codes of their boxes' centres.
    fn in_morton_order(&self, branch: &Node, prims: &[u32], scratch: &mut Scratch) -> Vec<u32> {
        let prims = &prims[branch.first as usize..][..branch.count as usize];
        let references: Vec<Reference> = prims.iter().map(|&prim| self.reference(prim)).collect();
        let sorted = sorted_codes(&references[..], self.config.level, scratch);
        sorted.iter().map(|&pair| references[payload(pair) as usize].prim()).collect()
    }

    /// A block as one page.
    fn pack(&self, block: &[u32], scratch: &mut Scratch) -> Result<(CompactMesh, PackedPage), BlockError> {
        let mut used: Vec<u32> = block.iter().flat_map(|&t| self.mesh.triangles[t as usize]).collect();
        used.sort_unstable();
        used.dedup();
        let local = |vertex: u32| used.binary_search(&vertex).unwrap_or(0) as u32;
        let triangles: Vec<[u32; 3]> =
            block.iter().map(|&t| self.mesh.triangles[t as usize].map(local)).collect();
        // The corners of the whole come along, for its extent and scale.
        let corners = [self.vertices.min, self.vertices.max];
        let positions: Vec<Vec3> =
            used.iter().map(|&v| self.mesh.positions[v as usize]).chain(corners).collect();
        let view = MeshView { positions: &positions, triangles: &triangles };
        let config = BuildConfig { split_budget: Some(1.0), ..*self.config };
        let (mut wide, _) = MeshBvh::build(self.name, &view, &config, scratch)?;
        wide.renumber(block);
        let slot = UNIT << 16;
        let (above, mut pages) = CompactMesh::pack(&wide, slot)?;
        match (pages.pop(), pages.is_empty(), above.roots.len()) {
            (Some(page), true, 1) => Ok((above, page)),
            _ => Err(CompactError::Slot { bytes: slot }.into()),
        }
    }

    /// A tree over the pages.
    fn put_together(
        &self,
        packed: Vec<(CompactMesh, PackedPage)>,
    ) -> Result<(CompactMesh, Vec<PackedPage>), BlockError> {
        let (mut parts, pages): (Vec<CompactMesh>, Vec<PackedPage>) = packed.into_iter().unzip();
        parts.iter_mut().enumerate().for_each(|(number, part)| part.renumber(number as u32));
        let empty = || CompactMesh {
            nodes: Vec::new(),
            roots: Vec::new(),
            root: None,
            levels: 0,
            bounds: Aabb::EMPTY,
            extent: crate::wide::extent(&self.vertices) * self.scale,
            scale: self.scale,
            shares: PageBytes::default(),
        };
        let whole = CompactMesh::join(self.name, &parts, self.config)?.unwrap_or_else(empty);
        Ok((whole, pages))
    }
}

/// The topmost nodes with at most so many triangles.
fn collect_branches(tree: &BinaryTree, node: u32, most: usize, branches: &mut Vec<u32>) {
    let Some(at) = tree.nodes.get(node as usize) else { return };
    if at.is_leaf() || at.count as usize <= most {
        branches.push(node);
        return;
    }
    collect_branches(tree, at.left, most, branches);
    collect_branches(tree, at.left + 1, most, branches);
}
