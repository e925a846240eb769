//! Which pages are in memory.

use std::sync::{Arc, Weak};

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

/// Pages that share a group.
const GROUP: usize = u128::BITS as usize;

/// Pages that follow each other: a bit for each, and the memory of those that are there.
#[derive(Clone, Debug, Default)]
struct Group {
    there: u128,
    buffers: Option<Arc<[Buffer]>>,
}

/// Pages by number, those that are in memory.
///
/// A table is a value: a clone is cheap, shares the memory of all pages, and stays as it is whatever becomes of the
/// original. So readers keep a table for as long as they need its pages to stay, and the memory of a page that was taken
/// out of the original is free when the last of them is gone.
#[derive(Clone, Debug, Default)]
pub struct Table {
    groups: Arc<[Group]>,
    pages: usize,
}

/// A state of a [`Table`]. It keeps no page in memory.
#[derive(Clone, Debug)]
pub struct Edition(Weak<[Group]>);

impl Table {
    /// A table of so many pages, none of them in memory.
    #[must_use]
    pub fn new(pages: usize) -> Self {
        Self { groups: vec![Group::default(); pages.div_ceil(GROUP)].into(), pages }
    }

    /// A table with all of `pages` in memory, with `slack` zeros behind each.
    #[must_use]
    pub fn resident<'p>(pages: impl ExactSizeIterator<Item = &'p [u8]>, slack: usize) -> Self {
        let mut table = Self::new(pages.len());
        for (number, page) in pages.enumerate() {
            let mut buffer = zeroed(page.len() + slack);
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
        let group = self.groups.get(page as usize / GROUP)?;
        let (there, index) = group.find(page);
        if !there {
            return None;
        }
        group.buffers.as_ref()?.get(index).map(|buffer| bytemuck::cast_slice(buffer))
    }

    /// What tells this table from what becomes of it.
    #[must_use]
    pub fn edition(&self) -> Edition {
        Edition(Arc::downgrade(&self.groups))
    }

    /// Whether the table, or that of which it is a clone, is as it was then. A table that was changed and changed back is
    /// another.
    #[must_use]
    pub fn is_of(&self, edition: &Edition) -> bool {
        std::ptr::addr_eq(Arc::as_ptr(&self.groups), edition.0.as_ptr())
    }

    /// The pages that are in memory, ascending.
    pub fn present(&self) -> impl Iterator<Item = u32> {
        (0..)
            .step_by(GROUP)
            .zip(&self.groups[..])
            .flat_map(|(first, group)| group.numbers().map(move |n| first + n))
    }

    /// Number of pages, in memory or not.
    #[must_use]
    pub fn pages(&self) -> usize {
        self.pages
    }

    /// Puts a page into memory or takes it out; gives the memory that it had.
    pub fn set(&mut self, page: u32, buffer: Option<Buffer>) -> Option<Buffer> {
        if page as usize >= self.pages {
            return None;
        }
        let group = Arc::make_mut(&mut self.groups).get_mut(page as usize / GROUP)?;
        group.set(page, buffer)
    }

    /// Bytes of the pages that are in memory.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let buffers = self.groups.iter().filter_map(|group| group.buffers.as_deref()).flatten();
        buffers.map(|buffer| size_of_val(&buffer[..])).sum()
    }

    /// Most bytes that a table of so many pages takes with so many in memory, the memory of the pages apart.
    #[must_use]
    pub fn own_bytes(pages: usize, in_memory: usize) -> usize {
        let groups = pages.div_ceil(GROUP);
        groups * size_of::<Group>() + groups.min(in_memory) * 32 + in_memory * size_of::<Buffer>()
    }
}

impl Group {
    /// Whether a page is there, and how many pages before it are.
    #[inline(always)]
    fn find(&self, page: u32) -> (bool, usize) {
        let bit = 1_u128 << (page as usize % GROUP);
        (self.there & bit != 0, (self.there & (bit - 1)).count_ones() as usize)
    }

    /// The pages of the group that are there, ascending.
    fn numbers(&self) -> impl Iterator<Item = u32> + use<> {
        let mut rest = self.there;
        std::iter::from_fn(move || {
            let number = (rest != 0).then(|| rest.trailing_zeros());
            rest &= rest.saturating_sub(1);
            number
        })
    }

    fn set(&mut self, page: u32, buffer: Option<Buffer>) -> Option<Buffer> {
        let (there, index) = self.find(page);
        let mut buffers = self.buffers.take().map_or_else(Vec::new, |old| old.to_vec());
        let before = if there { Some(buffers.remove(index)) } else { None };
        let bit = 1_u128 << (page as usize % GROUP);
        self.there &= !bit;
        if let Some(buffer) = buffer {
            buffers.insert(index, buffer);
            self.there |= bit;
        }
        self.buffers = (!buffers.is_empty()).then(|| buffers.into());
        before
    }
}

/// Memory of zeros for at least so many bytes.
pub(crate) fn zeroed(bytes: usize) -> Buffer {
    std::iter::repeat_n(Line::ZERO, bytes.div_ceil(Line::BYTES)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edition_keeps_nothing_and_knows_changes() {
        let mut table = Table::new(3);
        let page = zeroed(1);
        table.set(1, Some(page.clone()));
        let (edition, clone) = (table.edition(), table.clone());
        assert!(table.is_of(&edition) && clone.is_of(&edition));
        table.set(2, Some(zeroed(1)));
        assert!(!table.is_of(&edition) && clone.is_of(&edition));
        drop((clone, table.set(1, None)));
        assert_eq!(Arc::strong_count(&page), 1);
        let edition = table.edition();
        table.set(2, None);
        assert!(!table.is_of(&edition), "also where nobody else had it");
    }

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

    /// Against a plain vector, over groups that fill and empty.
    #[test]
    fn a_table_is_a_vector_of_pages_that_may_be_missing() {
        let pages = 300_u32;
        let (mut table, mut oracle) = (Table::new(pages as usize), vec![None; pages as usize]);
        let mut state = 1_u32;
        for step in 0..3000_u32 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let page = (state >> 8) % (pages + 5);
            let put = (state >> 28) < 9;
            let buffer = put
                .then(|| Table::resident(std::iter::once(&step.to_le_bytes()[..]), 0).set(0, None))
                .flatten();
            let before = table.set(page, buffer).map(|b| bytemuck::cast_slice::<Line, u32>(&b)[0]);
            let slot = oracle.get_mut(page as usize);
            assert_eq!(before, slot.and_then(|s| std::mem::replace(s, put.then_some(step))));
        }
        for page in 0..pages + 200 {
            let number = table.page(page).map(|b| bytemuck::cast_slice::<u8, u32>(b)[0]);
            assert_eq!(number, oracle.get(page as usize).copied().flatten(), "page {page}");
        }
        let numbers = (0..pages).filter(|&page| oracle[page as usize].is_some());
        assert!(table.present().eq(numbers));
        let there = oracle.iter().flatten().count();
        assert!(there > 100 && table.bytes() == there * 64);
    }
}
