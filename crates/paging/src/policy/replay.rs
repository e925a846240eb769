//! Policies on recorded or made-up traces, and the best that any policy could do.
//!
//! The best for a known order of uses is to lose the page whose next use lies farthest ahead (Belady 1966, "A Study of
//! Replacement Algorithms for a Virtual-Storage Computer").

use super::Policy;
use std::collections::{BTreeMap, BTreeSet};

/// What came of a replay.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Replay {
    /// Uses of pages that were in memory.
    pub hits: usize,
    /// All uses, in the order in which they were served: in a pass, pages in memory come first.
    pub served: Vec<u32>,
}

impl Replay {
    /// Hits as a part of all uses.
    #[must_use]
    pub fn hit_rate(&self) -> f64 {
        self.hits as f64 / self.served.len().max(1) as f64
    }
}

/// Replays a trace: uses of pages in passes of `pass` uses each. A pass uses what is in memory and asks for the rest,
/// which comes by one swap, as a cache does for a batch; if it does not fit, by several.
#[must_use]
pub fn replay(policy: &mut dyn Policy, slots: usize, trace: &[u32], pass: usize) -> Replay {
    let mut cache = Model { slots, page_in: Vec::new(), slot_of: BTreeMap::new() };
    let mut result = Replay::default();
    for uses in trace.chunks(pass.max(1)) {
        let mut pages: Vec<u32> = Vec::with_capacity(uses.len());
        let mut seen = BTreeSet::new();
        pages.extend(uses.iter().filter(|page| seen.insert(**page)));
        let (there, missing): (Vec<u32>, Vec<u32>) =
            pages.into_iter().partition(|page| cache.slot_of.contains_key(page));
        for page in &there {
            policy.touch(cache.slot_of[page]);
        }
        result.hits += there.len();
        result.served.extend_from_slice(&there);
        for part in missing.chunks(slots.max(1)) {
            cache.swap_in(policy, part);
            result.served.extend_from_slice(part);
        }
    }
    result
}

/// A cache without memory.
struct Model {
    slots: usize,
    page_in: Vec<u32>,
    slot_of: BTreeMap<u32, u32>,
}

impl Model {
    fn swap_in(&mut self, policy: &mut dyn Policy, pages: &[u32]) {
        let room = self.slots - self.page_in.len();
        let mut slots = Vec::new();
        if pages.len() > room {
            policy.evict(pages.len() - room, false, &|_| true, &mut slots);
        }
        let fresh = self.page_in.len() as u32..self.slots as u32;
        let slots: Vec<u32> = slots.into_iter().chain(fresh).collect();
        for (&page, &slot) in pages.iter().zip(&slots) {
            match self.page_in.get_mut(slot as usize) {
                Some(old) => {
                    self.slot_of.remove(old);
                    *old = page;
                }
                None => self.page_in.push(page),
            }
            self.slot_of.insert(page, slot);
            policy.insert(slot, page, 1);
            policy.touch(slot);
        }
    }
}

/// Most hits that any policy could have with a trace served in this order.
#[must_use]
pub fn most_hits(slots: usize, trace: &[u32]) -> usize {
    let never = trace.len();
    let mut next_use = vec![never; trace.len()];
    let mut seen: BTreeMap<u32, usize> = BTreeMap::new();
    for (time, &page) in trace.iter().enumerate().rev() {
        next_use[time] = seen.insert(page, time).unwrap_or(never);
    }
    // Pages in memory by their next use.
    let mut there: BTreeSet<(usize, u32)> = BTreeSet::new();
    let mut hits = 0;
    for (time, &page) in trace.iter().enumerate() {
        if there.remove(&(time, page)) {
            hits += 1;
        } else if there.len() == slots {
            there.pop_last();
        }
        there.insert((next_use[time], page));
    }
    hits
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::policy::PolicyKind;
    use crate::policy::traces;

    /// All ways to evict, tried out.
    fn best_by_trying(slots: usize, there: &BTreeSet<u32>, trace: &[u32]) -> usize {
        let Some((&page, rest)) = trace.split_first() else { return 0 };
        if there.contains(&page) {
            return 1 + best_by_trying(slots, there, rest);
        }
        let mut with = there.clone();
        with.insert(page);
        if with.len() <= slots {
            return best_by_trying(slots, &with, rest);
        }
        let without = |old: &u32| {
            let mut kept = with.clone();
            kept.remove(old);
            best_by_trying(slots, &kept, rest)
        };
        there.iter().map(without).max().unwrap_or(0)
    }

    #[test]
    fn the_optimum_is_what_trying_everything_finds() {
        for seed in 0..30_u64 {
            let trace: Vec<u32> = (0..12).map(|i| (seed.wrapping_mul(i * i + 7) >> 2) as u32 % 5).collect();
            for slots in 1..4 {
                let best = best_by_trying(slots, &BTreeSet::new(), &trace);
                assert_eq!(most_hits(slots, &trace), best, "{trace:?} with {slots}");
            }
        }
    }

    #[test]
    fn no_policy_beats_the_optimum_and_all_beat_nothing() {
        for (name, trace) in traces::all(300, 6000) {
            for (slots, pass) in [(1, 1), (10, 1), (30, 8), (150, 40), (20, 50), (300, 10)] {
                for kind in PolicyKind::ALL {
                    let replay = replay(&mut *kind.make(slots), slots, &trace, pass);
                    let best = most_hits(slots, &replay.served);
                    assert!(replay.hits <= best, "{name}, {slots}: {} of {best}", kind.name());
                    let distinct = trace.iter().collect::<BTreeSet<_>>().len();
                    let fits = slots >= distinct;
                    let misses = replay.served.len() - replay.hits;
                    assert!(!fits || misses == distinct, "{name}: all fit, {} loses some", kind.name());
                }
            }
        }
    }

    /// What each policy is there for.
    #[test]
    fn policies_keep_what_they_are_meant_to_keep() {
        let rate = |kind: PolicyKind, trace: &[u32]| {
            let replay = replay(&mut *kind.make(100), 100, trace, 20);
            replay.hit_rate()
        };
        let all = traces::all(1000, 40_000);
        let trace = |name: &str| &all.iter().find(|(n, _)| *n == name).expect("made").1;
        let sweeps = trace("hot set and sweeps");
        for kind in [PolicyKind::LruK, PolicyKind::S3Fifo] {
            assert!(rate(kind, sweeps) > rate(PolicyKind::Clock, sweeps) + 0.05, "{}", kind.name());
        }
    }
}
