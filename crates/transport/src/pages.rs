//! Scenes whose meshes come page by page: hits, and what their triangles' corners have.

use crate::cone::Cone;
use crate::corners::{HitCorners, PageCorners};
use crate::material::{Evaluated, MaterialTable, ShadingPoint};
use crate::surface::{attributes, mesh_of};
use crate::texture::TileAccess;
use crate::wavefront::Context;
use std::collections::HashSet;
use std::time::{Duration, Instant};
use vastlight_math::Ray;
use vastlight_paging::{CacheError, PageError, Table};
use vastlight_store::{AttributeIndex, AttributeLayout, MOST_FLOATS, read_corners};
use vastlight_trace::Hit;
use vastlight_trace::paged::{CachePager, Caches, Found, PagedBatch, PagedFilter, Pager};

/// Where the meshes of a scene are, if not in memory.
#[derive(Clone, Copy, Debug)]
pub struct PagedGeometry<'a> {
    /// The pages.
    pub caches: &'a Caches,
    /// Where the attributes of a triangle are.
    pub index: &'a AttributeIndex,
    /// Which attributes the vertices of each mesh have.
    pub layouts: &'a [AttributeLayout],
    /// Paths that go through the pages together: more share what is fetched for one of them.
    pub wave_paths: u64,
}

impl PagedGeometry<'_> {
    /// Most floats of the attributes of a triangle.
    fn floats_of_hit(&self) -> usize {
        3 * self.layouts.iter().map(|layout| layout.floats()).max().unwrap_or(0)
    }
}

/// Why a scene in pages cannot be rendered.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PagesError {
    /// A page cannot be had.
    #[error(transparent)]
    Page(#[from] PageError),
    /// The caches serve no more batches.
    #[error(transparent)]
    Cache(#[from] CacheError),
    /// A batch cannot keep the tiles that the evaluation of one material needs.
    #[error(
        "{quota} tiles of textures for each batch, and a material needs {needed} (give more memory, or trace with fewer batches)"
    )]
    FewTiles {
        /// What a batch gets.
        quota: usize,
        /// What it needs.
        needed: usize,
    },
}

impl Context<'_> {
    /// The corners of a triangle that was found, with the attributes of one in a page in `records`; an error with the page of
    /// attributes that is not in memory.
    pub(crate) fn corners<'r>(
        &self,
        hit: &Hit,
        found: &Found,
        attributes: &Table,
        records: &'r mut [f32; MOST_FLOATS],
    ) -> Result<HitCorners<'r>, u32>
    where
        Self: 'r,
    {
        if found.page == Hit::NONE {
            return Ok(HitCorners::new(None, mesh_of(self.scene, hit), hit));
        }
        let layout = self.layout_of(hit);
        if let Some((page, number)) = self.attributes_at(layout, found) {
            let bytes = attributes.page(page).ok_or(page)?;
            read_corners(bytes, layout, number, records);
        }
        Ok(HitCorners::Page(PageCorners { points: found.corners, layout, records }))
    }

    /// Which attributes the mesh has that was hit.
    fn layout_of(&self, hit: &Hit) -> AttributeLayout {
        let mesh = if hit.is_hit() { self.scene.instances().mesh(hit.instance as usize) as usize } else { 0 };
        self.pages.and_then(|pages| pages.layouts.get(mesh)).copied().unwrap_or_default()
    }

    /// The page with the attributes of a triangle, and its number there.
    fn attributes_at(&self, layout: AttributeLayout, found: &Found) -> Option<(u32, usize)> {
        if layout.floats() == 0 { None } else { self.pages?.index.find(found.page, found.place) }
    }
}

/// What is known of a triangle that was hit in a scene of pages.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PageHit<'a> {
    /// None where the triangle is in no page.
    pub(crate) corners: Option<PageCorners<'a>>,
    /// The material there, where its textures are in tiles.
    pub(crate) evaluated: Option<&'a Evaluated>,
}

/// What is known of the hits of a stage, by ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PageHits<'a> {
    found: &'a [Found],
    gathered: &'a Gathered,
    /// Empty where no texture is in tiles.
    evaluated: &'a [Option<Evaluated>],
}

impl<'a> PageHits<'a> {
    #[inline]
    pub(crate) fn at(&self, ray: usize) -> PageHit<'a> {
        let evaluated = self.evaluated.get(ray).and_then(Option::as_ref);
        PageHit { corners: self.gathered.at(ray, &self.found[ray]), evaluated }
    }
}

