//! Stores of scenes that move: pictures of any moment are those of the scene in memory.

mod common;

use common::{animated, differing, request};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use vastlight::film::Picture;
use vastlight::store::PackConfig;
use vastlight::trace::UpdateMethod;
use vastlight::{
    Control, Error, ErrorClass, LoadOptions, OpenScene, PackControl, RenderRequest, Session, cached_store,
    load, open, pack_input, pack_within,
};

fn name(path: &Path) -> String {
    path.display().to_string()
}

/// Packs sources as the command does, in small pages.
fn packed(folder: &Path, sources: &[String], options: &LoadOptions) -> PathBuf {
    let path = folder.join("scene.vls");
    let control = PackControl { memory: None, cancel: &AtomicBool::new(false), progress: &|_| {} };
    let config = PackConfig { page_bytes: 1 << 12, ..PackConfig::default() };
    let input = pack_input(sources, options, None).expect("read");
    pack_within(input, &path, &config, control).expect("packed");
    path
}

/// The picture of a moment.
fn frame(
    session: &mut Session,
    time: f32,
    (fraction, update): (Option<f32>, UpdateMethod),
) -> Result<Picture, Error> {
    session.pose(time)?;
    let mut request = request(&session.open().scene);
    request.paging.cache_fraction = fraction;
    request.tracer.update = update;
    let cancel = AtomicBool::new(false);
    let control = Control::new(&cancel, &|_| {});
    Ok(session.render(&request, &control)?.develop())
}

#[test]
fn frames_share_the_pages_that_are_in_memory() {
    let folder = tempfile::tempdir().expect("a folder");
    let source = name(&animated::write(folder.path()));
    let store = name(&packed(folder.path(), &[source], &LoadOptions::default()));
    let mut session = session(&store, &LoadOptions::default());
    let mut request = request(&session.open().scene);
    request.paging.cache_fraction = Some(1.0);
    let cancel = AtomicBool::new(false);
    let reads = |session: &mut Session, request: &RenderRequest| {
        session.pose(0.5).expect("moves");
        let rendered = session.render(request, &Control::new(&cancel, &|_| {})).expect("renders");
        let paging = rendered.stats.paging.expect("of a store");
        assert!(paging.geometry.hits > 0 && paging.geometry.resident_pages > 0);
        (paging.geometry.misses, paging.geometry.bytes_read)
    };
    let first = reads(&mut session, &request);
    assert!(first.0 > 0 && first.1 > 0, "{first:?}");
    assert_eq!(reads(&mut session, &request), (0, 0));
    // Other caches, and a larger picture, for which they may be too large.
    request.paging.cache_fraction = Some(0.9);
    assert!(reads(&mut session, &request).0 > 0);
    request.settings.height *= 2;
    assert!(reads(&mut session, &request).0 > 0);
}

fn session(source: &str, options: &LoadOptions) -> Session {
    Session::new(open(source, options).expect("opens"), source, options)
}

/// Follows a scene in memory and its store through moments, with a part of the pages in memory.
fn check_frames(source: &str, options: &LoadOptions, times: &[f32], fraction: f32) {
    let folder = tempfile::tempdir().expect("a folder");
    let store = name(&packed(folder.path(), &[source.to_owned()], options));
    let still = LoadOptions { import: Default::default(), ..LoadOptions::default() };
    let mut resident = session(source, options);
    let mut stored = session(&store, &still);
    let mut before: Option<Picture> = None;
    for &time in times {
        let expected = frame(&mut resident, time, (None, UpdateMethod::Auto)).expect("renders");
        let found = frame(&mut stored, time, (Some(fraction), UpdateMethod::Clustered)).expect("renders");
        assert_eq!(differing(&found, &expected), 0, "{source} at {time}");
        assert_eq!(stored.moving_triangles(), resident.moving_triangles());
        if let Some(before) = before.replace(found) {
            assert!(differing(&expected, &before) > 100, "{source} moves until {time}");
        }
        let alone = LoadOptions { time: Some(time), ..still.clone() };
        let opened = open(&store, &alone).expect("opens");
        assert_eq!(differing(&picture(&opened), &expected), 0, "{source} opened at {time}");
    }
}

fn picture(open: &OpenScene) -> Picture {
    let mut request = request(&open.scene);
    request.paging.cache_fraction = open.stored.as_ref().map(|_| 0.5);
    common::picture(open, &request).expect("renders")
}

#[test]
fn frames_of_a_document_in_a_store_are_those_of_the_document() {
    let folder = tempfile::tempdir().expect("a folder");
    let source = name(&animated::write(folder.path()));
    // Forwards, with a sheet that is not to be seen, backwards, and beyond the end.
    for fraction in [0.0, 0.4, 1.0] {
        check_frames(&source, &LoadOptions::default(), &[0.3, 1.0, 1.9, 0.7, 5.0, 0.3], fraction);
    }
}

