//! Pages of a scene for a device: geometry, tiles of textures, attributes of triangles; from memory, or from a store.
//!
//! Pages of all kinds are numbered through, kind by kind. Geometry are the pages of the tracer. Attributes are packed as in a
//! store ([`PackedAttributes`]): by blocks of triangles, which are the pages of geometry first. What light and hits depend on is kept:
//! textures of emission and alpha, and the attributes of meshes that shine by textures, which are found by the number of a triangle;
//! their blocks are [`BLOCK`] triangles in their own order. So are those of all meshes where there is no geometry in pages,
//! with positions in front of the other attributes.

use super::Words;
use super::tiled::{Tiled, TiledTexture};
use crate::pages::{PagedGeometry, PagesError};
use crate::renderer::Renderer;
use rayon::prelude::*;
use vastlight_accel::compact::Page;
use vastlight_paging::{Directory, PageCache, Table};
use vastlight_scene::{Mesh, Scene};
use vastlight_store::{ATTRIBUTE_SLOT, AttributeIndex, AttributeLayout, PackedAttributes};
use vastlight_trace::Tracer;
use vastlight_trace::paged::{CachePager, Caches, Pager};

/// Which kind pages of geometry are.
pub const GEOMETRY: usize = 0;
/// Which kind tiles of textures are.
pub const TILES: usize = 1;
/// Which kind pages of attributes are.
pub const ATTRIBUTES: usize = 2;
/// Which kind pages are that stay on the device.
pub const KEPT: usize = 3;
/// How many kinds there are.
pub const KINDS: usize = 4;

/// Triangles of a block of a mesh's triangles in their own order.
pub const BLOCK: usize = 4096;

/// Pages of a kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PageKind {
    /// Number of the first.
    pub first: u32,
    /// How many there are.
    pub pages: u32,
    /// Bytes of the longest, in whole words.
    pub slot_bytes: u32,
    /// How many one path may need at once.
    pub least: u32,
}

impl PageKind {
    fn new(pages: u32, slot_bytes: u32, least: u32) -> Self {
        Self { first: 0, pages, slot_bytes: slot_bytes.next_multiple_of(4), least: least.min(pages) }
    }
}

