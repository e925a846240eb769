//! LRU-2 (O'Neil, O'Neil and Weikum 1993, "The LRU-K Page Replacement Algorithm for Database Disk Buffering"): that page
//! leaves whose last use but one lies farthest back. Pages that were used once only leave before all others, the longest
//! unused first; so a sweep over pages that nobody wants twice drives out nothing that is wanted often.
//!
//! The time of the last use of pages that left is remembered, for as many pages as there are slots. Time is counted in
//! uses of pages; uses that follow each other within a small part of a turnover of the cache are one (the paper's
//! correlated references).

use super::Policy;
use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// Last use but one (0: none), last use.
type Times = (u64, u64);

#[derive(Clone, Copy, Debug)]
struct Resident {
    page: u32,
    times: Times,
    /// The next use is that of the pass that asked, and was counted when the page came.
    fresh: bool,
}

/// See the module.
#[derive(Debug)]
pub struct LruK {
    slots: usize,
    clock: u64,
    /// By slot.
    residents: Vec<Option<Resident>>,
    /// Slots by what their pages are worth.
    order: BTreeSet<(Times, u32)>,
    /// Last uses of pages that left.
    history: BTreeMap<u32, u64>,
    /// Pages of the history, the oldest first; some came back since.
    left: VecDeque<(u32, u64)>,
}

/// Uses within so many parts of a turnover of the cache count as one.
const CORRELATED_PART: u64 = 8;

impl LruK {
    /// A policy for so many slots.
    #[must_use]
    pub fn new(slots: usize) -> Self {
        let (residents, order) = (Vec::new(), BTreeSet::new());
        Self { slots, clock: 0, residents, order, history: BTreeMap::new(), left: VecDeque::new() }
    }

    fn remember(&mut self, page: u32, last: u64) {
        if last == 0 {
            return;
        }
        self.history.insert(page, last);
        self.left.push_back((page, last));
        while self.left.len() > self.slots {
            let Some((page, last)) = self.left.pop_front() else { return };
            if self.history.get(&page) == Some(&last) {
                self.history.remove(&page);
            }
        }
    }

    fn correlated(&self, last: u64) -> bool {
        self.clock - last < self.slots as u64 / CORRELATED_PART
    }
}

impl Policy for LruK {
    fn insert(&mut self, slot: u32, page: u32, askers: u32) {
        if self.residents.len() <= slot as usize {
            self.residents.resize(slot as usize + 1, None);
        }
        self.clock += u64::from(askers > 0);
        let before = self.history.remove(&page).unwrap_or(0);
        let times = if askers > 0 { (before, self.clock) } else { (0, before) };
        self.residents[slot as usize] = Some(Resident { page, times, fresh: askers > 0 });
        self.order.insert((times, slot));
    }

    fn touch(&mut self, slot: u32) {
        let Some(Some(resident)) = self.residents.get(slot as usize).copied() else { return };
        self.clock += 1;
        let (before, last) = resident.times;
        let same = resident.fresh || self.correlated(last);
        let times = (if same { before } else { last }, self.clock);
        self.order.remove(&(resident.times, slot));
        self.order.insert((times, slot));
        self.residents[slot as usize] = Some(Resident { times, fresh: false, ..resident });
    }

    fn evict(&mut self, count: usize, cold_only: bool, may_leave: &dyn Fn(u32) -> bool, out: &mut Vec<u32>) {
        // Used once, and a turnover of the cache ago, or never.
        let cold =
            |(before, last): Times| before == 0 && (last == 0 || self.clock - last >= self.slots as u64);
        let candidates = self.order.iter().filter(|(_, slot)| may_leave(*slot));
        let leaving: Vec<(Times, u32)> =
            candidates.filter(|(times, _)| !cold_only || cold(*times)).take(count).copied().collect();
        for entry in leaving {
            self.order.remove(&entry);
            if let Some(resident) = self.residents[entry.1 as usize].take() {
                self.remember(resident.page, resident.times.1);
            }
            out.push(entry.1);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn evict(policy: &mut LruK, count: usize, cold: bool) -> Vec<u32> {
        let mut out = Vec::new();
        policy.evict(count, cold, &|slot| slot != 0, &mut out);
        out
    }

    #[test]
    fn pages_that_were_used_once_leave_before_all_others() {
        let mut policy = LruK::new(5);
        (0..5).for_each(|slot| policy.insert(slot, slot + 100, 1));
        [1, 0, 3, 1, 0, 3].into_iter().for_each(|slot| policy.touch(slot));
        assert_eq!(evict(&mut policy, 2, false), [2, 4], "once only, the longest unused first");
        assert_eq!(
            evict(&mut policy, 1, false),
            [1],
            "its last use but one lies farther back than that of 3"
        );
        // Page 102 is known from before, pages 200 and 201 are not, and nobody asked for the last.
        policy.insert(2, 102, 1);
        policy.insert(4, 200, 1);
        policy.insert(1, 201, 0);
        assert_eq!(evict(&mut policy, 9, true), [1], "cold");
        assert_eq!(evict(&mut policy, 9, false), [4, 2, 3]);
        assert_eq!(policy.order.len(), 1);
    }

    #[test]
    fn what_it_remembers_is_bounded() {
        let mut policy = LruK::new(4);
        for page in 0..1000 {
            let slot = 1 + page % 3;
            policy.insert(slot, page, 1);
            policy.evict(1, false, &|s| s == slot, &mut Vec::new());
        }
        assert!(policy.history.len() <= 4 && policy.left.len() <= 4 && policy.order.is_empty());
    }
}