/// The attributes of what rays hit.
#[derive(Debug, Default)]
struct Gathered {
    /// By ray.
    layouts: Vec<AttributeLayout>,
    /// So many for each ray: three records of its layout, then nothing.
    records: Vec<f32>,
    each: usize,
}

impl Gathered {
    /// Nothing yet, for hits of these layouts.
    fn clear(&mut self, layouts: impl Iterator<Item = AttributeLayout>) {
        self.layouts.clear();
        self.layouts.extend(layouts);
        self.records.clear();
        self.records.resize(self.layouts.len() * self.each, 0.0);
    }

    #[inline]
    fn at(&self, ray: usize, found: &Found) -> Option<PageCorners<'_>> {
        let records = &self.records[ray * self.each..(ray + 1) * self.each];
        let corners = PageCorners { points: found.corners, layout: self.layouts[ray], records };
        (found.page != Hit::NONE).then_some(corners)
    }

    /// The layout of a ray's hit, and room for its records.
    fn room(&mut self, ray: usize) -> (AttributeLayout, &mut [f32]) {
        (self.layouts[ray], &mut self.records[ray * self.each..(ray + 1) * self.each])
    }
}

/// Traces the rays of a wave through pages.
#[derive(Debug)]
pub(crate) struct PageWalk {
    pager: CachePager,
    /// The most tiles that the pager brings at once; at least what any one material needs.
    tile_quota: usize,
    batch: PagedBatch,
    found: Vec<Found>,
    gathered: Gathered,
    /// Rays whose attributes are not in memory, and pages of these.
    waiting: Vec<u32>,
    wanted: Vec<u32>,
    /// Materials by ray, where some are in tiles.
    evaluated: Vec<Option<Evaluated>>,
    tile_time: Duration,
}

impl PageWalk {
    /// A walk through `caches`.
    ///
    /// # Errors
    /// If the caches serve no more batches, or there is no room for the tiles that a material needs.
    pub(crate) fn new(pages: &PagedGeometry<'_>, materials: &MaterialTable<'_>) -> Result<Self, PagesError> {
        let caches = pages.caches;
        let needed = materials.most_tiles();
        let tile_quota = caches.tiles.as_ref().map_or(0, |tiles| tiles.config().quota());
        if tile_quota < needed {
            return Err(PagesError::FewTiles { quota: tile_quota, needed });
        }
        Ok(Self {
            pager: caches.pager()?,
            tile_quota,
            evaluated: Vec::new(),
            tile_time: Duration::ZERO,
            batch: PagedBatch::default(),
            found: Vec::new(),
            gathered: Gathered { each: pages.floats_of_hit(), ..Gathered::default() },
            waiting: Vec::new(),
            wanted: Vec::new(),
        })
    }

    /// The time that lookups in tiles took since the last call.
    pub(crate) fn take_tile_time(&mut self) -> Duration {
        std::mem::take(&mut self.tile_time)
    }

