//! Sources that fail: who waits is told what, and the cache stays usable.

use super::*;
use crate::source::{Fault, Faulty, Source, When};

/// Twenty pages one behind the other, read with these faults.
fn faulty(faults: impl FnOnce(&Directory) -> Vec<(When, Fault)>, slots: usize) -> (PageCache, Vec<Vec<u8>>) {
    let pages: Vec<Vec<u8>> = (0..20_u8).map(|number| vec![number; 1000]).collect();
    let directory = Directory::packed(50, &pages);
    let bytes: Vec<u8> = std::iter::repeat_n(0, 50).chain(pages.iter().flatten().copied()).collect();
    let inner = Arc::new(MemorySource::new("bad.pages", bytes));
    let source: Arc<dyn Source> = Arc::new(Faulty::new(inner, faults(&directory)));
    (PageCache::new(source, directory, config(slots)).expect("sizes fit"), pages)
}

fn start(directory: &Directory, page: u32) -> u64 {
    directory.get(page).expect("there").offset
}

#[test]
fn a_damaged_page_is_named_and_its_neighbours_come() {
    watched(|| {
        let (cache, pages) = faulty(
            |d| {
                let flipped = start(d, 4) + 17;
                vec![(When::Covers(flipped), Fault::Flip(flipped))]
            },
            40,
        );
        let mut batch = cache.batch().expect("the first");
        let wanted = [4, 3];
        let error = batch.fetch(&wanted).expect_err("page 4 is damaged");
        let PageFault::Checksum { name, entry, found } = &error.fault else { panic!("{error}") };
        assert_eq!((error.page, &**name, entry.offset, entry.bytes), (4, "bad.pages", 4050, 1000));
        assert_ne!(*found, entry.crc32);
        assert!(error.to_string().starts_with("page 4: bad.pages, bytes 4050 to 5050: crc32"), "{error}");
        assert!(batch.table().page(4).is_none() && batch.table().page(3).is_some(), "the neighbour is right");
        assert_eq!(batch.fetch(&[5, 3]), Ok(2), "the cache stays usable");
        assert!(batch.table().page(5).is_some_and(|memory| is_right(memory, &pages[5])));
        assert_eq!(batch.fetch(&[4]).map_err(|error| error.page), Err(4));
        drop(batch);
        cache.validate();
        assert_eq!(cache.stats().failures, 2);
    });
}

#[test]
fn bytes_that_are_spoilt_on_the_way_are_read_again() {
    watched(|| {
        let flip =
            |d: &Directory| vec![(When::Read(0), Fault::Flip(start(d, 2))), (When::Read(2), Fault::Short)];
        let (cache, pages) = faulty(flip, 40);
        let mut batch = cache.batch().expect("the first");
        for page in [2, 5] {
            assert_eq!(batch.fetch(&[page]), Ok(1));
            assert!(batch.table().page(page).is_some_and(|memory| is_right(memory, &pages[page as usize])));
        }
        assert_eq!(cache.stats().reads, 4);
    });
}

#[test]
fn a_read_that_fails_once_fails_one_fetch() {
    watched(|| {
        let (cache, _) = faulty(|_| vec![(When::Read(0), Fault::Error)], 40);
        let mut batch = cache.batch().expect("the first");
        let error = batch.fetch(&[7]).expect_err("the read fails");
        let PageFault::Source(source) = &error.fault else { panic!("{error}") };
        assert_eq!((error.page, source.name.as_str(), source.offset), (7, "bad.pages", 7050));
        assert_eq!(batch.fetch(&[7]), Ok(1));
    });
}

#[test]
fn a_source_that_vanishes_fails_every_fetch_and_nobody_hangs() {
    watched(|| {
        let (cache, _) = faulty(|_| vec![(When::Read(3), Fault::Vanish)], 8);
        let failed: usize = std::thread::scope(|scope| {
            let worker = |first: usize| {
                let cache = &cache;
                scope.spawn(move || {
                    let mut batch = cache.batch().expect("few enough");
                    let order = (0..60).map(|i| ((first + i * 7) % 20) as u32);
                    order
                        .filter(|&page| batch.table().page(page).is_none() && batch.fetch(&[page]).is_err())
                        .count()
                })
            };
            let workers: Vec<_> = (0..8).map(worker).collect();
            workers.into_iter().map(|worker| worker.join().expect("no panic")).sum()
        });
        assert!(failed > 100, "{failed}");
        cache.validate();
    });
}

#[test]
fn all_who_wait_for_a_page_are_told() {
    watched(|| {
        let slow =
            vec![(When::Always, Fault::Delay(Duration::from_millis(30))), (When::Always, Fault::Error)];
        let (cache, _) = faulty(|_| slow, 8);
        std::thread::scope(|scope| {
            for _ in 0..8 {
                scope.spawn(|| {
                    let mut batch = cache.batch().expect("few enough");
                    assert_eq!(batch.fetch(&[11]).map_err(|error| error.page), Err(11));
                });
            }
        });
        assert!(cache.stats().reads < 8, "they share reads: {:?}", cache.stats());
    });
}

#[test]
fn a_page_that_is_not_there_is_an_error_and_lets_go_of_what_was_kept() {
    let (cache, _) = faulty(|_| Vec::new(), 8);
    let mut batch = cache.batch().expect("the first");
    batch.fetch(&[1]).expect("there");
    for page in [20, u32::MAX] {
        let error = batch.fetch(&[page]).expect_err("there are 20");
        assert_eq!(error.fault, PageFault::NoSuchPage { pages: 20 });
    }
    cache.validate();
}
