//! Pages on a device: a cache in its buffers, within what memory there is, over the pages of a scene in memory or in a store.
//!
//! As in the thesis of K. Garanzha (2013, 6.5): kernels find a page through a table, ask for what is not there by an atomic
//! operation, and count uses; between passes the pages are sorted by what they deserve, on the device, and those that are asked for take
//! the places of those used least. What is to come is gathered, sent as one block, and copied to its places. Deviations: pages that
//! are asked for are ordered by who asks, the path with the least number first, which is why it ends (`page/plan.rs`).
//!
//! A kind of pages has slots of one size. The pool is two buffers at most, each as large as a binding may be; no slot lies in both.

mod plan;

pub use plan::Plan;

use crate::error::GpuError;
use crate::kernel::{Kernel, device_struct, kernel};
use crate::limits::WORKGROUPS_PER_AXIS;
use crate::primitives::GROUP;
use crate::recording::{Buffer, Groups, Recording, Resident};
use crate::run::Executor;
use serde::Serialize;
use vastlight_transport::words::ScenePages;
use vastlight_transport::words::pages::{KINDS, PageKind};

/// Words of a page in the table: where it is, who asks for it, its uses.
pub(crate) const PAGE_WORDS: usize = 3;
/// In the table: not there, or nobody.
const NONE: u32 = u32::MAX;
/// Uses are counted up to this; pages with so many cost no more atomic operations.
pub(crate) const MOST_USES: u32 = 31;
/// Uses are forgotten after so many swaps, as published.
const FORGET_AFTER: u32 = 10;
/// Bytes that are sent at once: a part of the scene within bounds.
const STAGING_BYTES: std::ops::RangeInclusive<u64> = 1 << 18..=4 << 20;
const STAGING_PART: u64 = 8;
/// Bytes of a page while pages are sorted.
const SORTING_BYTES: u64 = 48;

device_struct! {
    struct EnterParameters as "Parameters" { count, uses }
}
kernel!(pub(crate) ENTER = "page_enter", EnterParameters, 2);

/// Every kernel of this module.
pub(crate) static KERNELS: [&Kernel; 3] = [&plan::KEYS, &plan::PLAN, &ENTER];

/// What paging did so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct PageStats {
    /// All pages: geometry, attributes, tiles of textures.
    pub pages: u64,
    /// Their bytes, each in a slot.
    pub all_bytes: u64,
    /// Slots on the device.
    pub slots: u64,
    /// Their bytes.
    pub slot_bytes: u64,
    /// Passes after which some rays or paths waited for pages.
    pub waits: u64,
    /// Pages that were brought, those at the start included.
    pub brought: u64,
    /// Their bytes.
    pub brought_bytes: u64,
}

/// The pages of a scene on a device.
#[derive(Debug)]
pub struct DevicePages {
    kinds: [PageKind; KINDS],
    /// By kind: how many slots there are, and the words of the pool where free ones begin.
    slots: [u32; KINDS],
    free: [Vec<u32>; KINDS],
    /// By page: where it is.
    places: Vec<u32>,
    pool: [Resident; 2],
    table: Resident,
    swaps: u32,
    /// Whether the last swap brought nothing.
    nothing_came: bool,
    stats: PageStats,
}

/// The pool and the table in a recording.
#[derive(Clone, Copy, Debug)]
pub struct PageBuffers {
    /// The two buffers of the pool.
    pub pool: [Buffer; 2],
    /// The table.
    pub table: Buffer,
}

