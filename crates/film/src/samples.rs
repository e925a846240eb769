//! Sets of sample numbers: which samples of its pixels a film has.

use std::fmt;
use std::ops::Range;

/// A set of sample numbers, which count from 0; people read and write them from 1.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SampleSet {
    /// Ascending; between two of them a number is missing.
    ranges: Vec<Range<u32>>,
}

impl SampleSet {
    /// Most samples a pixel: so many fit into its sums.
    pub const MOST: u32 = 1 << 22;

    /// Runs of numbers, ascending, that neither overlap nor touch.
    #[must_use]
    pub fn ranges(&self) -> &[Range<u32>] {
        &self.ranges
    }

    /// How many numbers are in the set.
    #[must_use]
    pub fn len(&self) -> u32 {
        self.ranges.iter().map(|range| range.end - range.start).sum()
    }

    /// Whether nothing is in the set.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.ranges.is_empty()
    }

    /// Adds numbers.
    pub fn insert(&mut self, mut added: Range<u32>) {
        if added.is_empty() {
            return;
        }
        self.ranges.retain(|range| {
            let is_apart = range.end < added.start || added.end < range.start;
            if !is_apart {
                added = range.start.min(added.start)..range.end.max(added.end);
            }
            is_apart
        });
        let place = self.ranges.partition_point(|range| range.start < added.start);
        self.ranges.insert(place, added);
    }

    /// The first numbers that are in both sets.
    #[must_use]
    pub fn overlap(&self, other: &Self) -> Option<Range<u32>> {
        let both = |a: &Range<u32>, b: &Range<u32>| a.start.max(b.start)..a.end.min(b.end);
        let pairs = self.ranges.iter().flat_map(|a| other.ranges.iter().map(move |b| both(a, b)));
        pairs.filter(|range| !range.is_empty()).min_by_key(|range| range.start)
    }

    /// The first run of numbers of `wanted` that are not in the set.
    #[must_use]
    pub fn first_gap(&self, wanted: Range<u32>) -> Option<Range<u32>> {
        let mut start = wanted.start;
        for range in &self.ranges {
            if range.start > start {
                break;
            }
            start = start.max(range.end);
        }
        let next = self.ranges.iter().map(|range| range.start).find(|&first| first > start);
        let gap = start..next.unwrap_or(wanted.end).min(wanted.end);
        (!gap.is_empty()).then_some(gap)
    }

    /// The numbers that are not in `range`, if there are any: the first run of them.
    #[must_use]
    pub fn beyond(&self, range: &Range<u32>) -> Option<Range<u32>> {
        self.ranges.iter().find(|r| r.start < range.start || r.end > range.end).cloned()
    }
}

impl From<Range<u32>> for SampleSet {
    fn from(range: Range<u32>) -> Self {
        let mut set = Self::default();
        set.insert(range);
        set
    }
}

impl Extend<Range<u32>> for SampleSet {
    fn extend<I: IntoIterator<Item = Range<u32>>>(&mut self, ranges: I) {
        ranges.into_iter().for_each(|range| self.insert(range));
    }
}

impl fmt::Display for SampleSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_empty() {
            return f.write_str("none");
        }
        for (i, range) in self.ranges.iter().enumerate() {
            let comma = if i == 0 { "" } else { ", " };
            write!(f, "{comma}{}-{}", range.start + 1, range.end)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    fn ranges() -> impl Strategy<Value = Vec<Range<u32>>> {
        prop::collection::vec((0_u32..40, 0_u32..9).prop_map(|(first, n)| first..first + n), 0..8)
    }

    fn of(ranges: &[Range<u32>]) -> (SampleSet, BTreeSet<u32>) {
        let mut set = SampleSet::default();
        set.extend(ranges.iter().cloned());
        (set, ranges.iter().cloned().flatten().collect())
    }

    proptest! {
        #[test]
        fn it_is_the_set_of_its_numbers(a in ranges(), b in ranges(), wanted in (0_u32..40, 0_u32..20)) {
            let ((a, numbers), (b, others)) = (of(&a), of(&b));
            prop_assert_eq!(a.ranges().iter().cloned().flatten().collect::<Vec<_>>(), numbers.iter().copied().collect::<Vec<_>>());
            prop_assert!(a.ranges().windows(2).all(|w| w[0].end < w[1].start));
            prop_assert_eq!(a.len() as usize, numbers.len());
            let first_common = numbers.intersection(&others).next().copied();
            prop_assert_eq!(a.overlap(&b).map(|r| r.start), first_common);
            let wanted = wanted.0..wanted.0 + wanted.1;
            let missing: Vec<u32> = wanted.clone().filter(|n| !numbers.contains(n)).collect();
            let gap = a.first_gap(wanted.clone());
            let run = missing.iter().zip(missing.first().copied().unwrap_or(0)..).take_while(|(a, b)| **a == *b);
            prop_assert_eq!(gap.map_or(Vec::new(), |gap| gap.collect::<Vec<_>>()), run.map(|(n, _)| *n).collect::<Vec<_>>());
            prop_assert_eq!(a.beyond(&wanted).is_some(), numbers.iter().any(|n| !wanted.contains(n)));
        }
    }

    #[test]
    fn people_count_from_one() {
        let mut set = SampleSet::from(32..48);
        assert_eq!(set.to_string(), "33-48");
        set.insert(0..16);
        assert_eq!(set.to_string(), "1-16, 33-48");
        assert_eq!(SampleSet::default().to_string(), "none");
    }
}
