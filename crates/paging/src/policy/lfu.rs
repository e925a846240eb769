//! Least frequently used with short memory: the page manager of the thesis on massive scenes (2014), section 6.2.
//!
//! Every page has a saturating counter of 5 bits, `TimeUsed`. To swap `k` pages, all pages are sorted by a stable radix
//! sort on keys: the counter for a page in memory, 32 for a requested one, 64 for the rest; so the array begins with the
//! pages in memory, the least used first, and the requested ones follow them. The first `k` of both are exchanged.
//! Counters are cleared by every tenth swap; after that the order of the last sort decides, because the sort is stable.
//!
//! Here the array is of slots, not of pages: the keys 32 and 64 only keep apart what is in memory from what is not, and
//! a page that is exchanged stands where the page was whose slot it has. Pages in use may not leave and are passed over.

use super::Policy;

/// Largest counter.
const MOST_USED: u8 = 31;

/// Swaps from one clearing of the counters to the next.
const SWAPS_TO_CLEAR: u32 = 10;

/// See the module.
#[derive(Debug, Default)]
pub struct Lfu {
    /// All slots, as the last sort left them.
    order: Vec<u32>,
    /// By slot.
    time_used: Vec<u8>,
    /// By slot: a page is in it.
    filled: Vec<bool>,
    swaps: u32,
}

impl Lfu {
    /// A policy over no slots yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Sorts slots by their counters, slots with equal counters as they were. One pass: counters have 32 values.
    fn sort(&mut self) {
        let mut ends = [0_usize; MOST_USED as usize + 2];
        for &slot in &self.order {
            ends[self.time_used[slot as usize] as usize + 1] += 1;
        }
        for key in 1..ends.len() {
            ends[key] += ends[key - 1];
        }
        let mut sorted = vec![0; self.order.len()];
        for &slot in &self.order {
            let place = &mut ends[self.time_used[slot as usize] as usize];
            sorted[*place] = slot;
            *place += 1;
        }
        self.order = sorted;
    }

    fn count_swap(&mut self) {
        self.swaps += 1;
        if self.swaps == SWAPS_TO_CLEAR {
            self.swaps = 0;
            self.time_used.fill(0);
        }
    }
}

impl Policy for Lfu {
    fn insert(&mut self, slot: u32, _page: u32, askers: u32) {
        while self.filled.len() <= slot as usize {
            self.order.push(self.filled.len() as u32);
            self.filled.push(false);
            self.time_used.push(0);
        }
        self.filled[slot as usize] = true;
        self.time_used[slot as usize] = askers.min(u32::from(MOST_USED)) as u8;
    }

    fn touch(&mut self, slot: u32) {
        if let Some(used) = self.time_used.get_mut(slot as usize) {
            *used = (*used + 1).min(MOST_USED);
        }
    }

    fn evict(&mut self, count: usize, cold_only: bool, may_leave: &dyn Fn(u32) -> bool, out: &mut Vec<u32>) {
        self.sort();
        let before = out.len();
        for &slot in &self.order {
            let hot = cold_only && self.time_used[slot as usize] > 0;
            if hot || out.len() - before == count {
                break;
            }
            if self.filled[slot as usize] && may_leave(slot) {
                self.filled[slot as usize] = false;
                out.push(slot);
            }
        }
        if !cold_only {
            self.count_swap();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The published manager word by word: descriptors and page numbers of all pages, keys 32 and 64, a stable sort.
    struct Published {
        page_ids: Vec<u32>,
        time_used: Vec<u8>,
        cached: usize,
        swaps: u32,
    }

    impl Published {
        fn swap(&mut self, requested: &[u32]) {
            let keys: Vec<u8> = (0..self.time_used.len() as u32)
                .map(|page| match (self.holds(page), requested.contains(&page)) {
                    (true, _) => self.time_used[page as usize],
                    (false, true) => 32,
                    (false, false) => 64,
                })
                .collect();
            self.page_ids.sort_by_key(|&page| keys[page as usize]);
            let k = requested.len().min(self.cached);
            let (inside, outside) = self.page_ids.split_at_mut(self.cached);
            inside[..k].swap_with_slice(&mut outside[..k]);
            self.swaps += 1;
            if self.swaps.is_multiple_of(SWAPS_TO_CLEAR) {
                self.time_used.fill(0);
            }
        }

        fn holds(&self, page: u32) -> bool {
            self.page_ids[..self.cached].contains(&page)
        }

        fn use_page(&mut self, page: u32) {
            self.time_used[page as usize] = (self.time_used[page as usize] + 1).min(MOST_USED);
        }
    }

    #[test]
    fn it_swaps_the_pages_that_the_published_manager_swaps() {
        let (pages, slots) = (60_u32, 16);
        let page_ids = (0..pages).collect();
        let mut published = Published { page_ids, time_used: vec![0; 60], cached: slots, swaps: 0 };
        let mut lfu = Lfu::new();
        let mut page_in: Vec<u32> = (0..slots as u32).collect();
        (0..slots as u32).for_each(|slot| lfu.insert(slot, slot, 0));
        let mut state = 7_u32;
        for pass in 0..300 {
            // Small page numbers are wanted more often. A page may be used by many rays of a pass.
            let mut wanted: Vec<u32> = Vec::new();
            for _ in 0..1 + pass % 23 {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let unit = f64::from(state >> 8) / f64::from(1 << 24);
                let page = (unit * unit * f64::from(pages)) as u32;
                if published.holds(page) {
                    published.use_page(page);
                    let slot = page_in.iter().position(|&p| p == page).expect("both hold it");
                    lfu.touch(slot as u32);
                } else if !wanted.contains(&page) {
                    wanted.push(page);
                }
            }
            // The published array gives requested pages in its own order.
            wanted.sort_by_key(|page| published.page_ids.iter().position(|p| p == page));
            if wanted.is_empty() {
                continue;
            }
            published.swap(&wanted);
            let mut out = Vec::new();
            lfu.evict(wanted.len(), false, &|_| true, &mut out);
            for (&slot, &page) in out.iter().zip(&wanted) {
                page_in[slot as usize] = page;
                let used = published.time_used[page as usize];
                lfu.insert(slot, page, u32::from(used));
            }
            let order: Vec<u32> = lfu.order.iter().map(|&slot| page_in[slot as usize]).collect();
            assert_eq!(order, published.page_ids[..slots], "pass {pass}");
        }
    }

    #[test]
    fn pages_in_use_stay_and_hints_take_cold_pages_only() {
        let mut lfu = Lfu::new();
        (0..6).for_each(|slot| lfu.insert(slot, slot, u32::from(slot > 2)));
        let mut out = Vec::new();
        lfu.evict(9, true, &|slot| slot != 1, &mut out);
        assert_eq!(out, [0, 2]);
        out.clear();
        lfu.evict(9, false, &|slot| slot != 4, &mut out);
        assert_eq!(out, [1, 3, 5]);
    }
}
