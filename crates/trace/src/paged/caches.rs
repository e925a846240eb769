//! Pages of geometry and of attributes in two caches.

use super::Pager;
use vastlight_paging::{Batch, CacheError, PageCache, PageError, Table};

/// The caches over the pages of a scene.
#[derive(Debug)]
pub struct Caches {
    /// Pages of geometry.
    pub geometry: PageCache,
    /// Pages of attributes.
    pub attributes: PageCache,
}

impl Caches {
    /// A pager for one batch at a time.
    ///
    /// # Errors
    /// If there are as many as were planned for.
    pub fn pager(&self) -> Result<CachePager, CacheError> {
        Ok(CachePager { geometry: self.geometry.batch()?, attributes: self.attributes.batch()? })
    }
}

/// Brings pages into memory through caches.
#[derive(Debug)]
pub struct CachePager {
    geometry: Batch,
    attributes: Batch,
}

impl CachePager {
    /// Waits for pages of attributes; see [`Pager::fetch`].
    ///
    /// # Errors
    /// A page cannot be had.
    pub fn fetch_attributes(&mut self, pages: &[u32]) -> Result<(), PageError> {
        self.fetch(&[], pages)
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
        Batch::fetch_half(&mut [(&mut self.geometry, geometry), (&mut self.attributes, attributes)])
    }

    fn rest(&mut self) {
        self.geometry.rest();
        self.attributes.rest();
    }

    fn used(&mut self, pages: &[u64]) {
        self.geometry.note_used(pages);
    }
}
