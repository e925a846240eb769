//! Which places of an array are free, found by nearness: the memory manager of K. V. Garanzha's thesis of 2014 (chapter 2.5).
//!
//! A tree of high arity over the array holds nothing but counts of free places, so that the free place nearest to any other
//! is found in a few steps. Nodes that come and go thus stay near their parents. Deviation: the lowest counts are words of
//! 64 bits.

/// Children of a node of the tree of counts.
const ARITY: usize = 8;
/// Places that a word speaks of.
const WORD: usize = 64;

/// The free places of an array.
#[derive(Clone, Debug, Default)]
pub(super) struct Arena {
    /// Places, free or not.
    len: usize,
    /// A bit for each free place.
    words: Vec<u64>,
    /// Free places below [`ARITY`] words, below as many of these counts, and so on; the last level has one count.
    counts: Vec<Vec<u32>>,
}

impl Arena {
    /// `len` places, all taken.
    pub(super) fn full(len: usize) -> Self {
        let mut arena = Self::default();
        arena.resize(len);
        arena
    }

    /// Places, free or not.
    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// Free places.
    pub(super) fn free(&self) -> usize {
        self.counts.last().map_or(0, |top| top.iter().sum::<u32>() as usize)
    }

    /// Free places as a share of all.
    pub(super) fn looseness(&self) -> f64 {
        self.free() as f64 / self.len.max(1) as f64
    }

    /// Whether a place is free.
    pub(super) fn is_free(&self, place: usize) -> bool {
        self.words.get(place / WORD).is_some_and(|word| word >> (place % WORD) & 1 == 1)
    }

    /// Adds free places at the end.
    pub(super) fn grow(&mut self, len: usize) {
        let old = self.len;
        self.resize(len);
        (old..len).for_each(|place| self.release(place));
    }

    /// Takes the free place nearest to `near`; none if there is none.
    pub(super) fn take(&mut self, near: usize) -> Option<usize> {
        let near = near.min(self.len.checked_sub(1)?);
        let place = match (self.search::<true>(near), self.search::<false>(near)) {
            (Some(after), Some(before)) if near - before < after - near => before,
            (after, before) => after.or(before)?,
        };
        self.words[place / WORD] &= !(1 << (place % WORD));
        self.count_up(place, u32::MAX);
        Some(place)
    }

    /// Frees a taken place.
    pub(super) fn release(&mut self, place: usize) {
        debug_assert!(place < self.len && !self.is_free(place), "place {place} is taken");
        self.words[place / WORD] |= 1 << (place % WORD);
        self.count_up(place, 1);
    }

    fn resize(&mut self, len: usize) {
        self.len = len;
        let mut below = len.div_ceil(WORD);
        self.words.resize(below, 0);
        let mut level = 0;
        loop {
            below = below.div_ceil(ARITY);
            if level == self.counts.len() {
                self.counts.push(Vec::new());
            }
            self.counts[level].resize(below, 0);
            level += 1;
            if below <= 1 {
                break;
            }
        }
        self.recount();
    }

    fn recount(&mut self) {
        for level in 0..self.counts.len() {
            for index in 0..self.counts[level].len() {
                let below = index * ARITY..((index + 1) * ARITY).min(self.below(level));
                self.counts[level][index] = below.map(|i| self.free_in(level, i)).sum();
            }
        }
    }

    /// How many nodes the level below `level` has; level 0 stands over words.
    fn below(&self, level: usize) -> usize {
        if level == 0 { self.words.len() } else { self.counts[level - 1].len() }
    }

    /// Free places below node `index` of the level below `level`.
    fn free_in(&self, level: usize, index: usize) -> u32 {
        if level == 0 { self.words[index].count_ones() } else { self.counts[level - 1][index] }
    }

    /// Adds to the counts above a place.
    fn count_up(&mut self, place: usize, by: u32) {
        let mut index = place / WORD;
        for counts in &mut self.counts {
            index /= ARITY;
            counts[index] = counts[index].wrapping_add(by);
        }
    }

    /// The first free place at or after `from`, or the last at or before it.
    fn search<const AFTER: bool>(&self, from: usize) -> Option<usize> {
        let (word, bit) = (from / WORD, from % WORD);
        let mask = if AFTER { u64::MAX << bit } else { u64::MAX >> (WORD - 1 - bit) };
        if self.words[word] & mask != 0 {
            return Some(word * WORD + pick::<AFTER>(self.words[word] & mask));
        }
        let mut own = word;
        for level in 0..self.counts.len() {
            let group = own / ARITY * ARITY;
            let end = (group + ARITY).min(self.below(level));
            let mut beside = if AFTER { own + 1..end } else { group..own };
            let has_free = |&index: &usize| self.free_in(level, index) > 0;
            let found = if AFTER { beside.find(has_free) } else { beside.rfind(has_free) };
            if let Some(found) = found {
                return Some(self.descend::<AFTER>(level, found));
            }
            own /= ARITY;
        }
        None
    }

    /// The first or last free place below node `index`, which has some, of the level below `level`.
    fn descend<const FIRST: bool>(&self, level: usize, mut index: usize) -> usize {
        for level in (0..level).rev() {
            let mut below = index * ARITY..((index + 1) * ARITY).min(self.below(level));
            let has_free = |&index: &usize| self.free_in(level, index) > 0;
            let found = if FIRST { below.find(has_free) } else { below.rfind(has_free) };
            index = found.unwrap_or(index * ARITY);
        }
        index * WORD + pick::<FIRST>(self.words[index])
    }
}

/// The lowest or highest set bit of a word that is not zero.
fn pick<const LOWEST: bool>(word: u64) -> usize {
    (if LOWEST { word.trailing_zeros() } else { 63 - word.leading_zeros() }) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_free_place_is_found_as_by_looking_at_all() {
        for len in [1, 63, 64, 65, 600, 5000] {
            let mut arena = Arena::full(len);
            let mut free = vec![false; len];
            let mut state = 12345_usize;
            let mut random = move || {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                state >> 33
            };
            for step in 0..3000 {
                let near = random() % len;
                // Phases in which most are taken, and in which most are free.
                if random() % 4 < 1 + step / 1000 {
                    if !free[near] {
                        arena.release(near);
                        free[near] = true;
                    }
                    continue;
                }
                let nearest = (0..len).filter(|&i| free[i]).min_by_key(|&i| (i.abs_diff(near), i < near));
                assert_eq!(arena.take(near), nearest, "{len}, step {step}");
                if let Some(place) = nearest {
                    free[place] = false;
                }
                assert_eq!(arena.free(), free.iter().filter(|&&f| f).count());
            }
        }
    }

    #[test]
    fn it_grows() {
        let mut arena = Arena::default();
        assert_eq!(arena.take(0), None);
        arena.grow(10);
        assert_eq!((arena.take(7), arena.take(7), arena.free()), (Some(7), Some(8), 8));
        arena.grow(70_000);
        assert_eq!((arena.free(), arena.len(), arena.take(70_000)), (69_998, 70_000, Some(69_999)));
        assert!(arena.is_free(9) && !arena.is_free(8) && !arena.is_free(70_000));
    }
}
