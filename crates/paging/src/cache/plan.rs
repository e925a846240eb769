//! Which pages a thread reads next, and how it joins them into reads.

use super::config::CacheConfig;
use super::state::{Claim, State};
use crate::directory::{Directory, PageEntry};

/// Bytes that are not worth sharing out among threads.
const LEAST_SHARE: usize = 32 << 10;

impl State {
    /// Slots to be filled by one thread, by the places of their pages in the file; none if there is nothing to do or no
    /// room to do it in.
    ///
    /// The first page is the next that somebody waits for, in the direction of the file. Others that are waited for
    /// follow, up to `read_bytes` and to what one of the threads should take of them. Pages that nobody waits for are
    /// read when none is left that somebody does.
    pub(super) fn plan(&mut self, config: &CacheConfig, directory: &Directory) -> Vec<Claim> {
        let mut claims = self.claim_wanted(config, directory);
        if !self.wanted.is_empty() {
            return claims;
        }
        let ahead = match claims.last() {
            Some(last) => self.pages_behind(last.page, &claims, config, directory),
            None => self.next_hints(config, directory),
        };
        let room = if ahead.is_empty() { 0 } else { self.make_room(ahead.len(), true) };
        claims.extend(ahead.into_iter().take(room).filter_map(|page| self.claim(page, false)));
        claims
    }

    fn claim_wanted(&mut self, config: &CacheConfig, directory: &Directory) -> Vec<Claim> {
        if self.wanted.is_empty() {
            return Vec::new();
        }
        let room = self.make_room(self.wanted.len(), false);
        let share = self.wanted.len().div_ceil(config.io_threads.max(1));
        let enough = |pages: usize, bytes: usize| pages >= share && bytes >= LEAST_SHARE;
        if self.wanted.range((self.head, 0)..).next().is_none() {
            self.head = 0;
        }
        let mut bytes = 0;
        let mut chosen = Vec::new();
        for &(offset, page) in self.wanted.range((self.head, 0)..).take(room) {
            let entry = directory.get(page).unwrap_or(PageEntry { offset, bytes: 0, crc32: 0 });
            bytes += entry.bytes as usize;
            let over = bytes > config.read_bytes || enough(chosen.len(), bytes);
            if over && !chosen.is_empty() {
                break;
            }
            chosen.push((offset, page));
            self.head = entry.end();
        }
        let mut claims = Vec::with_capacity(chosen.len());
        for key in chosen {
            self.wanted.remove(&key);
            claims.extend(self.claim(key.1, true));
        }
        claims
    }

    /// Pages that lie behind the last one in the file and can be read with it.
    fn pages_behind(&self, last: u32, claims: &[Claim], config: &CacheConfig, all: &Directory) -> Vec<u32> {
        let bytes_of = |page| all.get(page).map_or(0, |entry| entry.bytes as usize);
        let mut bytes: usize = claims.iter().map(|claim| bytes_of(claim.page)).sum();
        let mut pages: Vec<u32> = Vec::new();
        for page in (last..).skip(1).take(config.read_ahead) {
            let (Some(before), Some(entry)) = (all.get(page - 1), all.get(page)) else { break };
            bytes += entry.bytes as usize;
            let near =
                entry.offset.checked_sub(before.end()).is_some_and(|gap| gap <= config.gap_bytes as u64);
            if !near || bytes > config.read_bytes || !self.is_absent(page) {
                break;
            }
            pages.push(page);
        }
        pages
    }

    /// Hinted pages that are not there yet, by their places in the file.
    fn next_hints(&mut self, config: &CacheConfig, directory: &Directory) -> Vec<u32> {
        let mut bytes = 0;
        let mut pages: Vec<(u64, u32)> = Vec::new();
        while let Some(&page) = self.hinted.front() {
            let entry = directory.get(page).filter(|_| self.is_absent(page));
            let Some(entry) = entry.filter(|entry| !pages.contains(&(entry.offset, page))) else {
                self.hinted.pop_front();
                continue;
            };
            bytes += entry.bytes as usize;
            if bytes > config.read_bytes && !pages.is_empty() {
                break;
            }
            self.hinted.pop_front();
            pages.push((entry.offset, page));
        }
        pages.sort_unstable();
        pages.into_iter().map(|(_, page)| page).collect()
    }
}

/// Cuts pages that stand in the order of the file into runs that one read covers each; gives the end of each run.
pub(super) fn runs(entries: &[PageEntry], config: &CacheConfig) -> Vec<usize> {
    let mut ends = Vec::new();
    let mut first = 0;
    for next in 1..=entries.len() {
        let joined = entries.get(next).is_some_and(|entry| {
            let gap = entry.offset.checked_sub(entries[next - 1].end());
            let near = gap.is_some_and(|gap| gap <= config.gap_bytes as u64);
            near && entry.end() - entries[first].offset <= config.read_bytes as u64
        });
        if !joined {
            ends.push(next);
            first = next;
        }
    }
    ends
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(offset: u64, bytes: u32) -> PageEntry {
        PageEntry { offset, bytes, crc32: 0 }
    }

    #[test]
    fn neighbours_are_joined_over_small_gaps_up_to_the_longest_read() {
        let config = CacheConfig { read_bytes: 1000, gap_bytes: 50, ..CacheConfig::new(1, 4096) };
        // Touching, a small gap, too large a gap, too long a read, overlapping, longer than a read alone.
        let pages =
            [(0, 300), (300, 300), (650, 100), (801, 500), (1301, 499), (1801, 10), (1805, 4000), (5805, 1)];
        let entries = pages.map(|(offset, bytes)| entry(offset, bytes));
        assert_eq!(runs(&entries, &config), [3, 5, 6, 7, 8]);
        assert_eq!(runs(&[], &config), [0; 0]);
        let ends = [entry(u64::MAX - 5, 100), entry(u64::MAX, 3)];
        assert_eq!(runs(&ends, &config), [2], "places that cannot be do no harm");
    }
}