impl DevicePages {
    /// Makes room for the pages on a device, for all of them if there is memory for so many, else for as many as there is memory for
    /// beside what it takes to bring them; and brings what fits. Some kernels see only one buffer of the pool.
    ///
    /// # Errors
    /// There is less memory than one path may need at once, or a page cannot be had.
    pub fn new(
        executor: &mut Executor,
        pages: &mut ScenePages<'_>,
        one_buffer: bool,
    ) -> Result<Self, GpuError> {
        let kinds = *pages.kinds();
        let count = count_of(&kinds);
        let table = executor.keep("table of pages", &vec![NONE; (PAGE_WORDS * count as usize).max(1)])?;
        let working = executor.allocate("bringing pages", working_bytes(&kinds));
        let working = working.inspect_err(|_| executor.release(table))?;
        let made = Self::pool(executor, &kinds, one_buffer);
        executor.release(working);
        let (layout, pool) = made.inspect_err(|_| executor.release(table))?;
        let stats = PageStats {
            pages: count,
            all_bytes: all_bytes(&kinds),
            slots: layout.slots.iter().map(|&slots| u64::from(slots)).sum(),
            slot_bytes: layout.bytes(&kinds),
            ..PageStats::default()
        };
        let Layout { slots, free, .. } = layout;
        let places = vec![NONE; count as usize];
        let mut made = Self { kinds, slots, free, places, pool, table, swaps: 0, nothing_came: false, stats };
        let done = made.fill(executor, pages);
        done.inspect_err(|_| made.release(executor)).map(|()| made)
    }

    /// What it takes to have all pages on a device.
    #[must_use]
    pub fn bytes_for_all(pages: &ScenePages<'_>) -> u64 {
        let kinds = pages.kinds();
        // Sizes are rounded up.
        (all_bytes(kinds) + working_bytes(kinds) + 4 * PAGE_WORDS as u64 * count_of(kinds)) / 4 * 5
    }

    /// The largest pool that memory allows, and its slots.
    fn pool(
        executor: &mut Executor,
        kinds: &[PageKind; KINDS],
        one_buffer: bool,
    ) -> Result<(Layout, [Resident; 2]), GpuError> {
        let binding = executor.binding_bytes() / 4;
        let least = least_words(kinds);
        let (bindings, free) = (if one_buffer { 1 } else { 2 }, executor.free_bytes() / 4);
        let mut words = (all_bytes(kinds) / 4).min(free);
        loop {
            let layout = Layout::new(kinds, words, binding, bindings);
            let refused = GpuError::OutOfMemory {
                what: "what one path needs of the scene".to_owned(),
                wanted_bytes: 4 * least,
                held_bytes: executor.held_bytes(),
            };
            let layout = layout.ok_or(refused)?;
            match Self::allocate(executor, layout.words) {
                Ok(pool) => return Ok((layout, pool)),
                Err(GpuError::OutOfMemory { .. }) if words > least => words = words / 16 * 15,
                Err(error) => return Err(error),
            }
        }
    }

    fn allocate(executor: &mut Executor, words: [u64; 2]) -> Result<[Resident; 2], GpuError> {
        let first = executor.allocate("pages", 4 * words[0])?;
        let second = executor.allocate("further pages", 4 * words[1]);
        Ok([first, second.inspect_err(|_| executor.release(first))?])
    }

    /// Brings the first pages of each kind, as many as there are slots.
    fn fill(&mut self, executor: &mut Executor, pages: &mut ScenePages<'_>) -> Result<(), GpuError> {
        let first = |kind: usize| self.kinds[kind].first..self.kinds[kind].first + self.slots[kind];
        let wanted: Vec<u32> = (0..KINDS).flat_map(first).collect();
        self.bring(executor, pages, (&wanted, Vec::new()))
    }

    /// Whether all pages are there.
    #[must_use]
    pub fn has_all(&self) -> bool {
        self.kinds.iter().zip(self.slots).all(|(kind, slots)| slots == kind.pages)
    }

    /// What it did so far.
    #[must_use]
    pub fn stats(&self) -> PageStats {
        self.stats
    }

    /// The pool and the table for a recording.
    #[must_use]
    pub fn buffers(&self, recording: &mut Recording) -> PageBuffers {
        let [first, second] = self.pool;
        PageBuffers {
            pool: [recording.resident("pages", first), recording.resident("further pages", second)],
            table: recording.resident("table of pages", self.table),
        }
    }

    /// Gives its memory back.
    pub fn release(&self, executor: &mut Executor) {
        let all = [self.pool[0], self.pool[1], self.table];
        all.into_iter().for_each(|resident| executor.release(resident));
    }

    fn kind_of(&self, page: u32) -> usize {
        self.kinds.iter().rposition(|kind| kind.pages > 0 && kind.first <= page).unwrap_or(0)
    }

