//! What a cache knows: its slots, the pages in them, and who waits for which.

use super::batch::Waiting;
use super::config::CacheConfig;
use super::error::PageError;
use super::stats::CacheStats;
use crate::directory::Directory;
use crate::policy::Policy;
use crate::table::{Buffer, Table};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;

/// No slot, or no page.
pub(super) const NONE: u32 = u32::MAX;

/// What is in a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// Nothing. Nobody reads its memory.
    Free,
    /// A thread fills it, and has its memory.
    Filling,
    /// A page of the table.
    There,
    /// A page that left the table. Snapshots may still read it.
    GivenUp,
}

#[derive(Debug)]
struct Slot {
    stage: Stage,
    page: u32,
    /// Batches that keep the page.
    pins: u32,
    /// None before the first use, and while it is filled.
    buffer: Option<Buffer>,
}

/// A slot to be filled with a page.
#[derive(Debug)]
pub(super) struct Claim {
    pub(super) page: u32,
    pub(super) slot: u32,
    /// None before the first use.
    pub(super) buffer: Option<Buffer>,
    /// Somebody asked for the page; else it was read ahead.
    pub(super) demanded: bool,
}

/// All of it is behind one lock.
#[derive(Debug)]
pub(super) struct State {
    /// The published table.
    pub(super) table: Table,
    /// Pages that somebody waits for and no thread reads yet, by their place in the file.
    pub(super) wanted: BTreeSet<(u64, u32)>,
    /// Pages that might be wanted.
    pub(super) hinted: VecDeque<u32>,
    /// Where the last read ended: reads go through the file in one direction, and begin anew at its end.
    pub(super) head: u64,
    pub(super) stats: CacheStats,
    pub(super) closed: bool,
    /// By batch number.
    pub(super) batches: Vec<Option<Waiting>>,
    /// Pages that are wanted or read, and the batches that wait for them.
    requests: BTreeMap<u32, Vec<usize>>,
    slots: Vec<Slot>,
    most_slots: usize,
    /// By page: its slot, if it is not [`Stage::Free`].
    slot_of_page: Vec<u32>,
    free: Vec<u32>,
    /// Slots that were given up, the oldest first; some are not any more.
    given_up: VecDeque<u32>,
    /// Number of slots that are given up.
    given_up_now: usize,
    policy: Box<dyn Policy>,
}

impl State {
    pub(super) fn new(config: &CacheConfig, pages: usize) -> Self {
        Self {
            table: Table::new(pages),
            wanted: BTreeSet::new(),
            hinted: VecDeque::new(),
            head: 0,
            stats: CacheStats::default(),
            closed: false,
            batches: Vec::new(),
            requests: BTreeMap::new(),
            slots: Vec::new(),
            most_slots: config.slots,
            slot_of_page: vec![NONE; pages],
            free: Vec::new(),
            given_up: VecDeque::new(),
            given_up_now: 0,
            policy: config.policy.make(config.slots),
        }
    }

    fn slot_of(&self, page: u32) -> Option<u32> {
        self.slot_of_page.get(page as usize).copied().filter(|&slot| slot != NONE)
    }

    /// True if nothing was done yet to have the page.
    pub(super) fn is_absent(&self, page: u32) -> bool {
        self.slot_of(page).is_none() && !self.requests.contains_key(&page)
    }

    /// Pins a page for a batch: at once if it is there, else the batch waits for it.
    pub(super) fn ask(&mut self, batch: usize, page: u32, directory: &Directory) {
        let slot = self.slot_of(page).filter(|&slot| self.slots[slot as usize].stage != Stage::Filling);
        if let Some(slot) = slot {
            if self.slots[slot as usize].stage == Stage::GivenUp {
                self.revive(slot);
            }
            self.slots[slot as usize].pins += 1;
            self.pin(batch, page);
            return;
        }
        self.stats.misses += 1;
        if self.is_absent(page) {
            let offset = directory.get(page).map_or(0, |entry| entry.offset);
            self.wanted.insert((offset, page));
        }
        self.requests.entry(page).or_default().push(batch);
        if let Some(Some(waiting)) = self.batches.get_mut(batch) {
            waiting.missing += 1;
        }
    }

    fn pin(&mut self, batch: usize, page: u32) {
        if let Some(Some(waiting)) = self.batches.get_mut(batch) {
            waiting.pins.push(page);
        }
    }

