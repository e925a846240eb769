//! What a cache did.

use std::time::Duration;

/// Counts since the cache was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CacheStats {
    /// Uses of pages by passes of batches: a page counts once a pass.
    pub hits: u64,
    /// Pages that batches asked for that were not in memory.
    pub misses: u64,
    /// Pages that came into memory from the source, those that nobody asked for too.
    pub pages_read: u64,
    /// Pages that came back from memory that had been given up but not used again.
    pub pages_revived: u64,
    /// Of `pages_read`, those that hints and read-ahead brought.
    pub pages_ahead: u64,
    /// Reads of the source.
    pub reads: u64,
    /// Bytes read, gaps between joined pages included.
    pub bytes_read: u64,
    /// Pages that left memory.
    pub evictions: u64,
    /// Pages that could not be had.
    pub failures: u64,
    /// Time that batches waited for pages, added up over batches.
    pub stall: Duration,
    /// Pages in memory now.
    pub resident_pages: usize,
    /// Most bytes that slots have taken.
    pub peak_bytes: usize,
}
