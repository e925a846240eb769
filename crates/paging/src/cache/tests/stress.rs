//! Many batches over few slots: all pages come, with the right bytes.

use super::*;
use crate::policy::PolicyKind;
use crate::source::{Fault, Faulty, Source, When};
use std::sync::atomic::{AtomicBool, Ordering};

/// Uses the pages of `wanted`, those first that are there, like rays that wait for what they miss.
fn visit(batch: &mut Batch, pages: &[Vec<u8>], mut wanted: Vec<u32>, numbers: &mut Numbers) {
    while !wanted.is_empty() {
        let (table, usage) = batch.parts();
        let mut missing = Vec::new();
        let kept = table.clone();
        for &page in &wanted {
            match table.page(page) {
                Some(memory) => {
                    assert!(is_right(memory, &pages[page as usize]), "page {page}");
                    usage.add(page);
                }
                None => missing.push(page),
            }
        }
        if numbers.below(4) == 0 {
            std::thread::yield_now();
        }
        // What was there before is there still, whatever was evicted meanwhile.
        let same = |&page: &u32| kept.page(page).is_none_or(|memory| is_right(memory, &pages[page as usize]));
        assert!(wanted.iter().all(same));
        drop(kept);
        // Of some fetches only half must have come.
        let granted = if numbers.below(2) == 0 {
            batch.fetch(&missing).expect("no faults here")
        } else {
            Batch::fetch_half(&mut [(&mut *batch, &missing)]).expect("no faults here");
            usize::from(!missing.is_empty())
        };
        assert!(granted > 0 || missing.is_empty());
        assert!(missing[..granted].iter().all(|&page| batch.table().page(page).is_some()));
        wanted = missing;
    }
}

/// So many threads, each a batch, visit pages in orders of their own.
fn stress(
    source: Arc<dyn Source>,
    directory: Directory,
    pages: Arc<[Vec<u8>]>,
    config: CacheConfig,
    visits: usize,
) {
    let cache = Arc::new(PageCache::new(source, directory, config).expect("sizes fit"));
    let over = Arc::new(AtomicBool::new(false));
    let checker = std::thread::spawn({
        let (cache, over) = (cache.clone(), over.clone());
        move || {
            while !over.load(Ordering::Relaxed) {
                cache.validate();
                std::thread::sleep(Duration::from_millis(2));
            }
        }
    });
    std::thread::scope(|scope| {
        for number in 0..config.most_batches {
            let (cache, pages) = (&cache, &pages);
            scope.spawn(move || {
                let mut numbers = Numbers::new(number as u64 + 1);
                for _ in 0..3 {
                    let mut batch = cache.batch().expect("as many as planned");
                    for _ in 0..visits {
                        let count = 1 + numbers.below(40);
                        let wanted = (0..count).map(|_| numbers.below(pages.len()) as u32).collect();
                        visit(&mut batch, pages, wanted, &mut numbers);
                        if numbers.below(5) == 0 {
                            let hints: Vec<u32> =
                                (0..9).map(|_| numbers.below(pages.len() + 3) as u32).collect();
                            cache.prefetch(&hints);
                        }
                    }
                }
            });
        }
    });
    over.store(true, Ordering::Relaxed);
    checker.join().expect("valid all the time");
    cache.validate();
    let stats = cache.stats();
    assert!(stats.peak_bytes <= config.slots * config.slot_bytes && stats.resident_pages <= config.slots);
    assert!(stats.misses > 0 && stats.pages_read > 0 && stats.failures == 0, "{stats:?}");
    assert!(stats.pages_read - stats.pages_ahead + stats.pages_revived <= stats.misses, "{stats:?}");
}

fn sources(seed: u64) -> (Arc<dyn Source>, Directory, Arc<[Vec<u8>]>) {
    let pages: Arc<[Vec<u8>]> = pages_of(200, seed).into();
    let (source, directory) = file_of(&pages, seed.is_multiple_of(2));
    (Arc::new(source), directory, pages)
}