#[test]
fn frames_of_a_demo_in_a_store_are_those_of_the_demo() {
    let mut options = LoadOptions::default();
    options.generate.triangles = Some(30_000);
    check_frames("demo:bodies", &options, &[0.5, 1.5, 0.25], 0.3);
    if common::is_soak() {
        options.generate.triangles = Some(400_000);
        check_frames("demo:traffic", &options, &[0.5, 3.0, 0.25, 11.0], 0.1);
        check_frames("demo:walker", &LoadOptions::default(), &[0.5, 3.0, 0.25], 0.3);
    }
}

#[test]
fn a_store_at_rest_is_the_scene_at_rest_and_only_what_deforms_is_in_memory() {
    let folder = tempfile::tempdir().expect("a folder");
    let source = name(&animated::write(folder.path()));
    let store = name(&packed(folder.path(), std::slice::from_ref(&source), &LoadOptions::default()));
    let stored = open(&store, &LoadOptions::default()).expect("opens");
    let resident = load(&source, &LoadOptions::default()).expect("read");
    let in_memory: Vec<usize> = stored.scene.meshes().iter().map(|mesh| mesh.triangles.len()).collect();
    assert_eq!(in_memory, [288, 0, 0, 288], "the bump, the sheet, the floor, the bent one");
    assert_eq!(stored.triangles_beside_pages(), 576);
    assert_eq!(stored.scene.instances(), resident.instances());
    assert_eq!(stored.scene.extents(), resident.extents());
    assert_eq!(differing(&picture(&stored), &picture(&resident.into())), 0);
    let mut request = request(&stored.scene);
    request.paging.memory = Some(1 << 20);
    let error = common::picture(&stored, &request).expect_err("too small");
    assert!(error.class == ErrorClass::Memory && error.what.contains("needed"), "{error}");
}

#[test]
fn what_a_store_does_not_keep_is_said() {
    let folder = tempfile::tempdir().expect("a folder");
    let source = name(&animated::write(folder.path()));
    let warned = |store: &OpenScene| {
        let items = store.scene.diagnostics().items();
        items.iter().any(|item| item.what.contains("stands still") && item.hint.contains("--time"))
    };
    // Several scenes in one, of which one moves.
    let both = [source.clone(), "demo:cornell".to_owned()];
    let store = name(&packed(folder.path(), &both, &LoadOptions::default()));
    let stored = open(&store, &LoadOptions::default()).expect("opens");
    assert!(warned(&stored) && stored.scene.motion().is_none());
    let at = |time: f32| LoadOptions { time: Some(time), ..LoadOptions::default() };
    assert!(open(&store, &at(0.5)).expect_err("still").what.contains("nothing moves"));
    // One that was packed for its moment.
    let store = name(&packed(folder.path(), std::slice::from_ref(&source), &at(0.5)));
    let stored = open(&store, &LoadOptions::default()).expect("opens");
    assert!(!warned(&stored) && stored.scene.motion().is_none());
    let expected = load(&source, &at(0.5)).expect("read");
    assert_eq!(differing(&picture(&stored), &picture(&expected.into())), 0);
    // A sequence of files.
    for (file, x) in [("s1.ply", 1.0), ("s2.ply", 2.0)] {
        let head = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                    element face 1\nproperty list uchar int vertex_indices\nend_header\n";
        std::fs::write(folder.path().join(file), format!("{head}0 0 0\n{x} 0 0\n0 1 0\n3 0 1 2\n"))
            .expect("written");
    }
    let sequence = name(&folder.path().join("s#.ply"));
    let store = name(&packed(folder.path(), &[sequence], &LoadOptions::default()));
    assert!(warned(&open(&store, &LoadOptions::default()).expect("opens")));
    let mut options = LoadOptions::default();
    options.import.animation = Some("walk".into());
    assert_eq!(open(&store, &options).expect_err("too late").class, ErrorClass::Usage);
}

#[test]
fn a_cached_store_serves_all_moments() {
    let folder = tempfile::tempdir().expect("a folder");
    let source = name(&animated::write_over(folder.path(), 420));
    let at = |time: f32| LoadOptions { time: Some(time), ..LoadOptions::default() };
    let cached = |time: f32, memory: u64| {
        let control =
            PackControl { memory: Some(memory), cancel: &AtomicBool::new(false), progress: &|_| {} };
        cached_store(&source, &at(time), &folder.path().join("stores"), control).expect("packs")
    };
    assert_eq!(cached(0.5, 1 << 30), None, "it fits");
    let [first, second] = [0.5, 1.5].map(|time| cached(time, 128 << 20).expect("it does not fit"));
    assert_eq!((&first.path, first.time, second.time), (&second.path, Some(0.5), Some(1.5)));
    let expected = load(&source, &at(1.5)).expect("read");
    let stored = open(&name(&second.path), &at(1.5)).expect("opens");
    assert_eq!(differing(&picture(&stored), &picture(&expected.into())), 0);
}
