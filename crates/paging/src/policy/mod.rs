//! Which page leaves when room is needed, one algorithm a file.

mod clock;
mod lfu;
mod lru_k;
pub mod replay;
mod s3_fifo;
pub mod traces;

pub use clock::Clock;
pub use lfu::Lfu;
pub use lru_k::LruK;
pub use s3_fifo::S3Fifo;

/// Keeps account of the pages in the slots of a cache, and says which to lose.
///
/// A slot is announced by [`insert`](Policy::insert) and forgotten when [`evict`](Policy::evict) gives it out.
pub trait Policy: std::fmt::Debug + Send {
    /// A page came into a slot; so many batches had asked for it, none if it was read ahead. A use by each of them
    /// follows.
    fn insert(&mut self, slot: u32, page: u32, askers: u32);

    /// A pass of a batch used the page in a slot.
    fn touch(&mut self, slot: u32);

    /// Appends to `out` up to `count` slots whose pages are to leave, the least worth first. Only slots for which
    /// `may_leave` holds are given; all of those before fewer than `count` are. If `cold_only`, no page leaves that
    /// was used lately, and there may be fewer.
    fn evict(&mut self, count: usize, cold_only: bool, may_leave: &dyn Fn(u32) -> bool, out: &mut Vec<u32>);
}

/// The policies there are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PolicyKind {
    /// [`Lfu`], the published one.
    Lfu,
    /// [`Clock`].
    Clock,
    /// [`LruK`].
    LruK,
    /// [`S3Fifo`], which misses as little as [`LruK`] on made-up traces and takes less time.
    #[default]
    S3Fifo,
}

impl PolicyKind {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Lfu, Self::Clock, Self::LruK, Self::S3Fifo];

    /// A policy for a cache of so many slots.
    #[must_use]
    pub fn make(self, slots: usize) -> Box<dyn Policy> {
        match self {
            Self::Lfu => Box::new(Lfu::new()),
            Self::Clock => Box::new(Clock::new()),
            Self::LruK => Box::new(LruK::new(slots)),
            Self::S3Fifo => Box::new(S3Fifo::new(slots)),
        }
    }

    /// The name that a user types.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Lfu => "lfu",
            Self::Clock => "clock",
            Self::LruK => "lru-2",
            Self::S3Fifo => "s3-fifo",
        }
    }
}

impl std::str::FromStr for PolicyKind {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let names = || Self::ALL.map(Self::name).join(", ");
        let found = Self::ALL.into_iter().find(|kind| kind.name() == name);
        found.ok_or_else(|| format!("no policy is called {name}; there are {}", names()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    /// What a cache relies on: whoever may leave does so if room is needed, nobody else, and nobody twice.
    #[test]
    fn all_pages_that_may_leave_do_and_no_others() {
        let mut state = 1_u64;
        let mut below = |end: u32| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as u32 % end
        };
        for kind in PolicyKind::ALL {
            for slots in [1, 2, 7, 40] {
                let mut policy = kind.make(slots as usize);
                let mut page_in: BTreeMap<u32, u32> = BTreeMap::new();
                for _ in 0..400 {
                    let free: Vec<u32> = (0..slots).filter(|slot| !page_in.contains_key(slot)).collect();
                    for slot in free.into_iter().take(below(slots + 1) as usize) {
                        page_in.insert(slot, below(slots * 3));
                        policy.insert(slot, page_in[&slot], below(3));
                    }
                    for _ in 0..below(20) {
                        policy.touch(below(slots));
                    }
                    let (share, count, cold) = (below(4), below(slots + 2) as usize, below(4) == 0);
                    let may_leave = |slot: u32| slot % 4 >= share;
                    let can = page_in.keys().filter(|slot| may_leave(**slot)).count();
                    let mut out = vec![u32::MAX];
                    policy.evict(count, cold, &may_leave, &mut out);
                    let left = &out[1..];
                    assert!(left.iter().all(|slot| may_leave(*slot) && page_in.remove(slot).is_some()));
                    let right =
                        if cold { left.len() <= count.min(can) } else { left.len() == count.min(can) };
                    assert!(right, "{}: {left:?}, {count} of {can}", kind.name());
                }
            }
        }
    }

    #[test]
    fn policies_are_found_by_name() {
        for kind in PolicyKind::ALL {
            assert_eq!(kind.name().parse(), Ok(kind));
        }
        assert!("mru".parse::<PolicyKind>().expect_err("unknown").contains("s3-fifo"));
    }
}
