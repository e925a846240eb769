//! A cache of pages: some of the pages of a source in a fixed number of slots.
//!
//! Work comes in batches. A [`Batch`] computes over a snapshot of the table of pages in memory, notes what it misses,
//! and asks for that by [`Batch::fetch`], which waits. Threads of the cache read what is asked for, in the order of the
//! file and many pages at once, check it, and publish it by one change of the table. Other batches compute meanwhile, so
//! there should be more batches (threads) than processors.
//!
//! # Memory
//! A slot's memory is an `Arc`. The cache holds it, the table holds it while the page is in it, and so do snapshots of
//! such tables. A page that leaves the cache leaves the table only; its slot is filled anew when the cache alone holds it
//! (`Arc::get_mut`). So nobody ever reads memory that changes, and there are never more slots than were asked for.
//!
//! # Nobody waits for ever
//! That holds if every read of the source ends, every pass of a batch ends, and nobody waits for anything else while it
//! holds a snapshot of any cache ([`Batch::rest`], [`Batch::fetch_all`]).
//!
//! 1. *Pins are bounded.* A batch keeps or awaits at most [`CacheConfig::quota`] pages, after it has let go of those that
//!    it had. There are at most `most_batches` batches, so all of them together name at most `slots` pages: for a quota
//!    of more than one because it is rounded down, and for a quota of one because `most_batches <= slots`.
//! 2. *So there is a slot for every page that is awaited.* Let a page be awaited that has none. Fewer than `slots` slots
//!    then hold pages that are kept or awaited. Of the others, one is free, or holds a page that may leave, or holds one
//!    that has left, or is being filled with a page that nobody awaits any more, because it was read ahead or its batch
//!    got an error: that read ends, and then the page may leave.
//! 3. *It becomes usable.* A page that may leave does so when a thread looks for room. One that has left is held by
//!    snapshots of batches that compute, for a batch that waits, here or in another cache, has let go of its own; what
//!    it keeps there is counted by 1. Their passes end, and then they fetch, rest or end, which lets go of the snapshot.
//!    Threads look again when that happens.
//! 4. *No page is passed over for ever.* Threads go through the file in one direction and start anew at its end; a sweep
//!    is finite, and every page that is awaited when it starts, and for which there is a slot, is read in it.
//! 5. *A batch goes on when all pages that were granted are there*, or by [`Batch::fetch_half`] when the first is there and half
//!    of the rest. They cannot leave meanwhile: they are kept from the
//!    moment at which they are in the table, and no other batch can undo that. What is on its way then counts against the
//!    next grant, and is less than it, so there is always room for a first page. At least one page is granted, so a batch
//!    that asks for its most wanted page first gets on by one page with every fetch.
//!
//! Reads that fail count as ended: all who wait for the page get the error, its slot becomes free, and the page may be
//! asked for again.

mod batch;
mod config;
mod error;
mod load;
mod plan;
mod state;
mod stats;
mod usage;

#[cfg(test)]
mod tests;

pub use batch::Batch;
pub use config::CacheConfig;
pub use error::{CacheError, PageError, PageFault};
pub use stats::CacheStats;
pub use usage::Usage;

use crate::directory::Directory;
use crate::source::Source;
use crate::table::Table;
use batch::Waiting;
use state::State;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

/// Most hints that wait; older ones are forgotten.
const MOST_HINTS: usize = 4096;

/// What batches, threads and the cache share.
#[derive(Debug)]
struct Shared {
    source: Arc<dyn Source>,
    directory: Directory,
    config: CacheConfig,
    state: Mutex<State>,
    /// Told when there may be something to read, or room to read it into.
    work: Condvar,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A cache of pages. When it is dropped its threads end, and batches that are left get errors.
#[derive(Debug)]
pub struct PageCache {
    shared: Arc<Shared>,
    threads: Vec<JoinHandle<()>>,
}

impl PageCache {
    /// A cache over the pages that `directory` tells of. Nothing is read yet, and slots take memory when they are used.
    ///
    /// # Errors
    /// If the sizes contradict each other or the pages, or the system gives no threads.
    pub fn new(
        source: Arc<dyn Source>,
        directory: Directory,
        config: CacheConfig,
    ) -> Result<Self, CacheError> {
        config.check(&directory)?;
        let state = Mutex::new(State::new(&config, directory.pages()));
        let shared = Arc::new(Shared { source, directory, config, state, work: Condvar::new() });
        let mut cache = Self { shared, threads: Vec::new() };
        for number in 0..config.io_threads.max(1) {
            let shared = cache.shared.clone();
            let thread = std::thread::Builder::new().name(format!("page reader {number}"));
            let thread = thread.spawn(move || load::serve(&shared));
            cache.threads.push(thread.map_err(|error| CacheError::Threads(error.to_string()))?);
        }
        Ok(cache)
    }

    /// A new batch. It may outlive the cache, but gets no pages then.
    ///
    /// # Errors
    /// If there are as many as were planned for.
    pub fn batch(&self) -> Result<Batch, CacheError> {
        let mut state = self.shared.lock();
        let free = state.batches.iter().position(Option::is_none);
        let number = free.unwrap_or(state.batches.len());
        let most_batches = self.shared.config.most_batches;
        if number >= most_batches {
            return Err(CacheError::TooManyBatches { most_batches });
        }
        if free.is_none() {
            state.batches.push(None);
        }
        let waiting = Waiting::default();
        let arrived = waiting.arrived.clone();
        state.batches[number] = Some(waiting);
        Ok(Batch::new(self.shared.clone(), number, arrived, state.table.clone()))
    }

    /// What is in memory now. Whoever keeps it keeps the memory of its pages from being used again: for a look, not for
    /// work that fetches; that is done over the table of a [`Batch`].
    #[must_use]
    pub fn snapshot(&self) -> Table {
        self.shared.lock().table.clone()
    }

    /// Says that pages may be wanted soon. They are read when no thread has anything better to do, and only into slots
    /// that are free or whose pages were not used lately. Never waits.
    pub fn prefetch(&self, pages: &[u32]) {
        let mut state = self.shared.lock();
        let absent = pages.iter().filter(|&&page| state.is_absent(page)).copied();
        let fresh: Vec<u32> = absent.take(MOST_HINTS).collect();
        let forgotten = (state.hinted.len() + fresh.len()).saturating_sub(MOST_HINTS);
        state.hinted.drain(..forgotten.min(MOST_HINTS));
        state.hinted.extend(fresh);
        self.shared.work.notify_one();
    }

    /// Takes account of uses of pages that no batch noted. A page is named once a pass.
    pub fn used(&self, pages: impl Iterator<Item = u32>) {
        let mut state = self.shared.lock();
        pages.for_each(|page| state.used(page));
    }

    /// What was done so far.
    #[must_use]
    pub fn stats(&self) -> CacheStats {
        self.shared.lock().stats(self.shared.config.slot_bytes)
    }

    /// Where the pages are.
    #[must_use]
    pub fn directory(&self) -> &Directory {
        &self.shared.directory
    }

    /// The sizes.
    #[must_use]
    pub fn config(&self) -> &CacheConfig {
        &self.shared.config
    }
}

impl Drop for PageCache {
    fn drop(&mut self) {
        self.shared.lock().close();
        self.shared.work.notify_all();
        for thread in self.threads.drain(..) {
            // A thread that panicked has nothing to tell.
            let _ = thread.join();
        }
    }
}
