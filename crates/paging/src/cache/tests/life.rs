//! Batches that come and go, and caches that cannot be.

use super::*;
use crate::policy::PolicyKind;
use crate::source::{Fault, Faulty, Source, When};
use std::time::Instant;

fn cache(slots: usize, most_batches: usize) -> (PageCache, Vec<Vec<u8>>) {
    let pages = pages_of(30, 1);
    let (source, directory) = file_of(&pages, false);
    let config = CacheConfig { most_batches, ..config(slots) };
    (PageCache::new(Arc::new(source), directory, config).expect("sizes fit"), pages)
}

#[test]
fn a_fetch_grants_the_first_of_what_was_asked_for_and_keeps_it() {
    watched(|| {
        let (cache, _) = cache(8, 2);
        assert_eq!(cache.config().quota(), 2);
        let (mut one, mut other) = (cache.batch().expect("first"), cache.batch().expect("second"));
        assert_eq!(one.fetch(&[9, 4, 7]), Ok(2));
        assert!(one.table().page(7).is_none());
        // The other one wants everything: the two that are kept stay.
        for page in 10..30 {
            assert_eq!(other.fetch(&[page]), Ok(1));
            let now = cache.snapshot();
            assert!(now.page(9).is_some() && now.page(4).is_some());
        }
        assert_eq!(
            cache.batch().expect_err("two are planned"),
            CacheError::TooManyBatches { most_batches: 2 }
        );
        drop(one);
        other.rest();
        let mut third = cache.batch().expect("there is a place again");
        for page in 0..30 {
            third.fetch(&[page]).expect("what the dropped one kept may leave");
        }
        cache.validate();
    });
}

#[test]
fn half_a_fetch_goes_on_with_the_first_and_half_and_the_rest_comes_by_itself() {
    watched(|| {
        let (cache, _) = cache(20, 1);
        let mut batch = cache.batch().expect("first");
        let wanted: Vec<u32> = (0..10).rev().collect();
        assert_eq!(cache.config().quota(), 10);
        Batch::fetch_half(&mut [(&mut batch, &wanted)]).expect("there");
        let there = |table: &Table| wanted.iter().filter(|&&page| table.page(page).is_some()).count();
        assert!(batch.table().page(9).is_some() && there(batch.table()) >= 5);
        while there(&cache.snapshot()) < 10 {
            std::thread::yield_now();
        }
        cache.validate();
        let unknown = Batch::fetch_half(&mut [(&mut batch, &[30])]).expect_err("there are 30");
        assert_eq!(unknown.fault, PageFault::NoSuchPage { pages: 30 });
        // One that is dropped while pages are on their way leaves nothing behind.
        drop(batch);
        for page in 10..20 {
            let mut batch = cache.batch().expect("there is a place again");
            Batch::fetch_half(&mut [(&mut batch, &[page, page + 10, 0, 1])]).expect("there");
            assert!(batch.table().page(page).is_some());
        }
        cache.validate();
    });
}

#[test]
fn a_snapshot_stays_as_it_is_and_its_memory_is_used_again_when_it_is_gone() {
    watched(|| {
        let (cache, pages) = cache(2, 1);
        let mut batch = cache.batch().expect("first");
        batch.fetch(&[3]).expect("there");
        let kept = cache.snapshot();
        batch.fetch(&[5]).expect("there");
        std::thread::scope(|scope| {
            let fetch = scope.spawn(|| {
                batch.fetch(&[6]).expect("as soon as the snapshot is gone or page 5 left");
                batch.fetch(&[8]).expect("the same");
            });
            std::thread::sleep(Duration::from_millis(20));
            assert!(!fetch.is_finished() || kept.page(3).is_some());
            assert!(kept.page(3).is_some_and(|memory| is_right(memory, &pages[3])));
            drop(kept);
        });
        assert_eq!(cache.stats().peak_bytes, 2 * 4096, "never more than two slots");
    });
}

#[test]
fn a_page_that_left_comes_back_without_a_read_while_its_memory_is_there() {
    watched(|| {
        let (cache, pages) = cache(2, 1);
        let mut batch = cache.batch().expect("first");
        batch.fetch(&[1]).expect("there");
        batch.fetch(&[2]).expect("there");
        let _kept = cache.snapshot();
        let mut state = cache.shared.lock();
        state.unpin(0);
        assert_eq!(state.make_room(2, false), 0, "both left, and both are still read");
        drop(state);
        let reads = cache.stats().reads;
        batch.fetch(&[1]).expect("there");
        assert!(batch.table().page(1).is_some_and(|memory| is_right(memory, &pages[1])));
        let stats = cache.stats();
        assert_eq!((stats.reads, stats.pages_revived, stats.resident_pages), (reads, 1, 1));
        cache.validate();
    });
}

#[test]
fn hints_fill_free_slots_and_drive_nothing_out_that_is_used() {
    watched(|| PolicyKind::ALL.into_iter().for_each(hints_drive_nothing_out));
}

fn hints_drive_nothing_out(policy: PolicyKind) {
    let pages = pages_of(30, 1);
    let (source, directory) = file_of(&pages, false);
    let config = CacheConfig { most_batches: 1, policy, ..config(6) };
    let cache = PageCache::new(Arc::new(source), directory, config).expect("sizes fit");
    let mut batch = cache.batch().expect("first");
    for page in 0..3 {
        batch.fetch(&[page]).expect("there");
        batch.parts().1.add(page);
    }
    batch.rest();
    cache.prefetch(&(10..30).collect::<Vec<u32>>());
    let start = Instant::now();
    while cache.stats().pages_ahead < 3 && start.elapsed() < Duration::from_secs(20) {
        std::thread::yield_now();
    }
    let now = cache.snapshot();
    assert!((0..3).all(|page| now.page(page).is_some()), "used pages stay: {}", policy.name());
    assert!(cache.stats().pages_ahead >= 3);
    drop(now);
    cache.validate();
}

