//! Who decides whether a hit counts, as the walks see them.

use crate::paged::{Found, Verdict};
use crate::{AcceptAll, Hit, HitFilter};

/// Decides about hits, and about pages.
pub(crate) trait Judge: Sync {
    /// Whether every hit counts.
    const ACCEPTS_ALL: bool;
    /// Whether pages may not be in memory. Then walks keep account of where hits were found and what is missing.
    const PAGED: bool;

    /// Whether a hit of the ray number `ray` in the batch counts; `found` says where it is.
    fn judge(&self, ray: usize, hit: &Hit, found: impl FnOnce() -> Found) -> Verdict;

    /// Whether a page has been looked through by all rays that may meet it.
    fn is_done(&self, page: u32) -> bool;

    /// Counts the use of a page.
    fn uses(&self, page: u32);
}

impl Judge for AcceptAll {
    const ACCEPTS_ALL: bool = true;
    const PAGED: bool = false;

    #[inline(always)]
    fn judge(&self, _ray: usize, _hit: &Hit, _found: impl FnOnce() -> Found) -> Verdict {
        Verdict::Counts
    }

    #[inline(always)]
    fn is_done(&self, _page: u32) -> bool {
        false
    }

    #[inline(always)]
    fn uses(&self, _page: u32) {}
}

/// What somebody outside decides. Behind a pointer, so that walks are compiled once.
#[derive(Clone, Copy)]
pub(crate) struct Filtered<'f>(pub(crate) &'f dyn HitFilter);

impl Judge for Filtered<'_> {
    const ACCEPTS_ALL: bool = false;
    const PAGED: bool = false;

    #[inline(always)]
    fn judge(&self, ray: usize, hit: &Hit, _found: impl FnOnce() -> Found) -> Verdict {
        if self.0.accepts(ray, hit) { Verdict::Counts } else { Verdict::Passes }
    }

    #[inline(always)]
    fn is_done(&self, _page: u32) -> bool {
        false
    }

    #[inline(always)]
    fn uses(&self, _page: u32) {}
}
