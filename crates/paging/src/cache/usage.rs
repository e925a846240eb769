//! Which pages a pass of a batch used.

/// A set of pages that is quick to add to, to read and to clear: a bit for each page, and a list of the words with bits.
#[derive(Clone, Debug, Default)]
pub struct Usage {
    words: Vec<u64>,
    touched: Vec<u32>,
}

impl Usage {
    /// An empty set for so many pages.
    #[must_use]
    pub fn new(pages: usize) -> Self {
        Self { words: vec![0; pages.div_ceil(64)], touched: Vec::new() }
    }

    /// Adds a page. Pages that the set is not for are passed over.
    #[inline(always)]
    pub fn add(&mut self, page: u32) {
        let index = page / 64;
        if let Some(word) = self.words.get_mut(index as usize) {
            if *word == 0 {
                self.touched.push(index);
            }
            *word |= 1 << (page % 64);
        }
    }

    /// Adds all pages of another set, given as words with a bit for each page, page 0 in the lowest bit of the first.
    pub fn add_words(&mut self, words: &[u64]) {
        for (index, (word, more)) in
            (0..).zip(self.words.iter_mut().zip(words)).filter(|(_, (_, more))| **more > 0)
        {
            if *word == 0 {
                self.touched.push(index);
            }
            *word |= more;
        }
    }

    /// True if the page is in the set.
    #[must_use]
    pub fn holds(&self, page: u32) -> bool {
        self.words.get(page as usize / 64).is_some_and(|word| word >> (page % 64) & 1 == 1)
    }

    /// Gives every page of the set once, in the order in which their words were first added to, and clears the set.
    pub fn drain(&mut self, mut each: impl FnMut(u32)) {
        for index in self.touched.drain(..) {
            let mut word = std::mem::take(&mut self.words[index as usize]);
            while word != 0 {
                each(index * 64 + word.trailing_zeros());
                word &= word - 1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_page_comes_out_once_and_the_set_is_empty_then() {
        let mut usage = Usage::new(130);
        for page in [129, 3, 64, 3, 129, 4_000_000_000, 192] {
            usage.add(page);
        }
        assert!(usage.holds(129) && !usage.holds(128) && !usage.holds(4_000_000_000));
        usage.add_words(&[1 << 5, 0, 1 << 1, u64::MAX]);
        let mut pages = Vec::new();
        usage.drain(|page| pages.push(page));
        assert_eq!(pages, [129, 3, 5, 64]);
        usage.drain(|_| unreachable!("cleared"));
        assert!(!usage.holds(129));
    }
}
