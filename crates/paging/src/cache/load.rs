//! Threads that read pages, check them, and put them into the table.

use super::Shared;
use super::error::{PageError, PageFault};
use super::plan::runs;
use super::state::Claim;
use crate::directory::PageEntry;
use crate::table::{Buffer, zeroed};
use std::sync::{Arc, PoisonError};
use std::time::Duration;

/// How long a thread waits for a slot whose last snapshot goes away unannounced.
const SNAPSHOT_CHECK: Duration = Duration::from_millis(1);

/// A claim and what came of it.
type Loaded = (Claim, Result<(), PageError>);

/// Reads until the cache is closed.
pub(super) fn serve(shared: &Shared) {
    let mut loader = Loader { shared, staging: Vec::new(), reads: 0, bytes_read: 0 };
    while let Some(claims) = next_claims(shared) {
        let loaded = loader.load(claims);
        loader.publish(loaded);
    }
}

/// Waits for something to do.
fn next_claims(shared: &Shared) -> Option<Vec<Claim>> {
    let mut state = shared.lock();
    loop {
        if state.closed {
            return None;
        }
        let claims = state.plan(&shared.config, &shared.directory);
        if !claims.is_empty() {
            return Some(claims);
        }
        state = if state.wanted.is_empty() {
            shared.work.wait(state).unwrap_or_else(PoisonError::into_inner)
        } else {
            shared.work.wait_timeout(state, SNAPSHOT_CHECK).unwrap_or_else(PoisonError::into_inner).0
        };
    }
}

/// What one thread has.
struct Loader<'a> {
    shared: &'a Shared,
    staging: Vec<u8>,
    reads: u64,
    bytes_read: u64,
}

impl Loader<'_> {
    fn load(&mut self, claims: Vec<Claim>) -> Vec<Loaded> {
        let entries: Vec<PageEntry> = claims.iter().map(|claim| self.entry(claim.page)).collect();
        let mut loaded = Vec::with_capacity(claims.len());
        let mut claims = claims.into_iter();
        let mut first = 0;
        for end in runs(&entries, &self.shared.config) {
            let run: Vec<Claim> = claims.by_ref().take(end - first).collect();
            self.load_run(run, &entries[first..end], &mut loaded);
            first = end;
        }
        loaded
    }

    fn entry(&self, page: u32) -> PageEntry {
        self.shared.directory.get(page).unwrap_or(PageEntry { offset: 0, bytes: 0, crc32: 0 })
    }

    /// One read for all pages of a run. A page that does not come right out of it is read alone.
    fn load_run(&mut self, run: Vec<Claim>, entries: &[PageEntry], loaded: &mut Vec<Loaded>) {
        let joined = entries.len() > 1 && self.stage(entries);
        let start = entries[0].offset;
        for (mut claim, entry) in run.into_iter().zip(entries) {
            let mut buffer = claim.buffer.take().unwrap_or_else(|| zeroed(self.shared.config.slot_bytes));
            let from = joined.then(|| self.staged(start, entry)).flatten();
            let result = match (from, page_of(&mut buffer, entry)) {
                (Some(bytes), Some(page)) if crc32fast::hash(bytes) == entry.crc32 => {
                    page.copy_from_slice(bytes);
                    Ok(())
                }
                (_, Some(page)) => self.load_alone(claim.page, entry, page),
                (_, None) => Err(self.short_of(claim.page)),
            };
            claim.buffer = Some(buffer);
            loaded.push((claim, result));
        }
    }

    /// Reads what a run covers; false if that fails.
    fn stage(&mut self, entries: &[PageEntry]) -> bool {
        let (first, last) = (entries[0].offset, entries[entries.len() - 1].end());
        let bytes = (last - first) as usize;
        if self.staging.len() < bytes {
            self.staging.resize(self.shared.config.staging_bytes().max(bytes), 0);
        }
        self.count(bytes);
        self.shared.source.read(first, &mut self.staging[..bytes]).is_ok()
    }

    fn staged(&self, start: u64, entry: &PageEntry) -> Option<&[u8]> {
        let first = (entry.offset - start) as usize;
        self.staging.get(first..first + entry.bytes as usize)
    }

    /// Reads one page, and once more if its bytes are wrong: they may have been spoilt on the way.
    fn load_alone(&mut self, page: u32, entry: &PageEntry, into: &mut [u8]) -> Result<(), PageError> {
        let mut found = 0;
        for _ in 0..2 {
            self.count(into.len());
            let read = self.shared.source.read(entry.offset, into);
            read.map_err(|error| PageError { page, fault: PageFault::Source(Arc::new(error)) })?;
            found = crc32fast::hash(into);
            if found == entry.crc32 {
                return Ok(());
            }
        }
        let name = self.shared.source.name().into();
        Err(PageError { page, fault: PageFault::Checksum { name, entry: *entry, found } })
    }

    fn count(&mut self, bytes: usize) {
        self.reads += 1;
        self.bytes_read += bytes as u64;
    }

    /// A page that is longer than its slot; sizes are checked when a cache is made.
    fn short_of(&self, page: u32) -> PageError {
        PageError { page, fault: PageFault::NoSuchPage { pages: self.shared.directory.pages() } }
    }

    /// Tells all at once what came of the claims.
    fn publish(&mut self, loaded: Vec<Loaded>) {
        let mut state = self.shared.lock();
        state.stats.reads += std::mem::take(&mut self.reads);
        state.stats.bytes_read += std::mem::take(&mut self.bytes_read);
        for (claim, result) in loaded {
            match result {
                Ok(()) => state.arrive(claim),
                Err(error) => state.fail(claim, &error),
            }
        }
    }
}

/// The part of a slot's memory that a page takes; what is behind it becomes zero.
fn page_of<'a>(buffer: &'a mut Buffer, entry: &PageEntry) -> Option<&'a mut [u8]> {
    let memory: &mut [u8] = bytemuck::cast_slice_mut(Arc::get_mut(buffer)?);
    let (page, behind) = memory.split_at_mut_checked(entry.bytes as usize)?;
    behind.fill(0);
    Some(page)
}
