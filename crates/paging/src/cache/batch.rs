//! A batch of work that needs pages.

use super::Shared;
use super::error::{PageError, PageFault};
use super::state::State;
use super::usage::Usage;
use crate::table::Table;
use std::sync::{Arc, Condvar, MutexGuard, PoisonError};
use std::time::Instant;

/// What the cache knows of a batch.
#[derive(Debug, Default)]
pub(super) struct Waiting {
    /// Pages that it waits for.
    pub(super) missing: usize,
    /// Why it will not get one of them.
    pub(super) failure: Option<PageError>,
    /// Pages that it keeps. All are in the table.
    pub(super) pins: Vec<u32>,
    /// Told when a page has come.
    pub(super) arrived: Arc<Condvar>,
}

/// A batch of work over a cache: a snapshot of the table, and the pages that are kept for it.
///
/// Its life: compute over [`parts`](Self::parts), [`fetch`](Self::fetch) what was missing, and again, until nothing is.
#[derive(Debug)]
pub struct Batch {
    shared: Arc<Shared>,
    number: usize,
    arrived: Arc<Condvar>,
    table: Table,
    usage: Usage,
}

impl Batch {
    pub(super) fn new(shared: Arc<Shared>, number: usize, arrived: Arc<Condvar>, table: Table) -> Self {
        let usage = Usage::new(table.pages());
        Self { shared, number, arrived, table, usage }
    }

    /// The pages that were in memory at the last fetch.
    #[must_use]
    pub fn table(&self) -> &Table {
        &self.table
    }

    /// The pages that were in memory at the last fetch, and where to note those that are used.
    pub fn parts(&mut self) -> (&Table, &mut Usage) {
        (&self.table, &mut self.usage)
    }

    /// Asks for pages, the most wanted first, and waits until they are in memory. At most
    /// [`quota`](super::CacheConfig::quota) of them are granted, and at least one; gives how many, counted from the
    /// first. A page that is named twice counts twice.
    ///
    /// The pages that the last fetch granted are let go first, and the table changes: granted pages are in it and stay
    /// there until the next fetch.
    ///
    /// # Errors
    /// If a granted page cannot be had: its number, the file, and why. No page is kept then; others that were granted
    /// may be in the table. It may be tried again.
    pub fn fetch(&mut self, pages: &[u32]) -> Result<usize, PageError> {
        self.rest();
        let granted = self.wait_for(pages);
        self.resume();
        granted
    }

    /// [`fetch`](Self::fetch) for batches of several caches that belong together: no snapshot of one is held while
    /// another waits. Batches of which nothing is wanted keep what they were granted before.
    ///
    /// # Errors
    /// As there, for the first that fails; those behind it are not asked then.
    pub fn fetch_all(wanted: &mut [(&mut Self, &[u32])]) -> Result<(), PageError> {
        Self::fetch_each(wanted, |batch, pages| batch.wait_for(pages).map(|_| ()))
    }

    /// [`fetch_all`](Self::fetch_all) that goes on when of each batch the first page is in memory and half of those that
    /// were on their way, so that the others are read while the batch computes. Those are kept as soon as they come.
    ///
    /// # Errors
    /// As there.
    pub fn fetch_half(wanted: &mut [(&mut Self, &[u32])]) -> Result<(), PageError> {
        Self::fetch_each(wanted, Self::wait_for_half)
    }

    fn fetch_each(
        wanted: &mut [(&mut Self, &[u32])],
        fetch: impl Fn(&mut Self, &[u32]) -> Result<(), PageError>,
    ) -> Result<(), PageError> {
        wanted.iter_mut().for_each(|(batch, _)| batch.rest());
        let mut asked = wanted.iter_mut().filter(|(_, pages)| !pages.is_empty());
        let fetched = asked.try_for_each(|(batch, pages)| fetch(batch, pages));
        wanted.iter_mut().for_each(|(batch, _)| batch.resume());
        fetched
    }