    /// What is known of the hits of the last call of [`PageWalk::closest`].
    pub(crate) fn hits(&self) -> PageHits<'_> {
        PageHits { found: &self.found, gathered: &self.gathered, evaluated: &self.evaluated }
    }

    /// The closest hits, the corners of the triangles that were hit, and their materials.
    pub(crate) fn closest(
        &mut self,
        context: &Context<'_>,
        (rays, cone_of): (&[Ray], impl Fn(usize) -> Cone),
        filter: Option<&dyn PagedFilter>,
        hits: &mut [Hit],
    ) -> Result<(), PageError> {
        let Self { pager, batch, found, .. } = self;
        found.clear();
        batch.closest(context.tracer, pager, rays, filter, |i, hit, place| {
            hits[i] = *hit;
            found.push(*place);
        })?;
        self.gather(context, hits)?;
        let start = Instant::now();
        let gathered = self.gather_materials(context, (rays, cone_of), hits);
        self.tile_time += start.elapsed();
        gathered
    }

    /// Whether rays are blocked.
    pub(crate) fn occluded(
        &mut self,
        context: &Context<'_>,
        rays: &[Ray],
        filter: Option<&dyn PagedFilter>,
        blocked: &mut [bool],
    ) -> Result<(), PageError> {
        self.batch.occluded(context.tracer, &mut self.pager, rays, filter, blocked)
    }

    /// Finds the corners of all triangles that were hit, page by page.
    fn gather(&mut self, context: &Context<'_>, hits: &[Hit]) -> Result<(), PageError> {
        self.gathered.clear(hits.iter().map(|hit| context.layout_of(hit)));
        self.waiting.clear();
        self.waiting.extend((0..hits.len() as u32).filter(|&i| hits[i as usize].is_hit()));
        self.wanted.clear();
        loop {
            self.pager.fetch_attributes(&self.wanted)?;
            self.gather_present(context);
            if self.waiting.is_empty() {
                // Whoever shades needs no pages, and holds none.
                self.pager.rest();
                return Ok(());
            }
        }
    }

    /// Copies what is in memory, and collects the pages that are not.
    fn gather_present(&mut self, context: &Context<'_>) {
        let Self { pager, found, gathered, waiting, wanted, .. } = self;
        wanted.clear();
        let table = pager.attributes();
        waiting.retain(|&i| {
            let (layout, records) = gathered.room(i as usize);
            let Some((page, number)) = context.attributes_at(layout, &found[i as usize]) else {
                return false;
            };
            let Some(bytes) = table.page(page) else {
                wanted.push(page);
                return true;
            };
            pager.uses_attributes(page);
            read_corners(bytes, layout, number, records);
            false
        });
        // The first that waits gets on, so that waiting ends.
        let first = wanted.first().copied();
        wanted.sort_unstable();
        wanted.dedup();
        if let Some(at) = first.and_then(|first| wanted.binary_search(&first).ok()) {
            wanted.swap(0, at);
        }
    }

    /// Evaluates the materials whose textures are in tiles, as far as tiles are in memory, fetches what is missing, and again.
    ///
    /// It ends: the first hit that waits asks for all of its tiles before any other, a fetch brings them since the quota is enough for
    /// any one material, and keeps them until the next; so with every fetch at least that hit is done.
    fn gather_materials(
        &mut self,
        context: &Context<'_>,
        (rays, cone_of): (&[Ray], impl Fn(usize) -> Cone),
        hits: &[Hit],
    ) -> Result<(), PageError> {
        self.evaluated.clear();
        let materials = context.materials;
        if materials.most_tiles() == 0 {
            return Ok(());
        }
        self.evaluated.resize(hits.len(), None);
        let material_of = |hit: &Hit| mesh_of(context.scene, hit).material_of(hit.prim);
        let in_tiles =
            |&i: &u32| hits[i as usize].is_hit() && materials.is_in_tiles(material_of(&hits[i as usize]));
        self.waiting.clear();
        self.waiting.extend((0..hits.len() as u32).filter(in_tiles));
        let evaluate = |i: usize, page: Option<PageCorners<'_>>, access: &mut TileAccess<'_>| {
            let (hit, ray) = (&hits[i], &rays[i]);
            let corners = &HitCorners::new(page, mesh_of(context.scene, hit), hit);
            let material = material_of(hit);
            let uv_sets = materials.uv_sets(material);
            let map = context.scene.instances().map(hit.instance as usize);
            let areas = cone_of(i).areas((ray, hit.t), map, corners, uv_sets);
            let point = ShadingPoint { areas, ..attributes(corners, hit, uv_sets) };
            materials.evaluate_through(access, material, &point)
        };
        self.wanted.clear();
        loop {
            self.pager.fetch_tiles(&self.wanted)?;
            self.evaluate_present(&evaluate);
            if self.waiting.is_empty() {
                self.pager.rest();
                return Ok(());
            }
        }
    }

    /// Evaluates what it can, and collects the tiles that are not in memory, no more than a fetch brings.
    fn evaluate_present(
        &mut self,
        evaluate: &impl Fn(usize, Option<PageCorners<'_>>, &mut TileAccess<'_>) -> Evaluated,
    ) {
        let Self { pager, found, gathered, waiting, wanted, evaluated, tile_quota, .. } = self;
        wanted.clear();
        let (table, mut touched, mut asked) = (pager.tiles(), Vec::new(), HashSet::new());
        waiting.retain(|&i| {
            let i = i as usize;
            if wanted.len() >= *tile_quota {
                return true;
            }
            let mut access = TileAccess::new(&table, &mut touched);
            let result = evaluate(i, gathered.at(i, &found[i]), &mut access);
            if access.is_missing() {
                // Of the first all, so that they stay; of others what is missing.
                let first = wanted.is_empty();
                let wants = |tile: &u32| (first || table.page(*tile).is_none()) && asked.insert(*tile);
                wanted.extend(touched.iter().copied().filter(wants));
                return true;
            }
            touched.iter().for_each(|&tile| pager.uses_tile(tile));
            evaluated[i] = Some(result);
            false
        });
    }
}
