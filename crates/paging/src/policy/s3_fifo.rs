//! S3-FIFO (Yang, Zhang, Qiu, Yue and Rashmi 2023, "FIFO Queues are All You Need for Cache Eviction"): new pages wait in
//! a small queue, a tenth of the slots; those that are used again there move to the main queue, the others leave and are
//! remembered for a while; a page that comes back while it is remembered goes to the main queue at once. There, a page
//! goes round once more for each use, up to three.
//!
//! Deviations: pages in use are passed over; a use by the pass that asked for a page is not counted, because every page
//! has it.

use super::Policy;
use std::collections::{BTreeMap, VecDeque};

/// Most uses that are counted.
const MOST_USES: u8 = 3;

/// Slots for each slot of the small queue.
const SMALL_PART: usize = 10;

#[derive(Clone, Copy, Debug)]
struct Resident {
    page: u32,
    uses: u8,
    /// The next use is that of the pass that asked.
    fresh: bool,
    /// Pages that had been asked for when it came; 0 if nobody asked for it.
    came: u64,
}

/// See the module.
#[derive(Debug)]
pub struct S3Fifo {
    slots: usize,
    /// By slot.
    residents: Vec<Option<Resident>>,
    small: VecDeque<u32>,
    main: VecDeque<u32>,
    /// Pages that left the small queue, and when.
    ghosts: BTreeMap<u32, u64>,
    /// The same in the order in which they left; some came back since.
    left: VecDeque<(u32, u64)>,
    clock: u64,
    /// Pages that were asked for.
    asked: u64,
}

impl S3Fifo {
    /// A policy for so many slots.
    #[must_use]
    pub fn new(slots: usize) -> Self {
        Self {
            slots,
            residents: Vec::new(),
            small: VecDeque::new(),
            main: VecDeque::new(),
            ghosts: BTreeMap::new(),
            left: VecDeque::new(),
            clock: 0,
            asked: 0,
        }
    }

    fn remember(&mut self, page: u32) {
        self.clock += 1;
        self.ghosts.insert(page, self.clock);
        self.left.push_back((page, self.clock));
        while self.left.len() > self.slots {
            let Some((page, time)) = self.left.pop_front() else { return };
            if self.ghosts.get(&page) == Some(&time) {
                self.ghosts.remove(&page);
            }
        }
    }

    fn uses(&self, slot: u32) -> u8 {
        self.residents[slot as usize].map_or(0, |resident| resident.uses)
    }

    /// Looks at the oldest page of the small queue: it leaves, moves up, or stays if it may not leave.
    fn step_small(&mut self, may_leave: &dyn Fn(u32) -> bool) -> Option<u32> {
        let slot = self.small.pop_front()?;
        if self.uses(slot) > 0 {
            self.main.push_back(slot);
        } else if may_leave(slot) {
            return Some(slot);
        } else {
            self.small.push_back(slot);
        }
        None
    }

    /// Looks at the oldest page of the main queue: it leaves, or goes round once more.
    fn step_main(&mut self, may_leave: &dyn Fn(u32) -> bool) -> Option<u32> {
        let slot = self.main.pop_front()?;
        let free = may_leave(slot);
        match &mut self.residents[slot as usize] {
            Some(resident) if resident.uses > 0 => resident.uses -= u8::from(free),
            _ if free => return Some(slot),
            _ => {}
        }
        self.main.push_back(slot);
        None
    }

    fn leave(&mut self, slot: u32, from_small: bool) {
        if let Some(resident) = self.residents[slot as usize].take().filter(|_| from_small) {
            self.remember(resident.page);
        }
    }

    /// One page to lose, if there is one.
    fn choose(&mut self, may_leave: &dyn Fn(u32) -> bool) -> Option<u32> {
        // Every page may have to go round as often as it has uses, and once more to leave.
        let mut small_left = self.small.len();
        for _ in 0..small_left + (self.main.len() + small_left) * (usize::from(MOST_USES) + 1) {
            let from_small =
                small_left > 0 && (self.small.len() * SMALL_PART > self.slots || self.main.is_empty());
            let slot = if from_small {
                small_left -= 1;
                self.step_small(may_leave)
            } else {
                self.step_main(may_leave)
            };
            if let Some(slot) = slot {
                self.leave(slot, from_small);
                return Some(slot);
            }
        }
        self.choose_any(may_leave)
    }

