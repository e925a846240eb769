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
        // Whoever waits holds no snapshots.
        self.geometry.rest();
        self.attributes.rest();
        if !geometry.is_empty() {
            self.geometry.fetch(geometry)?;
            self.geometry.rest();
        }
        if !attributes.is_empty() {
            self.attributes.fetch(attributes)?;
        }
        self.geometry.resume();
        self.attributes.resume();
        Ok(())
    }

    fn used(&mut self, pages: &[u64]) {
        let (_, usage) = self.geometry.parts();
        for (first, &word) in (0..).step_by(64).zip(pages) {
            let mut bits = word;
            while bits != 0 {
                usage.add(first + bits.trailing_zeros());
                bits &= bits - 1;
            }
        }
    }
}