    /// Puts a page that was given up back into the table: its memory is as it was.
    fn revive(&mut self, slot: u32) {
        let found = &mut self.slots[slot as usize];
        found.stage = Stage::There;
        self.table.set(found.page, found.buffer.clone());
        self.policy.insert(slot, found.page, 1);
        self.given_up_now -= 1;
        self.stats.misses += 1;
        self.stats.pages_revived += 1;
        self.stats.resident_pages += 1;
    }

    /// Pages that a batch waits for.
    pub(super) fn missing(&self, batch: usize) -> usize {
        self.batches[batch].as_ref().map_or(0, |waiting| waiting.missing)
    }

    /// Whether a batch waits for this page.
    pub(super) fn awaits(&self, batch: usize, page: u32) -> bool {
        self.requests.get(&page).is_some_and(|askers| askers.contains(&batch))
    }

    /// Why a batch will not get a page.
    pub(super) fn failure(&self, batch: usize) -> Option<&PageError> {
        self.batches[batch].as_ref()?.failure.as_ref()
    }

    /// Lets go of the pages that a batch keeps, and of those that it waits for: they may still come, but for nobody.
    pub(super) fn forget(&mut self, batch: usize) {
        self.unpin(batch);
        if let Some(Some(waiting)) = self.batches.get_mut(batch) {
            (waiting.missing, waiting.failure) = (0, None);
        }
        for askers in self.requests.values_mut() {
            askers.retain(|&asker| asker != batch);
        }
    }

    /// Lets go of the pages that a batch keeps.
    pub(super) fn unpin(&mut self, batch: usize) {
        let Some(Some(waiting)) = self.batches.get_mut(batch) else { return };
        for page in std::mem::take(&mut waiting.pins) {
            if let Some(slot) = self.slot_of(page) {
                self.slots[slot as usize].pins -= 1;
            }
        }
    }

    /// Takes account of a use of a page.
    pub(super) fn used(&mut self, page: u32) {
        let Some(slot) = self.slot_of(page) else { return };
        if self.slots[slot as usize].stage == Stage::There {
            self.policy.touch(slot);
            self.stats.hits += 1;
        }
    }

    /// Makes room for `need` pages as far as possible at once; gives how many have room. If `cold_only`, no page
    /// leaves for it that was used lately.
    pub(super) fn make_room(&mut self, need: usize, cold_only: bool) -> usize {
        self.reclaim(need);
        let coming = self.room() + self.given_up_now;
        if coming < need {
            self.give_up(need - coming, cold_only);
            self.reclaim(need);
        }
        self.room().min(need)
    }

    /// Slots that can be filled at once.
    fn room(&self) -> usize {
        self.free.len() + (self.most_slots - self.slots.len())
    }

    /// Takes pages out of the table.
    fn give_up(&mut self, count: usize, cold_only: bool) {
        let mut leaving = Vec::new();
        let slots = &self.slots;
        self.policy.evict(count, cold_only, &|slot| slots[slot as usize].pins == 0, &mut leaving);
        for slot in leaving {
            let found = &mut self.slots[slot as usize];
            found.stage = Stage::GivenUp;
            self.table.set(found.page, None);
            self.given_up.push_back(slot);
            self.given_up_now += 1;
            self.stats.evictions += 1;
            self.stats.resident_pages -= 1;
        }
    }

    /// Frees slots that were given up and that no snapshot holds any more, until there is room for `need` pages.
    fn reclaim(&mut self, need: usize) {
        for _ in 0..self.given_up.len() {
            if self.room() >= need {
                return;
            }
            let Some(slot) = self.given_up.pop_front() else { return };
            let found = &mut self.slots[slot as usize];
            if found.stage != Stage::GivenUp {
                continue;
            }
            if found.buffer.as_mut().is_some_and(|buffer| Arc::get_mut(buffer).is_none()) {
                self.given_up.push_back(slot);
                continue;
            }
            self.given_up_now -= 1;
            self.release(slot);
        }
    }

    /// Makes a slot free.
    fn release(&mut self, slot: u32) {
        let found = &mut self.slots[slot as usize];
        self.slot_of_page[found.page as usize] = NONE;
        (found.stage, found.page, found.pins) = (Stage::Free, NONE, 0);
        self.free.push(slot);
    }

