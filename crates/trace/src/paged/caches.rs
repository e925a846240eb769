//! Pages of geometry, of attributes, and tiles of textures in a cache each.

use super::Pager;
use vastlight_paging::{Batch, CacheError, PageCache, PageError, Table};

/// The caches over the pages of a scene.
#[derive(Debug)]
pub struct Caches {
    /// Pages of geometry.
    pub geometry: PageCache,
    /// Pages of attributes.
    pub attributes: PageCache,
    /// Tiles of textures, if there are any.
    pub tiles: Option<PageCache>,
}

impl Caches {
    /// A pager for one batch at a time.
    ///
    /// # Errors
    /// If there are as many as were planned for.
    pub fn pager(&self) -> Result<CachePager, CacheError> {
        Ok(CachePager {
            geometry: self.geometry.batch()?,
            attributes: self.attributes.batch()?,
            tiles: self.tiles.as_ref().map(PageCache::batch).transpose()?,
        })
    }
}

/// Brings pages into memory through caches.
#[derive(Debug)]
pub struct CachePager {
    geometry: Batch,
    attributes: Batch,
    tiles: Option<Batch>,
}

impl CachePager {
    /// Waits for pages of attributes; see [`Pager::fetch`].
    ///
    /// # Errors
    /// A page cannot be had.
    pub fn fetch_attributes(&mut self, pages: &[u32]) -> Result<(), PageError> {
        self.fetch(&[], pages)
    }

    /// Waits for tiles, the most wanted first: for as many as the quota of a batch.
    ///
    /// # Errors
    /// A tile cannot be had.
    pub fn fetch_tiles(&mut self, tiles: &[u32]) -> Result<(), PageError> {
        self.all(&[], &[], tiles, Batch::fetch_all)
    }

    /// The tiles that are in memory now; none where there is no cache of tiles.
    #[must_use]
    pub fn tiles(&self) -> Table {
        self.tiles.as_ref().map(|tiles| tiles.table().clone()).unwrap_or_default()
    }

    /// Counts the use of a tile.
    pub fn uses_tile(&mut self, tile: u32) {
        if let Some(tiles) = &mut self.tiles {
            tiles.parts().1.add(tile);
        }
    }

    /// Fetches from all caches, so that no snapshot of one is held while another waits.
    fn all(
        &mut self,
        geometry: &[u32],
        attributes: &[u32],
        tiles: &[u32],
        fetch: impl Fn(&mut [(&mut Batch, &[u32])]) -> Result<(), PageError>,
    ) -> Result<(), PageError> {
        let (of_geometry, of_attributes) =
            ((&mut self.geometry, geometry), (&mut self.attributes, attributes));
        match &mut self.tiles {
            Some(batch) => fetch(&mut [of_geometry, of_attributes, (batch, tiles)]),
            None => fetch(&mut [of_geometry, of_attributes]),
        }
    }

    /// Counts the use of a page of attributes.
    pub fn uses_attributes(&mut self, page: u32) {
        self.attributes.parts().1.add(page);
    }
}

impl Pager for CachePager {
    type Error = PageError;

    fn geometry(&self) -> Table {
        self.geometry.table().clone()
    }

    fn attributes(&self) -> Table {
        self.attributes.table().clone()
    }

    fn fetch(&mut self, geometry: &[u32], attributes: &[u32]) -> Result<(), PageError> {
        self.all(geometry, attributes, &[], Batch::fetch_half)
    }

    fn rest(&mut self) {
        self.geometry.rest();
        self.attributes.rest();
        self.tiles.iter_mut().for_each(Batch::rest);
    }

    fn used(&mut self, pages: &[u64]) {
        self.geometry.note_used(pages);
    }
}
