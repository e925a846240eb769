//! Tests of the cache as a whole.

mod faults;
mod life;
mod stress;

use super::*;
use crate::directory::PageEntry;
use crate::source::MemorySource;
use std::sync::mpsc;
use std::time::Duration;

/// Numbers from a seed.
#[derive(Clone)]
pub(super) struct Numbers(u64);

impl Numbers {
    fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    /// The next number below `end`.
    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 33) as usize % end
    }
}

/// Slack of all tests.
const SLACK: usize = 64;

/// Pages of all lengths that fit into slots of 4096 bytes.
fn pages_of(count: usize, seed: u64) -> Vec<Vec<u8>> {
    let mut numbers = Numbers::new(seed);
    let mut page = |number: usize| -> Vec<u8> {
        let bytes = if number.is_multiple_of(7) { 4096 - SLACK } else { numbers.below(4000) };
        (0..bytes).map(|_| numbers.below(256) as u8).collect()
    };
    (0..count).map(&mut page).collect()
}

/// The pages as a file: in another order than that of their numbers if `shuffled`, with gaps between some.
fn file_of(pages: &[Vec<u8>], shuffled: bool) -> (MemorySource, Directory) {
    let mut numbers = Numbers::new(pages.len() as u64);
    let mut order: Vec<usize> = (0..pages.len()).collect();
    for last in (1..order.len()).rev().filter(|_| shuffled) {
        order.swap(last, numbers.below(last + 1));
    }
    let mut bytes = vec![0x77; 100];
    let mut entries = vec![PageEntry { offset: 0, bytes: 0, crc32: 0 }; pages.len()];
    for number in order {
        entries[number] = PageEntry::of(bytes.len() as u64, &pages[number]);
        bytes.extend_from_slice(&pages[number]);
        bytes.resize(bytes.len() + numbers.below(4) * 40, 0x77);
    }
    (MemorySource::new("test.pages", bytes), entries.into())
}

fn config(slots: usize) -> CacheConfig {
    CacheConfig { slack: SLACK, read_bytes: 20_000, gap_bytes: 80, ..CacheConfig::new(slots, 4096) }
}

/// Fails if `work` takes longer than any of it should.
fn watched<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> T {
    let (done, finished) = mpsc::channel();
    let thread = std::thread::spawn(move || done.send(work()));
    match finished.recv_timeout(Duration::from_secs(60)) {
        Ok(result) => result,
        Err(mpsc::RecvTimeoutError::Timeout) => panic!("nobody gets on: a deadlock"),
        Err(mpsc::RecvTimeoutError::Disconnected) => match thread.join() {
            Err(panic) => std::panic::resume_unwind(panic),
            Ok(_) => unreachable!("it ended without a result"),
        },
    }
}

/// True if the memory of a page begins with its bytes and is zero behind them.
fn is_right(memory: &[u8], page: &[u8]) -> bool {
    memory.len() >= page.len() + SLACK
        && memory[..page.len()] == *page
        && memory[page.len()..].iter().all(|&byte| byte == 0)
}

impl PageCache {
    fn validate(&self) {
        self.shared.lock().validate().expect("the cache contradicts itself");
    }
}