    /// Gives a slot to a page that has none. There must be room.
    pub(super) fn claim(&mut self, page: u32, demanded: bool) -> Option<Claim> {
        if self.free.is_empty() && self.slots.len() < self.most_slots {
            self.free.push(self.slots.len() as u32);
            self.slots.push(Slot { stage: Stage::Free, page: NONE, pins: 0, buffer: None });
        }
        let place = self.slot_of_page.get_mut(page as usize)?;
        let slot = self.free.pop()?;
        *place = slot;
        let found = &mut self.slots[slot as usize];
        (found.stage, found.page) = (Stage::Filling, page);
        Some(Claim { page, slot, buffer: found.buffer.take(), demanded })
    }

    /// Puts a page that was read into the table and wakes whoever has all of its pages now.
    pub(super) fn arrive(&mut self, claim: Claim) {
        let askers = self.requests.remove(&claim.page).unwrap_or_default();
        let slot = &mut self.slots[claim.slot as usize];
        (slot.stage, slot.pins) = (Stage::There, askers.len() as u32);
        slot.buffer.clone_from(&claim.buffer);
        self.table.set(claim.page, claim.buffer);
        self.policy.insert(claim.slot, claim.page, askers.len() as u32);
        self.stats.pages_read += 1;
        self.stats.pages_ahead += u64::from(!claim.demanded);
        self.stats.resident_pages += 1;
        for batch in askers {
            self.pin(batch, claim.page);
            self.settle(batch, None);
        }
    }

    /// Frees the slot of a page that could not be read and tells whoever waits for it.
    pub(super) fn fail(&mut self, claim: Claim, error: &PageError) {
        let askers = self.requests.remove(&claim.page).unwrap_or_default();
        self.slots[claim.slot as usize].buffer = claim.buffer;
        self.release(claim.slot);
        self.stats.failures += 1;
        for batch in askers {
            self.settle(batch, Some(error));
        }
    }

    /// One page less to wait for.
    fn settle(&mut self, batch: usize, error: Option<&PageError>) {
        let Some(Some(waiting)) = self.batches.get_mut(batch) else { return };
        if waiting.failure.is_none() {
            waiting.failure = error.cloned();
        }
        waiting.missing -= 1;
        // The page may be the first, for which the batch waits in any case.
        waiting.arrived.notify_one();
    }

    /// Wakes all who wait: the cache is gone.
    pub(super) fn close(&mut self) {
        self.closed = true;
        for waiting in self.batches.iter().flatten() {
            waiting.arrived.notify_one();
        }
    }

    /// What was done so far.
    pub(super) fn stats(&self, slot_bytes: usize) -> CacheStats {
        CacheStats { peak_bytes: self.slots.len() * slot_bytes, ..self.stats }
    }

    /// Finds what contradicts itself.
    #[cfg(test)]
    pub(super) fn validate(&self) -> Result<(), String> {
        let mut kept = vec![0_u32; self.slot_of_page.len()];
        let pins = self.batches.iter().flatten().flat_map(|waiting| &waiting.pins);
        pins.for_each(|&page| kept[page as usize] += 1);
        let count = |stage| self.slots.iter().filter(|slot| slot.stage == stage).count();
        if count(Stage::Free) != self.free.len() || count(Stage::GivenUp) != self.given_up_now {
            return Err("free slots or those given up are miscounted".into());
        }
        if count(Stage::There) != self.stats.resident_pages || self.slots.len() > self.most_slots {
            return Err("resident pages are miscounted, or there are too many slots".into());
        }
        for (number, slot) in self.slots.iter().enumerate().filter(|(_, slot)| slot.stage != Stage::Free) {
            let page = slot.page as usize;
            let there = slot.stage == Stage::There;
            let right = self.slot_of_page[page] == number as u32
                && self.table.page(slot.page).is_some() == there
                && slot.pins == kept[page]
                && (there || slot.pins == 0);
            if !right {
                return Err(format!("slot {number}: {:?} of page {page}, {} pins", slot.stage, slot.pins));
            }
        }
        let resident = (0..kept.len() as u32).filter(|&page| self.table.page(page).is_some()).count();
        if resident != self.stats.resident_pages {
            return Err("the table has other pages than the slots".into());
        }
        Ok(())
    }
}
