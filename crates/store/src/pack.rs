//! A mesh as a store holds it: pages of geometry, pages of attributes, and what is above them.

use crate::attributes::{AttributeLayout, PackedAttributes};
use crate::error::StoreError;
use crate::partition::Bucket;
use crate::tiles::TILE_BYTES;
use rayon::prelude::*;
use vastlight_accel::compact::{BlockSizes, CompactMesh, PackedPage};
use vastlight_accel::wide::{MeshBvh, MeshView};
use vastlight_accel::{BuildConfig, Scratch};
use vastlight_scene::{Mesh, MeshExtent};

/// What a page is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PageStrategy {
    /// Subtrees of one good tree over the mesh.
    #[default]
    Treelets,
    /// Blocks of triangles in Morton order, each with a tree of its own, as published.
    Blocks,
}

impl PageStrategy {
    /// Names of all, the default first.
    pub const NAMES: [&'static str; 2] = ["treelets", "blocks"];

    /// The strategy of this name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        [Self::Treelets, Self::Blocks].into_iter().find(|strategy| strategy.name() == name)
    }

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }
}

/// How meshes become pages.
#[derive(Clone, Debug)]
pub struct PackConfig {
    /// Name of the builder of trees; empty for the default.
    pub accel: String,
    /// What a page is.
    pub strategy: PageStrategy,
    /// Most bytes of a page of geometry; blocks take what they need.
    pub page_bytes: usize,
    /// Most references to triangles, as a multiple of the triangles; none for what the builder thinks best. More make rays
    /// faster among long thin triangles, and the store larger.
    pub split_budget: Option<f32>,
    /// Most bytes of a tile of a texture.
    pub tile_bytes: usize,
}

impl Default for PackConfig {
    fn default() -> Self {
        Self {
            accel: String::new(),
            strategy: PageStrategy::default(),
            page_bytes: CompactMesh::SLOT,
            split_budget: Some(1.0),
            tile_bytes: TILE_BYTES,
        }
    }
}

/// A mesh in pages, which are numbered from 0.
#[derive(Clone, Debug)]
pub struct PackedMesh {
    /// What is above the pages.
    pub above: CompactMesh,
    /// Bytes of each page of geometry.
    pub pages: Vec<Vec<u8>>,
    /// By page of geometry.
    pub attributes: Vec<PackedAttributes>,
    /// Which attributes vertices have.
    pub layout: AttributeLayout,
    /// What a page is.
    pub strategy: PageStrategy,
    /// Size of the mesh.
    pub extent: MeshExtent,
}

impl PackedMesh {
    /// Builds a tree over a mesh that is on its lattice (see `vastlight_scene::MeshPreparation`) and packs it, with all
    /// threads of the current pool.
    ///
    /// # Errors
    /// If the tree cannot be built or packed.
    pub fn new(mesh: &Mesh, config: &PackConfig, scratch: &mut Scratch) -> Result<Self, StoreError> {
        Self::build(mesh, None, config, scratch)
    }

    /// The same for a bucket of a larger mesh, whose triangles keep the numbers that they have there.
    ///
    /// # Errors
    /// If the tree cannot be built or packed; blocks need the whole mesh.
    pub fn part(bucket: &Bucket, config: &PackConfig, scratch: &mut Scratch) -> Result<Self, StoreError> {
        Self::build(&bucket.mesh, Some(&bucket.numbers), config, scratch)
    }

    fn build(
        mesh: &Mesh,
        numbers: Option<&[u32]>,
        config: &PackConfig,
        scratch: &mut Scratch,
    ) -> Result<Self, StoreError> {
        let view = MeshView { positions: &mesh.positions, triangles: &mesh.triangles };
        let build = BuildConfig { split_budget: config.split_budget, ..BuildConfig::default() };
        let failed = |error: String| StoreError::pack(&mesh.name, error);
        let (above, pages) = match (config.strategy, numbers) {
            (PageStrategy::Treelets, numbers) => {
                let wide = MeshBvh::build(&config.accel, &view, &build, scratch);
                let (mut wide, _) = wide.map_err(|e| failed(e.to_string()))?;
                wide.renumber(numbers.unwrap_or_default());
                CompactMesh::pack(&wide, config.page_bytes).map_err(|e| failed(e.to_string()))?
            }
            (PageStrategy::Blocks, None) => {
                let packed = CompactMesh::pack_blocks(&config.accel, &view, BlockSizes::default(), &build);
                packed.map_err(|e| failed(e.to_string()))?
            }
            (PageStrategy::Blocks, Some(_)) => {
                return Err(failed("it is too large for blocks within this memory".into()));
            }
        };
        let own = |triangles: &[u32]| match numbers {
            None => PackedAttributes::new(mesh, triangles),
            Some(numbers) => {
                let place = |number: &u32| numbers.binary_search(number).unwrap_or(0) as u32;
                PackedAttributes::new(mesh, &triangles.iter().map(place).collect::<Vec<_>>())
            }
        };
        let attributes = pages.par_iter().map(|page| own(&page.triangles)).collect();
        let pages = pages.into_iter().map(|PackedPage { bytes, .. }| bytes).collect();
        let extent = MeshExtent { bounds: mesh.bounds(), triangles: mesh.triangles.len() as u64 };
        Ok(Self {
            above,
            pages,
            attributes,
            layout: AttributeLayout::of(mesh),
            strategy: config.strategy,
            extent,
        })
    }
}
