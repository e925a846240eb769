//! Pictures of stores: the same as of the scene in memory, whatever part of the store fits into memory; and damaged
//! stores.

mod common;

use common::{differing, opened as opened_with, packed as packed_with, request};
use std::path::Path;
use std::sync::Arc;
use vastlight::film::Picture;
use vastlight::paging::{Fault, Faulty, MemorySource, When};
use vastlight::store::PackConfig;
use vastlight::{Error, ErrorClass, LoadOptions, OpenScene, load, open, open_store, pack, stream};

fn options() -> LoadOptions {
    let mut options = LoadOptions::default();
    options.generate.triangles = Some(20_000);
    options
}

/// What the demo is where its size cannot be chosen.
fn fitting(name: &str) -> LoadOptions {
    if load(name, &options()).is_ok() { options() } else { LoadOptions::default() }
}

fn packed(name: &str, page_bytes: usize) -> Vec<u8> {
    packed_with(name, &fitting(name), &PackConfig { page_bytes, ..PackConfig::default() }).0
}

fn opened(bytes: Vec<u8>) -> Result<OpenScene, Error> {
    opened_with(bytes, &LoadOptions::default())
}

fn picture(open: &OpenScene, cache_fraction: Option<f32>) -> Result<Picture, Error> {
    let mut request = request(&open.scene);
    request.paging.cache_fraction = cache_fraction;
    common::picture(open, &request)
}

#[test]
fn pictures_do_not_depend_on_what_is_in_memory() {
    // Lamps, glass, panes, textures with normals, one large mesh.
    for name in ["demo:cornell", "demo:still-life", "demo:atrium", "demo:statue"] {
        let expected = picture(&load(name, &fitting(name)).expect("a demo").into(), None).expect("renders");
        let stored = opened(packed(name, 1 << 12)).expect("opens");
        assert!(stored.scene.extents().iter().any(|extent| extent.triangles > 0));
        for fraction in [1.0, 0.3, 0.05, 0.0] {
            let found = picture(&stored, Some(fraction)).expect("renders");
            assert_eq!(differing(&found, &expected), 0, "{name} with {fraction} in memory");
        }
        let mut other = request(&stored.scene);
        other.settings.seed = 1;
        let other = common::picture(&stored, &other).expect("renders");
        assert!(differing(&other, &expected) > 1000, "{name}: another seed is another picture");
    }
}

#[test]
fn a_store_on_disk_is_opened_by_its_name_and_the_same_scene_gives_the_same_bytes() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("scene.vls");
    let bytes = packed("demo:still-life", 1 << 14);
    std::fs::write(&path, &bytes).expect("writes");
    assert_eq!(bytes, packed("demo:still-life", 1 << 14));
    let name = path.display().to_string();
    let stored = open(&name, &LoadOptions::default()).expect("opens");
    assert!(stored.stored.is_some() && stored.scene.unique_triangles() > 1000);
    let error = load(&name, &LoadOptions::default()).expect_err("not in memory");
    assert!(error.to_string().contains("memory"), "{error}");
}

#[test]
fn what_does_not_fit_is_refused_before_work() {
    let stored = opened(packed("demo:cornell", 1 << 14)).expect("opens");
    let mut request = request(&stored.scene);
    request.paging.memory = Some(1 << 20);
    let error = common::picture(&stored, &request).expect_err("too small");
    assert_eq!(error.class, ErrorClass::Memory);
    assert!(error.what.contains("needed"), "{error}");
}

#[test]
fn damaged_stores_are_errors_that_say_where() {
    let sound = packed("demo:cornell", 1 << 12);
    let outcome = |bytes| picture(&opened(bytes)?, Some(0.5));
    let expected = outcome(sound.clone()).expect("renders");
    let (mut state, mut refused) = (11_u64, 0);
    for round in 0..300 {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let place = (state >> 33) as usize % sound.len();
        let mut bytes = sound.clone();
        if round % 4 == 0 {
            bytes.truncate(place);
        } else {
            bytes[place] ^= 1 << (round % 8);
        }
        match outcome(bytes) {
            // What was hit is padding, or a page that no ray looks at.
            Ok(found) => assert_eq!(differing(&found, &expected), 0, "{place}"),
            Err(error) => {
                refused += 1;
                assert_eq!(error.class, ErrorClass::Scene, "{error}");
                assert!(error.to_string().contains("a store"), "{error}");
            }
        }
    }
    assert!(refused > 150, "{refused}");
}

#[test]
fn a_page_that_cannot_be_read_ends_the_render_with_its_number() {
    let bytes = packed("demo:statue", 1 << 12);
    let source = Arc::new(MemorySource::new("a store", bytes));
    let counting = Arc::new(Faulty::new(source.clone(), Vec::new()));
    open_store(counting.clone(), &LoadOptions::default()).expect("opens");
    // From the first page on the file is gone.
    let faults = vec![(When::Read(counting.reads()), Fault::Vanish)];
    let faulty = Arc::new(Faulty::new(source, faults));
    let stored = open_store(faulty, &LoadOptions::default()).expect("opens");
    let error = picture(&stored, Some(0.5)).expect_err("no page can be had");
    assert!(error.to_string().contains("page"), "{error}");
}

#[test]
fn a_store_that_cannot_be_written_leaves_nothing() {
    let stream = stream("demo:cornell", &LoadOptions::default()).expect("a demo");
    let error = pack(stream, Path::new("/nowhere/at/all.vls"), &PackConfig::default(), |_| {})
        .expect_err("no folder");
    assert_eq!(error.class, ErrorClass::Output);
}
