//! Sizes of a cache, and the memory that they come to.

use super::error::CacheError;
use crate::directory::{Directory, PageEntry};
use crate::policy::PolicyKind;
use crate::table::{Line, Table};

/// Sizes of a cache.
#[derive(Clone, Copy, Debug)]
pub struct CacheConfig {
    /// Pages that fit into memory at once.
    pub slots: usize,
    /// Memory of a slot, a multiple of 64 bytes. Every page must fit, with `slack` behind it.
    pub slot_bytes: usize,
    /// Bytes behind each page that are readable and zero.
    pub slack: usize,
    /// Which page leaves when room is needed.
    pub policy: PolicyKind,
    /// Threads that read, at least one. Each has `read_bytes` of memory of its own. A disk wants a few, an object store
    /// as many as it takes to hide its latency.
    pub io_threads: usize,
    /// Most batches at a time, at least one and at most `slots`.
    pub most_batches: usize,
    /// Slots that batches do not share out among them: what stays in memory however much they ask for.
    pub reserve: usize,
    /// Longest read that joins pages.
    pub read_bytes: usize,
    /// Longest stretch between two pages that is read and thrown away to join them.
    pub gap_bytes: usize,
    /// Pages behind a page that was asked for that are read with it, if they lie behind it in the file and slots are
    /// free or cold.
    pub read_ahead: usize,
}

impl CacheConfig {
    /// A cache of so many slots for pages of up to so many bytes without slack, with the usual sizes: four threads, 8
    /// batches (fewer if there are fewer slots), half of the slots in reserve, reads of up to 1 MiB over gaps of up to
    /// 16 KiB, no read-ahead.
    #[must_use]
    pub fn new(slots: usize, slot_bytes: usize) -> Self {
        Self {
            slots,
            slot_bytes,
            slack: 0,
            policy: PolicyKind::default(),
            io_threads: 4,
            most_batches: slots.clamp(1, 8),
            reserve: slots / 2,
            read_bytes: 1 << 20,
            gap_bytes: 16 << 10,
            read_ahead: 0,
        }
    }

    /// Most pages that one batch gets by one fetch.
    #[must_use]
    pub fn quota(&self) -> usize {
        (self.slots.saturating_sub(self.reserve) / self.most_batches.max(1)).max(1)
    }

    /// Most bytes that a cache of these sizes takes over a file of so many pages: slots, directory, tables (those that
    /// batches keep too), the account of uses, and memory to read into. What the source needs for itself is not in it:
    /// see [`buffer_bytes`](crate::Source::buffer_bytes).
    #[must_use]
    pub fn memory_bytes(&self, pages: usize) -> usize {
        let tables = (self.most_batches + 2) * Table::own_bytes(pages, self.slots.min(pages));
        let per_page = size_of::<PageEntry>() + size_of::<u32>();
        let usage = self.most_batches * pages.div_ceil(64) * 2 * size_of::<u64>();
        let staging = self.io_threads.max(1) * self.staging_bytes();
        self.slots * (self.slot_bytes + Line::BYTES + SLOT_ACCOUNT)
            + pages * per_page
            + tables
            + usage
            + staging
    }

    /// Memory that a thread reads into.
    pub(super) fn staging_bytes(&self) -> usize {
        self.read_bytes.max(self.slot_bytes)
    }

    /// Checks the sizes against the pages.
    pub(super) fn check(&self, directory: &Directory) -> Result<(), CacheError> {
        if self.slot_bytes == 0 || !self.slot_bytes.is_multiple_of(Line::BYTES) {
            return Err(CacheError::SlotBytes { slot_bytes: self.slot_bytes });
        }
        if self.most_batches == 0 || self.slots < self.most_batches {
            let (slots, most_batches) = (self.slots, self.most_batches);
            return Err(CacheError::TooFewSlots { slots, most_batches });
        }
        let Some((page, entry)) = directory.longest() else { return Ok(()) };
        let bytes = (entry.bytes as usize).saturating_add(self.slack);
        if bytes > self.slot_bytes {
            return Err(CacheError::SlotTooSmall { page, bytes, slot_bytes: self.slot_bytes });
        }
        Ok(())
    }
}

/// What a slot costs besides its memory: its own record, its place in requests, and the account of the policy.
const SLOT_ACCOUNT: usize = 256;