/// Where pages of a kind come from.
#[derive(Debug)]
enum Origin<'a> {
    Nowhere,
    Table(&'a Table),
    Made(Vec<Vec<u8>>),
    Tiles(Vec<Tiled<'a>>),
    Store,
}

/// The pages of a scene.
#[derive(Debug)]
pub struct ScenePages<'a> {
    kinds: [PageKind; KINDS],
    origins: [Origin<'a>; KINDS],
    pager: Option<CachePager>,
}

/// Pages of attributes, and where those of a triangle are.
#[derive(Debug, Default)]
pub(super) struct Attributes {
    /// By block, and one more: its first page.
    firsts: Vec<u32>,
    /// By page: the place of its first triangle in its block.
    starts: Vec<u32>,
    /// Those that are not in a store.
    pages: Vec<Vec<u8>>,
    /// How many of `starts` belong to pages of geometry.
    of_geometry: u32,
    /// By mesh: what its records have.
    pub(super) layouts: Vec<AttributeLayout>,
    /// By mesh: the first block of its triangles in their own order, `u32::MAX` for none.
    pub(super) first_blocks: Vec<u32>,
}

impl Attributes {
    fn new(scene: &Scene, tracer: &Tracer, pages: Option<&PagedGeometry<'_>>) -> Self {
        let threaded = tracer.has_kd_trees();
        let mut all = Self { firsts: vec![0], ..Self::default() };
        let own = |mesh: &Mesh| {
            let layout = AttributeLayout::of(mesh);
            if threaded { layout.with_positions() } else { layout }
        };
        all.layouts = match pages {
            Some(pages) => pages.layouts.to_vec(),
            None => scene.meshes().iter().map(own).collect(),
        };
        match pages {
            Some(pages) => all.add_stored(pages.index),
            None if threaded => {}
            None => all.add_geometry(scene, tracer),
        }
        all.of_geometry = all.starts.len() as u32;
        for (number, mesh) in scene.meshes().iter().enumerate() {
            let used = !scene.instances().of_mesh(number as u32).is_empty();
            let wanted = used && (threaded || shines_by_textures(scene, mesh));
            all.first_blocks.push(if wanted { all.firsts.len() as u32 - 1 } else { u32::MAX });
            if wanted {
                all.add_blocks(mesh, all.layouts[number]);
            }
        }
        all
    }

    /// How many pages are not those of pages of geometry.
    pub(super) fn kept_pages(&self) -> u32 {
        self.starts.len() as u32 - self.of_geometry
    }

    fn add_stored(&mut self, index: &AttributeIndex) {
        self.firsts = index.firsts().to_vec();
        self.starts = index.first_triangles().iter().map(|&start| start.into()).collect();
    }

    fn add_geometry(&mut self, scene: &Scene, tracer: &Tracer) {
        let (table, meshes) = (tracer.pages(), tracer.page_meshes());
        let pack = |(page, &mesh): (usize, &u32)| {
            let triangles = table.page(page as u32).map(|bytes| Page::new(bytes).triangles());
            PackedAttributes::new(&scene.meshes()[mesh as usize], &triangles.unwrap_or_default())
        };
        let packed: Vec<PackedAttributes> =
            meshes.par_iter().enumerate().map(|(i, m)| pack((i, m))).collect();
        packed.into_iter().for_each(|packed| self.add(packed));
    }

    fn add_blocks(&mut self, mesh: &Mesh, layout: AttributeLayout) {
        let all: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
        let pack = |block: &[u32]| PackedAttributes::of_layout(mesh, layout, block);
        let blocks: Vec<PackedAttributes> = all.par_chunks(BLOCK).map(pack).collect();
        blocks.into_iter().for_each(|packed| self.add(packed));
    }

    fn add(&mut self, packed: PackedAttributes) {
        self.starts.extend(packed.first_triangles.iter().map(|&start| u32::from(start)));
        self.pages.extend(packed.pages);
        self.firsts.push(self.starts.len() as u32);
    }

    /// Appends the first page of each block, then the first triangle of each page; gives where both begin.
    pub(super) fn put(&self, tables: &mut Words, first_page: u32) -> [u32; 2] {
        let firsts = tables.offset();
        self.firsts.iter().for_each(|first| tables.u32(first + first_page));
        let starts = tables.offset();
        tables.u32s(&self.starts);
        [firsts, starts]
    }
}

/// Whether some triangles of a mesh emit light by a texture, or with holes.
fn shines_by_textures(scene: &Scene, mesh: &Mesh) -> bool {
    let shines = |material: u32| {
        let material = scene.materials().get(material as usize);
        material.is_some_and(|m| m.is_emissive() && (m.emission.texture.is_some() || m.has_alpha()))
    };
    !mesh.triangles.is_empty()
        && if mesh.parts.is_empty() { shines(0) } else { mesh.parts.iter().any(|part| shines(part.material)) }
}

impl<'a> ScenePages<'a> {
    /// The pages of geometry of a tracer in memory, alone.
    #[must_use]
    pub fn of_tracer(tracer: &'a Tracer) -> Self {
        let mut pages = Self::empty();
        pages.add(GEOMETRY, Origin::Table(tracer.pages()), geometry_kind(tracer.pages()));
        pages
    }

    /// All pages of a renderer's scene; gives also what the tables need to know of attributes and, by texture, of tiles.
    pub(super) fn new(
        renderer: &'a Renderer<'_>,
    ) -> Result<(Self, Attributes, Vec<TiledTexture>), PagesError> {
        let stored = renderer.pages.as_ref();
        let mut attributes = Attributes::new(renderer.scene, renderer.tracer(), stored);
        let (mut tiles, mut kept_tiles) = (Vec::new(), Vec::new());
        let (_, textures) = renderer.materials.parts();
        let lists = [&mut tiles, &mut kept_tiles];
        let textures = super::tiled::all(renderer.scene, textures, stored.is_some(), lists);
        let mut pages = Self::empty();
        let made = std::mem::take(&mut attributes.pages);
        let least_tiles = renderer.materials.most_tiles_of_all() as u32;
        let kept = match stored {
            Some(stored) => {
                pages.add_stored(stored, least_tiles)?;
                made
            }
            None => {
                let of_geometry = attributes.of_geometry as usize;
                pages.add_in_memory(renderer.tracer(), (tiles, least_tiles), made, of_geometry)
            }
        };
        let bytes = kept_tiles.iter().map(Tiled::slot_bytes).max().unwrap_or(0).max(ATTRIBUTE_SLOT as u32);
        let kept: Vec<Vec<u8>> = kept.into_iter().chain(kept_tiles.iter().flat_map(Tiled::all)).collect();
        let count = kept.len() as u32;
        pages.add(KEPT, Origin::Made(kept), PageKind::new(count, bytes, count));
        Ok((pages, attributes, textures))
    }

    /// Takes the pages of a store.
    fn add_stored(&mut self, stored: &PagedGeometry<'_>, least_tiles: u32) -> Result<(), PagesError> {
        let Caches { geometry, attributes, tiles } = stored.caches;
        let kind = |cache: &PageCache, least| {
            let directory = cache.directory();
            PageKind::new(directory.pages() as u32, slot(directory), least)
        };
        self.pager = Some(stored.caches.pager()?);
        self.add(GEOMETRY, Origin::Store, kind(geometry, 1));
        self.add(ATTRIBUTES, Origin::Store, kind(attributes, 1));
        if let Some(tiles) = tiles {
            self.add(TILES, Origin::Store, kind(tiles, least_tiles));
        }
        Ok(())
    }

    /// Takes the pages of a scene in memory, the first of `made` as attributes of its geometry; gives the others.
    fn add_in_memory(
        &mut self,
        tracer: &'a Tracer,
        (tiles, least_tiles): (Vec<Tiled<'a>>, u32),
        mut made: Vec<Vec<u8>>,
        of_geometry: usize,
    ) -> Vec<Vec<u8>> {
        self.add(GEOMETRY, Origin::Table(tracer.pages()), geometry_kind(tracer.pages()));
        let count = tiles.iter().map(Tiled::pages).sum();
        let bytes = tiles.iter().map(Tiled::slot_bytes).max().unwrap_or(0);
        self.add(TILES, Origin::Tiles(tiles), PageKind::new(count, bytes, least_tiles));
        let others = made.split_off(of_geometry);
        self.add(ATTRIBUTES, Origin::Made(made), PageKind::new(of_geometry as u32, ATTRIBUTE_SLOT as u32, 1));
        others
    }

    fn empty() -> Self {
        Self { kinds: [PageKind::default(); KINDS], origins: [const { Origin::Nowhere }; KINDS], pager: None }
    }

    fn add(&mut self, kind: usize, origin: Origin<'a>, pages: PageKind) {
        self.origins[kind] = origin;
        self.kinds[kind] = pages;
        let mut first = 0;
        for kind in &mut self.kinds {
            kind.first = first;
            first += kind.pages;
        }
    }

    /// Lets go of what it holds; for when all pages have been read.
    pub fn finish(&mut self) {
        self.origins = [const { Origin::Nowhere }; KINDS];
        self.pager = None;
    }

    /// The kinds of pages.
    #[must_use]
    pub fn kinds(&self) -> &[PageKind; KINDS] {
        &self.kinds
    }

    /// Gives the bytes of each of `pages`, in any order.
    ///
    /// # Errors
    /// A page cannot be had from its store.
    pub fn read(&mut self, pages: &[u32], put: &mut impl FnMut(u32, &[u8])) -> Result<(), PagesError> {
        let mut stored: [Vec<u32>; KINDS] = Default::default();
        for &page in pages {
            let Some(kind) = self.kinds.iter().rposition(|kind| kind.first <= page && kind.pages > 0) else {
                continue;
            };
            let number = page - self.kinds[kind].first;
            match &self.origins[kind] {
                Origin::Nowhere => {}
                Origin::Table(table) => put(page, table.page(number).unwrap_or_default()),
                Origin::Made(made) => put(page, made.get(number as usize).map_or(&[], Vec::as_slice)),
                Origin::Tiles(tiled) => {
                    let after = tiled.partition_point(|tiled| tiled.first_page() <= number);
                    if let Some(tiled) = after.checked_sub(1).and_then(|at| tiled.get(at)) {
                        put(page, &tiled.page(number));
                    }
                }
                Origin::Store => stored[kind].push(number),
            }
        }
        self.read_stored(stored, put)
    }

    fn read_stored(
        &mut self,
        mut wanted: [Vec<u32>; KINDS],
        put: &mut impl FnMut(u32, &[u8]),
    ) -> Result<(), PagesError> {
        let Some(pager) = &mut self.pager else { return Ok(()) };
        // A fetch brings at least the first of each kind.
        while wanted.iter().any(|pages| !pages.is_empty()) {
            let [geometry, tiles, attributes, _] = &wanted;
            pager.fetch(geometry, attributes)?;
            if !tiles.is_empty() {
                pager.fetch_tiles(&tiles[..tiles.len().min(MOST_TILES)])?;
            }
            let tables = [pager.geometry(), pager.tiles(), pager.attributes(), Table::default()];
            for ((pages, table), kind) in wanted.iter_mut().zip(&tables).zip(&self.kinds) {
                pages.retain(|&number| match table.page(number) {
                    Some(bytes) => {
                        // Memory of a cache goes on behind a page.
                        let length = bytes.len().min(kind.slot_bytes as usize);
                        put(number + kind.first, &bytes[..length]);
                        false
                    }
                    None => true,
                });
            }
        }
        pager.rest();
        Ok(())
    }
}

/// Tiles that are asked for at once.
const MOST_TILES: usize = 64;

fn geometry_kind(table: &Table) -> PageKind {
    let pages = table.pages() as u32;
    let longest = (0..pages).filter_map(|page| table.page(page)).map(<[u8]>::len).max().unwrap_or(0);
    PageKind::new(pages, longest as u32, 1)
}

/// Bytes of the longest page.
fn slot(directory: &Directory) -> u32 {
    directory.longest().map_or(0, |(_, entry)| entry.bytes)
}
