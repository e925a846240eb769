//! What can go wrong with a cache.

use crate::directory::PageEntry;
use crate::source::SourceError;
use std::sync::Arc;

/// A page cannot be had.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("page {page}: {fault}")]
pub struct PageError {
    /// The number of the page.
    pub page: u32,
    /// Why.
    pub fault: PageFault,
}

/// Why a page cannot be had.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PageFault {
    /// Its bytes cannot be read.
    #[error(transparent)]
    Source(Arc<SourceError>),
    /// Its bytes are not those that were written, and were not when they were read again.
    #[error(
        "{name}, bytes {} to {}: crc32 is {found:#010x} instead of {:#010x} \
         (the file is damaged, or not the one that its directory belongs to)",
        entry.offset, entry.end(), entry.crc32
    )]
    Checksum {
        /// The name of the source.
        name: Arc<str>,
        /// What the directory says.
        entry: PageEntry,
        /// The checksum of the bytes that came.
        found: u32,
    },
    /// There are not so many.
    #[error("there are only {pages} pages (what names the page is damaged, or belongs to another file)")]
    NoSuchPage {
        /// Number of pages.
        pages: usize,
    },
    /// The cache was dropped.
    #[error("the page cache is gone (keep it for as long as batches fetch from it)")]
    Closed,
}

/// A cache cannot be made, or gives no more batches.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CacheError {
    /// Slots are no multiple of 64 bytes.
    #[error("slots of {slot_bytes} bytes (take a multiple of 64)")]
    SlotBytes {
        /// What was asked for.
        slot_bytes: usize,
    },
    /// The longest page does not fit into a slot.
    #[error("page {page} takes {bytes} bytes with what is kept free behind it, but a slot has {slot_bytes}")]
    SlotTooSmall {
        /// Its number.
        page: u32,
        /// Its length with slack.
        bytes: usize,
        /// What was asked for.
        slot_bytes: usize,
    },
    /// Not every batch could keep a page.
    #[error("{slots} slots for {most_batches} batches (give more memory, or trace with fewer batches)")]
    TooFewSlots {
        /// What was asked for.
        slots: usize,
        /// What was asked for.
        most_batches: usize,
    },
    /// More batches than were planned for.
    #[error("{most_batches} batches are there already (drop one, or plan for more)")]
    TooManyBatches {
        /// What was asked for.
        most_batches: usize,
    },
    /// The system gives no more threads.
    #[error("no thread to read with: {0} (use fewer threads)")]
    Threads(String),
}