    /// The oldest page of the small queue, if it was not used again, and nobody asked for it or that is long ago.
    fn choose_cold(&mut self, may_leave: &dyn Fn(u32) -> bool) -> Option<u32> {
        let slot = *self.small.front()?;
        let resident = self.residents[slot as usize]?;
        let old = resident.came == 0 || self.asked - resident.came >= self.slots as u64 / 2;
        if resident.uses > 0 || !old || !may_leave(slot) {
            return None;
        }
        self.small.pop_front();
        self.leave(slot, true);
        Some(slot)
    }

    /// The main queue has nothing to lose: whatever there is in the small one.
    fn choose_any(&mut self, may_leave: &dyn Fn(u32) -> bool) -> Option<u32> {
        let place = self.small.iter().position(|&slot| may_leave(slot))?;
        let slot = self.small.remove(place)?;
        self.leave(slot, true);
        Some(slot)
    }
}

impl Policy for S3Fifo {
    fn insert(&mut self, slot: u32, page: u32, askers: u32) {
        if self.residents.len() <= slot as usize {
            self.residents.resize(slot as usize + 1, None);
        }
        self.asked += u64::from(askers > 0);
        let came = if askers > 0 { self.asked } else { 0 };
        self.residents[slot as usize] = Some(Resident { page, uses: 0, fresh: askers > 0, came });
        let known = self.ghosts.remove(&page).is_some();
        if known { self.main.push_back(slot) } else { self.small.push_back(slot) }
    }

    fn touch(&mut self, slot: u32) {
        if let Some(Some(resident)) = self.residents.get_mut(slot as usize) {
            resident.uses = (resident.uses + u8::from(!resident.fresh)).min(MOST_USES);
            resident.fresh = false;
        }
    }

    fn evict(&mut self, count: usize, cold_only: bool, may_leave: &dyn Fn(u32) -> bool, out: &mut Vec<u32>) {
        for _ in 0..count {
            let slot = if cold_only { self.choose_cold(may_leave) } else { self.choose(may_leave) };
            let Some(slot) = slot else { return };
            out.push(slot);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn evict(policy: &mut S3Fifo, count: usize) -> Vec<u32> {
        let mut out = Vec::new();
        policy.evict(count, false, &|slot| slot != 9, &mut out);
        out
    }

    #[test]
    fn new_pages_leave_first_unless_they_are_used_again_or_known() {
        let mut policy = S3Fifo::new(10);
        for slot in 0..10 {
            policy.insert(slot, slot + 100, 1);
            policy.touch(slot);
        }
        policy.touch(1);
        assert_eq!(
            evict(&mut policy, 3),
            [0, 2, 3],
            "1 was used by another pass than that which asked for it"
        );
        policy.insert(0, 102, 1);
        policy.insert(2, 200, 1);
        assert_eq!(policy.main, [1, 0], "102 is known");
        assert_eq!(evict(&mut policy, 9), [4, 5, 6, 7, 8, 2, 0, 1], "9 may not leave; 1 goes round once");
        assert_eq!(evict(&mut policy, 9), [0; 0]);
        assert!(policy.ghosts.len() <= 10 && policy.small == [9]);
    }

    #[test]
    fn hints_take_what_nobody_used_again() {
        let mut policy = S3Fifo::new(10);
        // The first was asked for long ago, the second was read ahead, the third too and then used.
        (0..10).for_each(|slot| policy.insert(slot, slot, u32::from(slot != 1 && slot != 2)));
        policy.touch(2);
        let mut out = Vec::new();
        policy.evict(9, true, &|_| true, &mut out);
        assert_eq!(out, [0, 1], "not past one that is used");
    }
}