#[test]
fn what_is_behind_comes_with_what_was_asked_for() {
    watched(|| {
        let pages: Vec<Vec<u8>> = (0..9_u8).map(|number| vec![number; 500]).collect();
        let source = MemorySource::new("m", pages.concat());
        let config = CacheConfig { read_ahead: 3, ..config(9) };
        let directory = Directory::packed(0, &pages);
        let cache = PageCache::new(Arc::new(source), directory, config).expect("sizes fit");
        let mut batch = cache.batch().expect("first");
        batch.fetch(&[2]).expect("there");
        let there: Vec<u32> = (0..9).filter(|&page| batch.table().page(page).is_some()).collect();
        assert_eq!((there, cache.stats().reads), (vec![2, 3, 4, 5], 1));
        batch.fetch(&[7]).expect("there");
        let there = (0..9).filter(|&page| batch.table().page(page).is_some()).count();
        assert_eq!((there, cache.stats().pages_ahead), (6, 4), "the file ends behind page 8");
    });
}

#[test]
fn a_cache_that_is_dropped_tells_those_who_wait() {
    watched(|| {
        let pages = pages_of(30, 1);
        let (source, directory) = file_of(&pages, false);
        let slow =
            Faulty::new(Arc::new(source), vec![(When::Always, Fault::Delay(Duration::from_millis(50)))]);
        let source: Arc<dyn Source> = Arc::new(slow);
        let config = CacheConfig { io_threads: 1, most_batches: 4, reserve: 0, ..config(4) };
        let cache = PageCache::new(source, directory, config).expect("sizes fit");
        let mut batches: Vec<Batch> = (0..4).map(|_| cache.batch().expect("four")).collect();
        std::thread::scope(|scope| {
            for (number, batch) in batches.iter_mut().enumerate() {
                scope.spawn(move || {
                    let ends = (0..30).map(|page| batch.fetch(&[(page * 3 + number as u32) % 30]));
                    let error =
                        ends.filter_map(Result::err).next().expect("the cache goes away before the end");
                    assert_eq!(error.fault, PageFault::Closed);
                });
            }
            std::thread::sleep(Duration::from_millis(120));
            drop(cache);
        });
        assert_eq!(batches[0].fetch(&[1]).map_err(|error| error.fault), Err(PageFault::Closed));
    });
}

#[test]
fn sizes_that_contradict_each_other_are_errors() {
    let pages = [vec![1; 4000], vec![2; 4090]];
    let make = |config| {
        let source = MemorySource::new("m", pages.concat());
        PageCache::new(Arc::new(source), Directory::packed(0, &pages), config).map(|_| ())
    };
    let good = CacheConfig::new(4, 4096);
    assert_eq!(make(good), Ok(()));
    for slot_bytes in [0, 1, 4095, 6004] {
        assert_eq!(make(CacheConfig { slot_bytes, ..good }), Err(CacheError::SlotBytes { slot_bytes }));
    }
    let small = CacheError::SlotTooSmall { page: 1, bytes: 4097, slot_bytes: 4096 };
    assert_eq!(make(CacheConfig { slack: 7, ..good }), Err(small));
    for (slots, most_batches) in [(0, 0), (0, 1), (3, 4), (3, 0)] {
        let few = CacheError::TooFewSlots { slots, most_batches };
        assert_eq!(make(CacheConfig { slots, most_batches, ..good }), Err(few));
    }
    let none = MemorySource::new("empty", Vec::new());
    let cache = PageCache::new(Arc::new(none), Directory::default(), good).expect("no pages, no trouble");
    assert_eq!(cache.batch().expect("first").fetch(&[]), Ok(0));
}

#[test]
fn the_quotas_of_all_batches_fit_into_the_slots() {
    for slots in 1..40 {
        for most_batches in 1..=slots {
            for reserve in [0, 1, slots / 2, slots, slots * 2] {
                let quota = CacheConfig { most_batches, reserve, ..CacheConfig::new(slots, 4096) }.quota();
                assert!(quota >= 1 && quota * most_batches <= slots);
            }
        }
    }
}

/// The checks that the stress tests lean on see what they are there to see.
#[test]
fn contradictions_are_found() {
    let (cache, pages) = cache(8, 2);
    let mut batch = cache.batch().expect("first");
    batch.fetch(&[3, 4]).expect("there");
    let spoil = |spoil: fn(&mut State)| {
        let mut state = cache.shared.lock();
        spoil(&mut state);
        state.validate()
    };
    assert_eq!(spoil(|_| ()), Ok(()));
    assert!(spoil(|state| state.stats.resident_pages += 1).is_err());
    assert!(spoil(|state| state.stats.resident_pages -= 1).is_ok());
    assert!(
        spoil(|state| state.batches.iter_mut().flatten().for_each(|waiting| waiting.pins.clear())).is_err()
    );
    let memory = batch.table().page(3).expect("there");
    assert!(is_right(memory, &pages[3]) && !is_right(memory, &pages[4]));
    let mut dirty = memory.to_vec();
    dirty[4095] = 1;
    assert!(!is_right(&dirty, &pages[3]), "what is behind a page is zero");
}