    /// Asks for pages and waits for them. The snapshot is let go of before.
    fn wait_for(&mut self, pages: &[u32]) -> Result<usize, PageError> {
        let granted = &pages[..pages.len().min(self.shared.config.quota())];
        self.check(granted)?;
        let mut state = self.shared.lock();
        state.forget(self.number);
        for &page in granted {
            state.ask(self.number, page, &self.shared.directory);
        }
        self.wait(state, granted, 0).map(|()| granted.len())
    }

    /// Lets go of all pages if there are not so many as one of these says.
    fn check(&self, pages: &[u32]) -> Result<(), PageError> {
        let known = self.shared.directory.pages();
        let Some(&page) = pages.iter().find(|&&page| page as usize >= known) else { return Ok(()) };
        self.let_go();
        Err(PageError { page, fault: PageFault::NoSuchPage { pages: known } })
    }

    /// Asks for as many pages as are granted, beside those that are on their way, and waits for half of them and the first.
    fn wait_for_half(&mut self, pages: &[u32]) -> Result<(), PageError> {
        self.check(pages)?;
        let mut state = self.shared.lock();
        state.unpin(self.number);
        // No more than half of the quota, so that there is room for the first.
        let mut granted = state.missing(self.number);
        for &page in pages {
            if granted >= self.shared.config.quota() {
                break;
            }
            if !state.awaits(self.number, page) {
                state.ask(self.number, page, &self.shared.directory);
                granted += 1;
            }
        }
        let enough = state.missing(self.number) / 2;
        self.wait(state, pages, enough)
    }

    /// Waits until the first of the pages is there, and no more than `enough` of all are missing.
    fn wait(&self, mut state: MutexGuard<'_, State>, pages: &[u32], enough: usize) -> Result<(), PageError> {
        let (number, first) = (self.number, pages.first().copied().unwrap_or(0));
        let waits = |state: &State| {
            let short = state.missing(number) > enough || state.awaits(number, first);
            short && !state.closed && state.failure(number).is_none()
        };
        if waits(&state) {
            self.shared.work.notify_all();
            let start = Instant::now();
            while waits(&state) {
                state = self.arrived.wait(state).unwrap_or_else(PoisonError::into_inner);
            }
            state.stats.stall += start.elapsed();
        }
        let failure = state.failure(number).cloned();
        let closed = || PageError { page: first, fault: PageFault::Closed };
        let failure = failure.or_else(|| state.closed.then(closed));
        if failure.is_some() {
            state.forget(number);
        }
        failure.map_or(Ok(()), Err)
    }

    /// Lets go of the snapshot, so that the memory of pages that left the cache can be used again. Pages that the last
    /// fetch granted stay. [`table`](Self::table) is empty until [`resume`](Self::resume) or the next fetch.
    ///
    /// Whoever waits for something else than a fetch of this cache does this first: else two who wait could hold what
    /// the other needs. For pages of several caches there is [`fetch_all`](Self::fetch_all).
    pub fn rest(&mut self) {
        self.table = Table::default();
        let mut state = self.shared.lock();
        self.usage.drain(|page| state.used(page));
        if !state.wanted.is_empty() {
            self.shared.work.notify_one();
        }
    }

    /// Notes the uses of a pass: a bit for each page, as [`Usage`] holds them.
    pub fn note_used(&mut self, words: &[u64]) {
        self.usage.add_words(words);
    }

    /// Takes the snapshot anew: what is in memory now.
    pub fn resume(&mut self) {
        self.table = Table::default();
        self.table = self.shared.lock().table.clone();
    }

    /// Lets go of the pages that were kept.
    fn let_go(&self) {
        self.shared.lock().forget(self.number);
    }
}

impl Drop for Batch {
    fn drop(&mut self) {
        self.rest();
        self.let_go();
        self.shared.lock().batches[self.number] = None;
        self.shared.work.notify_all();
    }
}
