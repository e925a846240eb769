//! A queue of links by value: buckets over [-2, 2], of which the first that is not empty is a few steps away.
//!
//! As K. V. Garanzha's thesis of 2014, chapter 3.2, has it. Values within a bucket have no order but that in which they came, the
//! latest first.

/// Values span [-2, 2].
const LEAST: f32 = -2.0;
const SPAN: f32 = 4.0;
/// Number of buckets: a word of bits for each 64, and one for each 64 of these words.
const BUCKETS: usize = 1 << 18;
/// No link.
const NONE: u32 = u32::MAX;

/// Width of a bucket.
#[cfg(test)]
pub(super) const WIDTH: f32 = SPAN / BUCKETS as f32;

/// A queue of numbered items.
pub(super) struct BucketQueue {
    /// By bucket, the first item.
    heads: Vec<u32>,
    /// By item: the next and the previous one in its bucket, and the bucket; [`NONE`] if it is in none.
    places: Vec<Place>,
    /// A bit for each bucket that is not empty; a bit for each word of these; and so on.
    levels: [Vec<u64>; 3],
}

#[derive(Clone, Copy)]
struct Place {
    next: u32,
    previous: u32,
    bucket: u32,
}

impl BucketQueue {
    /// Without items, which may be numbered up to `items`.
    pub(super) fn new(items: usize) -> Self {
        let words = [BUCKETS / 64, BUCKETS / 4096, BUCKETS / 262_144];
        Self {
            heads: vec![NONE; BUCKETS],
            places: vec![Place { next: NONE, previous: NONE, bucket: NONE }; items],
            levels: words.map(|words| vec![0; words]),
        }
    }

    /// Puts an item in, or moves it to where `value` belongs.
    pub(super) fn set(&mut self, item: u32, value: f32) {
        let part = ((value - LEAST) / SPAN).clamp(0.0, 1.0);
        let bucket = ((part * BUCKETS as f32) as usize).min(BUCKETS - 1);
        if self.places[item as usize].bucket == bucket as u32 {
            return;
        }
        self.remove(item);
        let next = self.heads[bucket];
        if next != NONE {
            self.places[next as usize].previous = item;
        }
        self.places[item as usize] = Place { next, previous: NONE, bucket: bucket as u32 };
        self.heads[bucket] = item;
        self.mark(bucket);
    }

    /// Takes an item out, if it is in.
    pub(super) fn remove(&mut self, item: u32) {
        let Place { next, previous, bucket } = self.places[item as usize];
        if bucket == NONE {
            return;
        }
        self.places[item as usize].bucket = NONE;
        if next != NONE {
            self.places[next as usize].previous = previous;
        }
        if previous != NONE {
            self.places[previous as usize].next = next;
            return;
        }
        self.heads[bucket as usize] = next;
        if next == NONE {
            self.unmark(bucket as usize);
        }
    }

    /// Takes out an item of the highest bucket.
    pub(super) fn pop(&mut self) -> Option<u32> {
        let mut at = self.levels[2].iter().rposition(|&word| word != 0)?;
        for level in self.levels.iter().rev() {
            at = at * 64 + level[at].ilog2() as usize;
        }
        let item = self.heads[at];
        self.remove(item);
        Some(item)
    }

    fn mark(&mut self, bucket: usize) {
        let mut at = bucket;
        for level in &mut self.levels {
            level[at / 64] |= 1 << (at % 64);
            at /= 64;
        }
    }

    fn unmark(&mut self, bucket: usize) {
        let mut at = bucket;
        for level in &mut self.levels {
            level[at / 64] &= !(1 << (at % 64));
            if level[at / 64] != 0 {
                return;
            }
            at /= 64;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// What to do with an item: give it a value, take it out, or take out the highest.
    fn steps() -> impl Strategy<Value = Vec<(u32, Option<f32>)>> {
        prop::collection::vec((0..40_u32, prop::option::weighted(0.7, -2.5..2.5_f32)), 0..400)
    }

    proptest! {
        #[test]
        fn it_does_as_a_plain_search_does(steps in steps()) {
            let mut queue = BucketQueue::new(40);
            let mut plain = [None::<f32>; 40];
            for (item, value) in steps {
                if let Some(value) = value {
                    queue.set(item, value);
                    plain[item as usize] = Some(value.clamp(-2.0, 2.0));
                } else if item % 2 == 0 {
                    queue.remove(item);
                    plain[item as usize] = None;
                } else {
                    let best = plain.iter().flatten().copied().reduce(f32::max);
                    let found = queue.pop().map(|item| plain[item as usize].take().expect("in the queue"));
                    prop_assert_eq!(found.is_some(), best.is_some());
                    if let (Some(found), Some(best)) = (found, best) {
                        prop_assert!(found > best - 1.01 * WIDTH, "{} {}", found, best);
                    }
                }
            }
            let left = std::iter::from_fn(|| queue.pop()).count();
            prop_assert_eq!(left, plain.iter().flatten().count());
        }
    }

    #[test]
    fn items_leave_in_order() {
        let mut queue = BucketQueue::new(6);
        [1.5, -2.0, 0.25, 2.0, 0.25, -0.5].iter().zip(0..).for_each(|(&value, item)| queue.set(item, value));
        queue.set(1, 0.3);
        queue.remove(3);
        let order: Vec<u32> = std::iter::from_fn(|| queue.pop()).collect();
        assert_eq!(order, [0, 1, 4, 2, 5]);
    }
}
