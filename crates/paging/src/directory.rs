//! Where the pages of a file are.

use std::sync::Arc;

/// Where a page is, how long it is, and what its bytes must add up to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PageEntry {
    /// First byte in the file.
    pub offset: u64,
    /// Length.
    pub bytes: u32,
    /// CRC-32 (IEEE) of the bytes.
    pub crc32: u32,
}

impl PageEntry {
    /// The entry of a page that lies at `offset` with these bytes.
    #[must_use]
    pub fn of(offset: u64, page: &[u8]) -> Self {
        Self { offset, bytes: page.len() as u32, crc32: crc32fast::hash(page) }
    }

    /// The first byte behind the page; pages at the end of all numbers end there.
    #[must_use]
    pub fn end(&self) -> u64 {
        self.offset.saturating_add(u64::from(self.bytes))
    }
}

/// Entries of all pages by number. A clone shares them.
#[derive(Clone, Debug, Default)]
pub struct Directory(Arc<[PageEntry]>);

impl Directory {
    /// The directory of pages that lie one behind the other from `offset` on.
    #[must_use]
    pub fn packed(offset: u64, pages: &[Vec<u8>]) -> Self {
        let mut next = offset;
        let entry = |page: &Vec<u8>| {
            let entry = PageEntry::of(next, page);
            next = entry.end();
            entry
        };
        pages.iter().map(entry).collect()
    }

    /// The entry of a page.
    #[must_use]
    pub fn get(&self, page: u32) -> Option<PageEntry> {
        self.0.get(page as usize).copied()
    }

    /// Number of pages.
    #[must_use]
    pub fn pages(&self) -> usize {
        self.0.len()
    }

    /// The longest page.
    #[must_use]
    pub fn longest(&self) -> Option<(u32, PageEntry)> {
        (0..).zip(self.0.iter().copied()).max_by_key(|(_, entry)| entry.bytes)
    }
}

impl From<Vec<PageEntry>> for Directory {
    fn from(entries: Vec<PageEntry>) -> Self {
        Self(entries.into())
    }
}

impl FromIterator<PageEntry> for Directory {
    fn from_iter<I: IntoIterator<Item = PageEntry>>(entries: I) -> Self {
        Self(entries.into_iter().collect())
    }
}
