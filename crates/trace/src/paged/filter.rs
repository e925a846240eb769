//! What decides about hits and pages in a pass.

use super::{Found, PagedFilter, Verdict};
use crate::judge::Judge;
use crate::{Hit, Tracer};
use std::sync::atomic::{AtomicU64, Ordering};
use vastlight_paging::Table;

/// Numbers of pages as bits.
#[derive(Debug, Default)]
pub(super) struct PageSet {
    words: Vec<AtomicU64>,
}

impl PageSet {
    pub(super) fn clear(&mut self, pages: usize) {
        self.words.clear();
        self.words.resize_with(pages.div_ceil(64), AtomicU64::default);
    }

    #[inline(always)]
    pub(super) fn contains(&self, page: u32) -> bool {
        (self.words.get(page as usize / 64))
            .is_some_and(|w| w.load(Ordering::Relaxed) >> (page % 64) & 1 == 1)
    }

    /// Adds a page.
    #[inline(always)]
    pub(super) fn insert(&self, page: u32) {
        let Some(word) = self.words.get(page as usize / 64) else { return };
        let (old, bit) = (word.load(Ordering::Relaxed), 1 << (page % 64));
        if old & bit == 0 {
            word.fetch_or(bit, Ordering::Relaxed);
        }
    }

    /// Leaves the pages for which `keep` is true.
    pub(super) fn retain(&mut self, keep: impl Fn(u32) -> bool) {
        for (first, word) in (0..).step_by(64).zip(&mut self.words) {
            let word = word.get_mut();
            let mut bits = *word;
            while bits != 0 {
                let bit = bits.trailing_zeros();
                if !keep(first + bit) {
                    *word &= !(1 << bit);
                }
                bits &= bits - 1;
            }
        }
    }

    /// Leaves out the pages that `other` has too.
    pub(super) fn remove_all(&mut self, other: &mut Self) {
        for (word, other) in self.words.iter_mut().zip(&mut other.words) {
            *word.get_mut() &= !*other.get_mut();
        }
    }

    /// The bits of all pages.
    pub(super) fn words(&mut self) -> Vec<u64> {
        self.words.iter_mut().map(|word| *word.get_mut()).collect()
    }
}

/// Decides for the rays of a pass.
pub(super) struct PassFilter<'a> {
    /// None where every hit counts.
    pub(super) filter: Option<&'a dyn PagedFilter>,
    pub(super) tracer: &'a Tracer,
    pub(super) attributes: &'a Table,
    /// Numbers in the whole batch by numbers in the pass.
    pub(super) numbers: &'a [u32],
    /// Pages that all rays of the pass have looked through before.
    pub(super) done: &'a PageSet,
    pub(super) used: &'a PageSet,
    /// Pages with a hit that could not be decided.
    pub(super) undecided: &'a PageSet,
}

impl Judge for PassFilter<'_> {
    const ACCEPTS_ALL: bool = false;
    const PAGED: bool = true;

    #[inline(always)]
    fn judge(&self, ray: usize, hit: &Hit, found: impl FnOnce() -> Found) -> Verdict {
        let Some(filter) = self.filter else { return Verdict::Counts };
        let found = self.tracer.unscaled(hit, found());
        let verdict = filter.judge(self.numbers[ray] as usize, hit, &found, self.attributes);
        if matches!(verdict, Verdict::Unknown(_)) {
            self.undecided.insert(found.page);
        }
        verdict
    }

    #[inline(always)]
    fn is_done(&self, page: u32) -> bool {
        self.done.contains(page)
    }

    #[inline(always)]
    fn uses(&self, page: u32) {
        self.used.insert(page);
    }
}