    /// Brings pages that are not there to free slots; the first block takes the changes of the table along that have to be made.
    fn bring(
        &mut self,
        executor: &mut Executor,
        pages: &mut ScenePages<'_>,
        (wanted, mut changes): (&[u32], Vec<[u32; 2]>),
    ) -> Result<(), GpuError> {
        let (mut rest, staging) = (wanted, staging_bytes(&self.kinds));
        while !rest.is_empty() {
            let mut bytes = 0;
            let fits = |page: &&u32| {
                bytes += 4 * words_of_slot(&self.kinds[self.kind_of(**page)]);
                bytes <= staging
            };
            let together = rest.iter().take_while(fits).count().clamp(1, MOST_TOGETHER);
            let (now, later) = rest.split_at(together);
            self.send(executor, pages, (now, std::mem::take(&mut changes)))?;
            rest = later;
        }
        Ok(())
    }

    /// Sends pages as one block, and copies them to their places.
    fn send(
        &mut self,
        executor: &mut Executor,
        pages: &mut ScenePages<'_>,
        (wanted, mut changes): (&[u32], Vec<[u32; 2]>),
    ) -> Result<(), GpuError> {
        let (mut block, mut copies) = (Vec::new(), Vec::new());
        pages.read(wanted, &mut |page, bytes| {
            let first = block.len();
            block.extend_from_slice(bytes);
            block.resize(block.len().next_multiple_of(4), 0);
            copies.push((page, first, block.len() - first));
        })?;
        self.stats.brought += copies.len() as u64;
        self.stats.brought_bytes += block.len() as u64;
        let mut recording = Recording::new();
        let PageBuffers { pool, table } = self.buffers(&mut recording);
        let block = recording.upload("block of pages", &block);
        let split = self.pool[0].bytes / 4;
        for (page, first, bytes) in copies {
            debug_assert!(bytes as u64 <= 4 * words_of_slot(&self.kinds[self.kind_of(page)]));
            let Some(place) = self.free[self.kind_of(page)].pop() else { continue };
            let (to, at) = match u64::from(place).checked_sub(split) {
                None => (pool[0], place.into()),
                Some(beyond) => (pool[1], beyond),
            };
            recording.copy_to((block, first as u64 / 4), (to, at), bytes as u64 / 4);
            self.places[page as usize] = place;
            changes.push([page, place]);
        }
        let count = changes.len() as u32;
        let parameters = EnterParameters { count, uses: if self.has_all() { MOST_USES } else { 1 } };
        let changes = recording.upload("changes of the table", &changes);
        recording.dispatch(&ENTER, &parameters, &[table, changes], Groups::Direct(count.div_ceil(GROUP)));
        executor.run(&recording).map(|_| ())
    }
}

/// Pages that are sent at once at most: with as many that leave one dispatch.
const MOST_TOGETHER: usize = (WORKGROUPS_PER_AXIS * GROUP / 2) as usize;

fn staging_bytes(kinds: &[PageKind; KINDS]) -> u64 {
    (all_bytes(kinds) / STAGING_PART).clamp(*STAGING_BYTES.start(), *STAGING_BYTES.end())
}

/// What it takes to sort pages and to bring some.
fn working_bytes(kinds: &[PageKind; KINDS]) -> u64 {
    staging_bytes(kinds) + SORTING_BYTES * count_of(kinds)
}

fn words_of_slot(kind: &PageKind) -> u64 {
    u64::from(kind.slot_bytes).div_ceil(4)
}

fn count_of(kinds: &[PageKind; KINDS]) -> u64 {
    kinds.iter().map(|kind| u64::from(kind.pages)).sum()
}

/// Bytes of all pages, each in a slot.
fn all_bytes(kinds: &[PageKind; KINDS]) -> u64 {
    kinds.iter().map(|kind| 4 * u64::from(kind.pages) * words_of_slot(kind)).sum()
}

/// Words of as many slots as one path may need.
fn least_words(kinds: &[PageKind; KINDS]) -> u64 {
    kinds.iter().map(|kind| u64::from(kind.least) * words_of_slot(kind)).sum()
}

/// Where slots are.
struct Layout {
    slots: [u32; KINDS],
    free: [Vec<u32>; KINDS],
    /// Of the two buffers.
    words: [u64; 2],
}

