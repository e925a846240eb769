//! Pictures of a store do not depend on how it is paged: at random budgets, policies, batches, threads and delays of the disk,
//! which change the order in which pages come, they have the bits of the picture with all pages in memory, and of the scene in
//! memory.

mod common;

use common::random::Random;
use common::{SCENES, differing, is_soak, options, packed, picture, request};
use std::sync::Arc;
use std::time::Duration;
use vastlight::film::Picture;
use vastlight::paging::{Fault, Faulty, MemorySource, PolicyKind, When};
use vastlight::store::PackConfig;
use vastlight::{OpenScene, PagingRequest, RenderRequest, load, open_store};

/// Bytes of texture of the scene that has any.
const TEXTURE_BYTES: u64 = 1 << 20;

/// A request for the proof's picture: larger in the long one.
fn asked(open: &OpenScene) -> RenderRequest {
    let mut request = request(&open.scene);
    if is_soak() {
        (request.settings.width, request.settings.height, request.spp) = (192, 108, 4);
    }
    request
}

/// A store in memory behind a disk with faults, and the number of reads that opening it takes.
fn behind_faults(bytes: &Arc<MemorySource>, faults: Vec<(When, Fault)>, scene: &str) -> (OpenScene, u64) {
    let faulty = Arc::new(Faulty::new(bytes.clone(), faults));
    let open = open_store(faulty.clone(), &options(scene, TEXTURE_BYTES)).expect("opens");
    (open, faulty.reads())
}

/// A way to page by chance.
fn any_paging(random: &mut Random) -> PagingRequest {
    PagingRequest {
        cache_fraction: Some(*random.of(&[0.0, 0.02, 0.05, 0.1, 0.2, 0.35, 0.6, 1.0])),
        tile_memory: *random.of(&[None, None, Some(0), Some(1 << 16), Some(1 << 20)]),
        batches_per_thread: 1 + random.below(4),
        paths_per_batch: *random.of(&[None, Some(64), Some(300), Some(2048)]),
        read_ahead: *random.of(&[0, 0, 1, 3, 8]),
        policy: *random.of(&PolicyKind::ALL),
        ..PagingRequest::default()
    }
}

/// A slow disk by chance, and one read that brings half of what was asked for, or a wrong bit: pages are read again.
fn any_faults(opening: u64, random: &mut Random) -> Vec<(When, Fault)> {
    let delay = Duration::from_micros(50 << random.below(5));
    let wrong = When::Read(opening + random.below(50) as u64);
    match random.below(4) {
        0 => vec![],
        1 => vec![(When::Every(1 + random.below(7) as u64), Fault::Delay(delay))],
        2 => vec![(wrong, Fault::Short)],
        _ => vec![(When::Every(3), Fault::Delay(delay)), (wrong, Fault::Flip(0))],
    }
}

fn on_threads(threads: usize, open: &OpenScene, request: &RenderRequest) -> Picture {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
    pool.install(|| picture(open, request)).expect("renders")
}

#[test]
fn no_way_to_page_changes_a_picture() {
    let rounds = if is_soak() { 200 } else { 20 };
    for scene in SCENES {
        let start = std::time::Instant::now();
        let in_memory: OpenScene = load(scene, &options(scene, TEXTURE_BYTES)).expect("a demo").into();
        let expected = picture(&in_memory, &asked(&in_memory)).expect("renders");
        let config = PackConfig { page_bytes: 1 << 12, tile_bytes: 256, ..PackConfig::default() };
        let bytes =
            Arc::new(MemorySource::new("a store", packed(scene, &options(scene, TEXTURE_BYTES), &config).0));
        let (resident, opening) = behind_faults(&bytes, Vec::new(), scene);
        let mut request = asked(&resident);
        request.paging.cache_fraction = Some(1.0);
        assert_eq!(differing(&picture(&resident, &request).expect("renders"), &expected), 0, "{scene}");
        for round in 0..rounds {
            let mut random = Random::new(round);
            let faults = any_faults(opening, &mut random);
            let (stored, _) = behind_faults(&bytes, faults.clone(), scene);
            request.paging = any_paging(&mut random);
            let threads = 1 + random.below(4);
            let found = on_threads(threads, &stored, &request);
            let paging = request.paging;
            assert_eq!(differing(&found, &expected), 0, "{scene} {threads} {paging:?} {faults:?}");
        }
        request.settings.seed += 1;
        let other = on_threads(2, &resident, &request);
        assert!(differing(&other, &expected) > 1000, "{scene}: another seed is another picture");
        println!("{scene}: {rounds} ways to page, {:?}", start.elapsed());
    }
}