#[test]
fn one_slot_a_batch_suffices() {
    watched(|| {
        for (seed, policy) in (0..).zip(PolicyKind::ALL) {
            let (source, directory, pages) = sources(seed);
            let tight = CacheConfig { most_batches: 6, policy, ..config(6) };
            stress(source, directory, pages, tight, 15);
        }
    });
}

#[test]
fn one_slot_one_batch_one_thread() {
    watched(|| {
        let (source, directory, pages) = sources(3);
        let tight = CacheConfig { io_threads: 1, most_batches: 1, read_ahead: 4, ..config(1) };
        stress(source, directory, pages, tight, 30);
    });
}

#[test]
fn more_slots_more_threads_read_ahead() {
    watched(|| {
        for (seed, policy) in (10..).zip(PolicyKind::ALL) {
            let (source, directory, pages) = sources(seed);
            let wide = CacheConfig { io_threads: 3, read_ahead: 3, policy, ..config(50) };
            stress(source, directory, pages, wide, 30);
        }
    });
}

#[test]
fn a_slow_source_that_spoils_reads_now_and_then() {
    watched(|| {
        let (source, directory, pages) = sources(20);
        let faults = vec![
            (When::Every(3), Fault::Delay(Duration::from_millis(1))),
            // A joined read is repeated page by page, a page twice: no fault here strikes twice in a row.
            (When::Every(7), Fault::Short),
        ];
        let faulty = Faulty::new(source, faults);
        // One thread, so that reads are counted in the order in which it makes them.
        let tight = CacheConfig { io_threads: 1, most_batches: 5, ..config(12) };
        stress(Arc::new(faulty), directory, pages, tight, 8);
    });
}

#[test]
fn every_page_fits_and_comes_once() {
    let (source, directory, pages) = sources(31);
    let cache = PageCache::new(source, directory, config(200)).expect("sizes fit");
    let all: Vec<u32> = (0..200).collect();
    let mut batch = cache.batch().expect("the first");
    let mut rest = &all[..];
    while !rest.is_empty() {
        let granted = batch.fetch(rest).expect("no faults");
        rest = &rest[granted..];
    }
    assert!(all.iter().all(|&p| batch.table().page(p).is_some_and(|m| is_right(m, &pages[p as usize]))));
    let stats = cache.stats();
    assert_eq!((stats.misses, stats.pages_read, stats.evictions, stats.resident_pages), (200, 200, 0, 200));
    assert!(stats.reads < 100, "neighbours are read together: {stats:?}");
}

/// Two caches, batches that need pages of both, and room for little more than one page each.
#[test]
fn batches_of_two_caches_do_not_wait_for_each_other_for_ever() {
    watched(|| {
        let make = |seed| {
            let (source, directory, pages) = sources(seed);
            let tight = CacheConfig { most_batches: 4, ..config(5) };
            (PageCache::new(source, directory, tight).expect("sizes fit"), pages)
        };
        let caches = [make(40), make(41)];
        std::thread::scope(|scope| {
            for number in 0..4 {
                let caches = &caches;
                scope.spawn(move || {
                    let mut numbers = Numbers::new(number + 50);
                    let [mut one, mut other] =
                        [0, 1].map(|i| caches[i].0.batch().expect("as many as planned"));
                    for _ in 0..150 {
                        let [a, b] = [(); 2].map(|()| [numbers.below(200) as u32]);
                        let b = if numbers.below(3) == 0 { &[][..] } else { &b };
                        Batch::fetch_all(&mut [(&mut one, &a), (&mut other, b)]).expect("no faults");
                        for (batch, page, pages) in
                            [(&one, a.first(), &caches[0].1), (&other, b.first(), &caches[1].1)]
                        {
                            let right = |&p: &u32| {
                                batch.table().page(p).is_some_and(|m| is_right(m, &pages[p as usize]))
                            };
                            assert!(page.is_none_or(right));
                        }
                    }
                });
            }
        });
        caches.iter().for_each(|(cache, _)| cache.validate());
    });
}