impl Layout {
    /// Slots in a pool of so many words: what a path needs of each kind, and the rest shared out by the sizes of the kinds. None if it is
    /// too small for the first.
    fn new(kinds: &[PageKind; KINDS], words: u64, binding: u64, bindings: usize) -> Option<Self> {
        // A slot may not fit into the rest of the first buffer.
        let longest = kinds.iter().map(words_of_slot).max().unwrap_or(0);
        let most = if bindings > 1 { (2 * binding).saturating_sub(longest) } else { binding };
        let words = words.min(most).min(NONE.into());
        let (all, least) = (all_bytes(kinds) / 4, least_words(kinds));
        let rest = words.checked_sub(least)?;
        let share = |kind: &PageKind| {
            if words >= all {
                return kind.pages;
            }
            let more = u64::from(kind.pages - kind.least) * rest / (all - least).max(1);
            kind.least + more as u32
        };
        let mut layout = Self { slots: kinds.each_ref().map(share), free: Default::default(), words: [0; 2] };
        let (mut at, mut end) = (0_u64, binding);
        for (number, kind) in kinds.iter().enumerate() {
            let (words, mut made) = (words_of_slot(kind), Vec::new());
            for _ in 0..layout.slots[number] {
                if at + words > end && end == binding && bindings > 1 {
                    (layout.words[0], at, end) = (at, at, at + binding);
                }
                if at + words > end.min(NONE.into()) {
                    break;
                }
                made.push(at as u32);
                at += words;
            }
            if made.len() < kind.least as usize {
                return None;
            }
            layout.slots[number] = made.len() as u32;
            // The last is taken first.
            made.reverse();
            layout.free[number] = made;
        }
        let first = if layout.words[0] == 0 { at } else { layout.words[0] };
        layout.words = [first.max(1), (at - first).max(1)];
        Some(layout)
    }

    fn bytes(&self, kinds: &[PageKind; KINDS]) -> u64 {
        kinds.iter().zip(self.slots).map(|(kind, slots)| 4 * u64::from(slots) * words_of_slot(kind)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kinds() -> [PageKind; KINDS] {
        let kind = |pages, slot_bytes, least| PageKind { first: 0, pages, slot_bytes, least };
        [kind(40, 65_536, 1), kind(300, 4096, 16), kind(100, 4000, 1), kind(7, 4096, 7)]
    }

    #[test]
    fn slots_do_not_overlap_nor_lie_in_both_buffers() {
        let all = all_bytes(&kinds()) / 4;
        for (words, binding) in [(all, 1 << 20), (all, all / 2), (all / 3, all / 4), (all / 20, all)] {
            let layout = Layout::new(&kinds(), words, binding, 2).expect("enough");
            let mut taken: Vec<(u64, u64)> = Vec::new();
            for (kind, places) in kinds().iter().zip(&layout.free) {
                assert!(places.len() as u32 >= kind.least && places.len() as u32 <= kind.pages);
                taken.extend(places.iter().map(|&p| (p.into(), u64::from(p) + words_of_slot(kind))));
            }
            taken.sort_unstable();
            assert!(taken.windows(2).all(|pair| pair[0].1 <= pair[1].0));
            let [first, second] = layout.words;
            assert!(taken.iter().all(|&(start, end)| end <= first || start >= first));
            assert!(taken.last().is_some_and(|last| last.1 <= first + second));
            assert!(first <= binding && second <= binding && taken.len() > 10);
        }
    }

    #[test]
    fn what_fits_has_all_its_slots_and_too_little_is_refused() {
        let all = all_bytes(&kinds()) / 4;
        let whole = Layout::new(&kinds(), all, all, 1).expect("enough");
        assert_eq!(whole.slots, [40, 300, 100, 7]);
        let least = least_words(&kinds());
        let small = Layout::new(&kinds(), least, all, 1).expect("just enough");
        assert_eq!(small.slots, [1, 16, 1, 7]);
        assert!(Layout::new(&kinds(), least - 1, all, 1).is_none());
        assert!(Layout::new(&kinds(), all, least / 2, 1).is_none());
    }
}
