//! Which pages are in memory.

use std::sync::Arc;

/// Memory of pages comes in cache lines.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(64))]
pub struct Line([u8; Line::BYTES]);

impl Line {
    /// Bytes of a line.
    pub const BYTES: usize = 64;

    /// A line of zeros.
    pub const ZERO: Self = Self([0; Self::BYTES]);
}

/// The memory of a page. It lives for as long as somebody reads it.
pub type Buffer = Arc<[Line]>;

/// Pages that share an entry of a table's upper level.
const CHUNK: usize = 256;

type Chunk = [Option<Buffer>; CHUNK];

/// Pages by number, those that are in memory.
///
/// A table is a value: a clone is cheap, shares the memory of all pages, and stays as it is whatever becomes of the
/// original. So readers keep a table for as long as they need its pages to stay, and the memory of a page that was taken
/// out of the original is free when the last of them is gone.
#[derive(Clone, Debug, Default)]
pub struct Table {
    chunks: Vec<Arc<Chunk>>,
    pages: usize,
}

impl Table {
    /// A table of so many pages, none of them in memory.
    #[must_use]
    pub fn new(pages: usize) -> Self {
        let empty: Arc<Chunk> = Arc::new([const { None }; CHUNK]);
        Self { chunks: vec![empty; pages.div_ceil(CHUNK)], pages }
    }

    /// A table with all of `pages` in memory, with `slack` zeros behind each.
    #[must_use]
    pub fn resident<'p>(pages: impl ExactSizeIterator<Item = &'p [u8]>, slack: usize) -> Self {
        let mut table = Self::new(pages.len());
        for (number, page) in pages.enumerate() {
            let mut buffer: Buffer = vec![Line::ZERO; (page.len() + slack).div_ceil(Line::BYTES)].into();
            if let Some(lines) = Arc::get_mut(&mut buffer) {
                bytemuck::cast_slice_mut(lines)[..page.len()].copy_from_slice(page);
            }
            table.set(number as u32, Some(buffer));
        }
        table
    }

    /// The memory of a page, if it is there.
    #[inline(always)]
    #[must_use]
    pub fn page(&self, page: u32) -> Option<&[u8]> {
        let chunk = self.chunks.get(page as usize / CHUNK)?;
        chunk[page as usize % CHUNK].as_deref().map(bytemuck::cast_slice)
    }

    /// The pages that are in memory, ascending.
    pub fn present(&self) -> impl Iterator<Item = u32> {
        let numbered = |(c, chunk): (usize, &Arc<Chunk>)| {
            let there: Vec<u32> =
                (0..CHUNK).filter(|&i| chunk[i].is_some()).map(|i| (c * CHUNK + i) as u32).collect();
            there
        };
        self.chunks.iter().enumerate().flat_map(numbered)
    }

    /// Number of pages, in memory or not.
    #[must_use]
    pub fn pages(&self) -> usize {
        self.pages
    }

    /// Puts a page into memory or takes it out; gives the memory that it had.
    pub fn set(&mut self, page: u32, buffer: Option<Buffer>) -> Option<Buffer> {
        let chunk = Arc::make_mut(self.chunks.get_mut(page as usize / CHUNK)?);
        std::mem::replace(&mut chunk[page as usize % CHUNK], buffer)
    }

    /// Bytes of the pages that are in memory.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.chunks.iter().flat_map(|chunk| chunk.iter().flatten()).map(|b| size_of_val(&b[..])).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clone_keeps_what_the_original_gives_away() {
        let mut table = Table::resident([&[1; 10][..], &[2; 100]].into_iter(), 64);
        let kept = table.clone();
        let gone = table.set(1, None).expect("was there");
        assert!(table.page(1).is_none() && table.page(2).is_none() && table.page(999).is_none());
        assert_eq!(kept.page(1).map(|page| (page.len(), page[99], page[100])), Some((192, 2, 0)));
        assert_eq!((table.bytes(), kept.bytes(), Arc::strong_count(&gone)), (128, 320, 2));
        drop(kept);
        assert_eq!(Arc::strong_count(&gone), 1, "free for the next page");
    }
}
