//! Clock, or second chance (Corbató 1969, "A Paging Experiment with the Multics System"): a hand goes round the slots; a
//! page that was used since the hand last came by is spared once.
//!
//! Deviation: pages that came by read-ahead start without the mark of a use, so they leave first if nobody uses them.

use super::Policy;

/// See the module.
#[derive(Debug, Default)]
pub struct Clock {
    /// By slot: nothing in it, or whether its page was used.
    used: Vec<Option<bool>>,
    hand: usize,
}

impl Clock {
    /// A policy over no slots yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }
}

impl Policy for Clock {
    fn insert(&mut self, slot: u32, _page: u32, askers: u32) {
        if self.used.len() <= slot as usize {
            self.used.resize(slot as usize + 1, None);
        }
        self.used[slot as usize] = Some(askers > 0);
    }

    fn touch(&mut self, slot: u32) {
        if let Some(Some(used)) = self.used.get_mut(slot as usize) {
            *used = true;
        }
    }

    fn evict(&mut self, count: usize, cold_only: bool, may_leave: &dyn Fn(u32) -> bool, out: &mut Vec<u32>) {
        let before = out.len();
        // The first round takes marks away, the second finds none. Hints take no marks away.
        let rounds = if cold_only { 1 } else { 2 };
        for _ in 0..self.used.len() * rounds {
            if out.len() - before == count {
                return;
            }
            let slot = self.hand % self.used.len();
            self.hand = slot + 1;
            if !may_leave(slot as u32) {
                continue;
            }
            match &mut self.used[slot] {
                Some(used) if *used => *used = cold_only,
                Some(_) => {
                    self.used[slot] = None;
                    out.push(slot as u32);
                }
                None => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_used_page_is_spared_once() {
        let mut clock = Clock::new();
        (0..4).for_each(|slot| clock.insert(slot, slot, 1));
        let evict = |clock: &mut Clock, count, cold| {
            let mut out = Vec::new();
            clock.evict(count, cold, &|slot| slot != 3, &mut out);
            out
        };
        assert_eq!(evict(&mut clock, 4, true), [0; 0], "all were used");
        assert_eq!(evict(&mut clock, 1, false), [0]);
        clock.touch(1);
        assert_eq!(evict(&mut clock, 1, false), [2], "1 was used since");
        assert_eq!(evict(&mut clock, 9, false), [1], "3 may not leave");
        clock.insert(0, 7, 0);
        assert_eq!(evict(&mut clock, 1, true), [0], "read ahead and never used");
    }
}
