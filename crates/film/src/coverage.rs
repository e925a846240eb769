//! How often each id was seen in a pixel: counts, so that merging in any grouping is exact.

/// Sample counts by id. Two ids, which most pixels have at most, need no heap.
#[derive(Clone, Debug, Default)]
pub(crate) struct Coverage {
    first: [(u32, u32); 2],
    more: Vec<(u32, u32)>,
}

impl Coverage {
    /// Ids beyond which they are sorted to be merged.
    const FEW: usize = 32;

    /// Adds `count` samples of `id`. Id 0 means "nothing" and is not kept.
    pub(crate) fn add(&mut self, id: u32, count: u32) {
        if id == 0 {
            return;
        }
        let entries = self.first.iter_mut().chain(&mut self.more);
        if let Some(entry) = entries.into_iter().find(|e| e.0 == id || e.0 == 0) {
            *entry = (id, entry.1 + count);
        } else {
            self.more.push((id, count));
        }
    }

    /// Adds all of `other`'s samples.
    pub(crate) fn merge(&mut self, other: &Self) {
        if self.more.len() + other.more.len() > Self::FEW {
            return self.merge_sorted(other);
        }
        for &(id, count) in other.first.iter().chain(&other.more) {
            self.add(id, count);
        }
    }

    /// The same for many ids.
    fn merge_sorted(&mut self, other: &Self) {
        let both = [&*self, other].into_iter().flat_map(|c| c.first.iter().chain(&c.more)).copied();
        let mut all: Vec<(u32, u32)> = both.filter(|entry| entry.0 != 0).collect();
        all.sort_unstable();
        all.dedup_by(|next, kept| {
            let is_same = next.0 == kept.0;
            if is_same {
                kept.1 += next.1;
            }
            is_same
        });
        *self = Self::from_entries(&all).unwrap_or_default();
    }

    /// Entries of a file; `None` if an id comes twice or is none.
    pub(crate) fn from_entries(entries: &[(u32, u32)]) -> Option<Self> {
        let mut ids: Vec<u32> = entries.iter().map(|entry| entry.0).collect();
        ids.sort_unstable();
        let are_ids = ids.first() != Some(&0) && ids.windows(2).all(|pair| pair[0] != pair[1]);
        are_ids.then(|| {
            let mut first = [(0, 0); 2];
            let (head, rest) = entries.split_at(entries.len().min(first.len()));
            first[..head.len()].copy_from_slice(head);
            Self { first, more: rest.to_vec() }
        })
    }

    /// How many ids were seen.
    pub(crate) fn ids(&self) -> usize {
        self.first.iter().filter(|entry| entry.0 != 0).count() + self.more.len()
    }

    /// Samples of all ids together.
    pub(crate) fn total(&self) -> u64 {
        self.first.iter().chain(&self.more).map(|entry| u64::from(entry.1)).sum()
    }

    /// (id, count), most seen first, ties by id: the same for any order of addition.
    pub(crate) fn ranked(&self) -> Vec<(u32, u32)> {
        let mut entries: Vec<_> = self.first.iter().chain(&self.more).copied().filter(|e| e.0 != 0).collect();
        entries.sort_unstable_by_key(|&(id, count)| (std::cmp::Reverse(count), id));
        entries
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn ranks_do_not_depend_on_order_or_grouping(
            mut ids in prop_oneof![prop::collection::vec(0_u32..9, 0..40), prop::collection::vec(0_u32..90, 60..200)], cut in any::<prop::sample::Index>(),
        ) {
            let gather = |ids: &[u32]| {
                let mut coverage = Coverage::default();
                ids.iter().for_each(|&id| coverage.add(id, 1));
                coverage
            };
            let whole = gather(&ids).ranked();
            let cut = if ids.is_empty() { 0 } else { cut.index(ids.len()) };
            let mut merged = gather(&ids[cut..]);
            merged.merge(&gather(&ids[..cut]));
            prop_assert_eq!(merged.ranked(), whole.clone());
            ids.reverse();
            prop_assert_eq!(gather(&ids).ranked(), whole.clone());
            let seen = ids.iter().filter(|&&id| id != 0).count();
            prop_assert_eq!(whole.iter().map(|e| e.1 as usize).sum::<usize>(), seen);
        }
    }
}
