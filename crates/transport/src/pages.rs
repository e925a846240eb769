//! Scenes whose meshes come page by page: hits, and what their triangles' corners have.

use crate::corners::PageCorners;
use crate::wavefront::Context;
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

/// Why a scene in pages cannot be rendered.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PagesError {
    /// A page cannot be had.
    #[error(transparent)]
    Page(#[from] PageError),
    /// The caches serve no more batches.
    #[error(transparent)]
    Cache(#[from] CacheError),
}

impl Context<'_> {
    /// The corners of a triangle that was found in a page; an error with the page of attributes that is not in memory.
    pub(crate) fn corners(&self, hit: &Hit, found: &Found, attributes: &Table) -> Result<PageCorners, u32> {
        let mut corners = self.bare_corners(hit, found);
        if let Some((page, number)) = self.attributes_at(&corners, found) {
            let bytes = attributes.page(page).ok_or(page)?;
            read_corners(bytes, corners.layout, number, &mut corners.records);
        }
        Ok(corners)
    }

    /// The same without attributes.
    fn bare_corners(&self, hit: &Hit, found: &Found) -> PageCorners {
        let mesh = self.scene.instances().get(hit.instance as usize).map_or(0, |i| i.mesh as usize);
        let layout = self.pages.and_then(|pages| pages.layouts.get(mesh)).copied().unwrap_or_default();
        PageCorners { points: found.corners, layout, records: [0.0; MOST_FLOATS] }
    }

    /// The page with the attributes of a triangle, and its number there.
    fn attributes_at(&self, corners: &PageCorners, found: &Found) -> Option<(u32, usize)> {
        if corners.layout.floats() == 0 { None } else { self.pages?.index.find(found.page, found.place) }
    }
}

/// Traces the rays of a wave through pages.
#[derive(Debug)]
pub(crate) struct PageWalk {
    pager: CachePager,
    batch: PagedBatch,
    found: Vec<Found>,
    /// By ray.
    corners: Vec<PageCorners>,
    /// Rays whose attributes are not in memory, and pages of these.
    waiting: Vec<u32>,
    wanted: Vec<u32>,
}

impl PageWalk {
    pub(crate) fn new(pager: CachePager) -> Self {
        Self {
            pager,
            batch: PagedBatch::default(),
            found: Vec::new(),
            corners: Vec::new(),
            waiting: Vec::new(),
            wanted: Vec::new(),
        }
    }

    /// By ray of the last call of [`PageWalk::closest`].
    pub(crate) fn corners(&self) -> &[PageCorners] {
        &self.corners
    }

    /// The closest hits, and the corners of the triangles that were hit.
    pub(crate) fn closest(
        &mut self,
        context: &Context<'_>,
        rays: &[Ray],
        filter: Option<&dyn PagedFilter>,
        hits: &mut [Hit],
    ) -> Result<(), PageError> {
        let Self { pager, batch, found, .. } = self;
        found.clear();
        batch.closest(context.tracer, pager, rays, filter, |i, hit, place| {
            hits[i] = *hit;
            found.push(*place);
        })?;
        self.gather(context, hits)
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
        self.corners.clear();
        self.corners
            .extend(hits.iter().zip(&self.found).map(|(hit, found)| context.bare_corners(hit, found)));
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
        let Self { pager, found, corners, waiting, wanted, .. } = self;
        wanted.clear();
        let table = pager.attributes();
        waiting.retain(|&i| {
            let (found, corners) = (&found[i as usize], &mut corners[i as usize]);
            let Some((page, number)) = context.attributes_at(corners, found) else { return false };
            let Some(bytes) = table.page(page) else {
                wanted.push(page);
                return true;
            };
            pager.uses_attributes(page);
            read_corners(bytes, corners.layout, number, &mut corners.records);
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
}
