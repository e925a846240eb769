//! Packing within a budget: meshes that go through the disk, several files in one store, packs that were stopped.

mod common;

use common::{differing, request};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use vastlight::film::Picture;
use vastlight::store::PackConfig;
use vastlight::{
    Error, ErrorClass, LoadOptions, OpenScene, PackControl, cached_store, describe, export, load, open,
    pack_input, pack_within, stream,
};

/// A budget in which some 65 thousand triangles are packed at a time.
const SMALL: u64 = 96 << 20;

fn options() -> LoadOptions {
    let mut options = LoadOptions::default();
    options.generate.triangles = Some(250_000);
    options
}

/// A folder with a mesh of 250 thousand triangles as a PLY file.
fn folder() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("statue.ply");
    let make = || Ok(describe("demo:statue", &options()).expect("a demo").into());
    export::write_stream(&make, &path).expect("writes");
    (folder, path)
}

fn name(path: &Path) -> String {
    path.display().to_string()
}

fn pack(sources: &[&Path], target: &Path, memory: Option<u64>) -> Result<u64, Error> {
    pack_until(sources, target, memory, u64::MAX)
}

/// Packs, and stops after some steps. The number of steps, of which the first tells what was done before.
fn pack_until(sources: &[&Path], target: &Path, memory: Option<u64>, stop: u64) -> Result<u64, Error> {
    let sources: Vec<String> = sources.iter().map(|path| name(path)).collect();
    let input = pack_input(&sources, &LoadOptions::default(), memory)?;
    let (steps, cancel) = (AtomicU64::new(0), AtomicBool::new(false));
    let progress = |_: &_| {
        let step = steps.fetch_add(1, Ordering::Relaxed) + 1;
        cancel.store(step >= stop, Ordering::Relaxed);
    };
    let control = PackControl { memory, cancel: &cancel, progress: &progress };
    pack_within(input, target, &PackConfig::default(), control)?;
    Ok(steps.into_inner())
}

fn picture(open: &OpenScene) -> Picture {
    let mut request = request(&open.scene);
    request.paging.cache_fraction = Some(0.5);
    common::picture(open, &request).expect("renders")
}

fn opened(path: &Path) -> OpenScene {
    open(&name(path), &LoadOptions::default()).expect("opens")
}

/// Names of the files beside a store.
fn files(folder: &Path) -> Vec<String> {
    let names = std::fs::read_dir(folder).expect("lists");
    let mut names: Vec<_> =
        names.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// The mesh of a file as a binary STL file beside it.
fn as_stl(path: &Path) -> PathBuf {
    let scene = load(&name(path), &LoadOptions::default()).expect("loads");
    let mesh = &scene.meshes()[0];
    let mut bytes = vec![0; 80];
    bytes.extend((mesh.triangles.len() as u32).to_le_bytes());
    for corners in &mesh.triangles {
        let places = corners.map(|corner| mesh.positions[corner as usize]);
        let numbers = [0.0; 3].into_iter().chain(places.into_iter().flat_map(|place| place.to_array()));
        bytes.extend(numbers.flat_map(f32::to_le_bytes));
        bytes.extend([0; 2]);
    }
    let stl = path.with_extension("stl");
    std::fs::write(&stl, bytes).expect("writes");
    stl
}

#[test]
fn a_mesh_that_goes_through_the_disk_is_the_same_mesh() {
    let (folder, ply) = folder();
    same_through_the_disk(&folder, &ply, SMALL);
    // Corners are welded through a table.
    same_through_the_disk(&folder, &as_stl(&ply), SMALL + (21 << 20));
}

fn same_through_the_disk(folder: &tempfile::TempDir, file: &Path, memory: u64) {
    let (whole, cut) = (folder.path().join("whole.vls"), folder.path().join("cut.vls"));
    assert_eq!(pack(&[file], &whole, None).expect("packs"), 1);
    assert!(pack(&[file], &cut, Some(memory)).expect("packs") > 4, "several buckets");
    let bytes = |path: &Path| std::fs::read(path).expect("reads");
    assert!(bytes(&whole) != bytes(&cut), "another tree");
    let (whole, cut) = (opened(&whole), opened(&cut));
    assert_eq!(whole.scene.extents(), cut.scene.extents());
    let layouts = |open: &OpenScene| open.stored.as_ref().map(|stored| stored.layouts.clone());
    assert_eq!(layouts(&whole), layouts(&cut));
    let in_memory = load(&name(file), &LoadOptions::default()).expect("loads").into();
    let expected = picture(&in_memory);
    assert_eq!(differing(&picture(&whole), &expected), 0);
    assert_eq!(differing(&picture(&cut), &expected), 0);
    let sources = &cut.stored.as_ref().expect("stored").sources;
    assert_eq!(sources.len(), 1);
    assert!(Path::new(&sources[0].name) == file && !sources[0].has_changed());
}

#[test]
fn a_mesh_in_memory_goes_through_the_disk_as_well() {
    let folder = tempfile::tempdir().expect("a folder");
    let target = folder.path().join("cut.vls");
    let stream = vastlight::stream("demo:statue", &options()).expect("a demo");
    let control = PackControl { memory: Some(SMALL), cancel: &AtomicBool::new(false), progress: &|_| {} };
    pack_within(stream.into(), &target, &PackConfig::default(), control).expect("packs");
    let expected = picture(&load("demo:statue", &options()).expect("a demo").into());
    assert_eq!(differing(&picture(&opened(&target)), &expected), 0);
    assert_eq!(files(folder.path()), ["cut.vls"]);
}

#[test]
fn a_pack_that_was_stopped_goes_on_and_gives_the_same_bytes() {
    let (folder, ply) = folder();
    let other = folder.path().join("other.ply");
    std::fs::copy(&ply, &other).expect("copies");
    stopped_after_each_step(folder.path(), &[&ply], SMALL);
    // A demo makes pieces ahead.
    stopped_after_each_step(folder.path(), &[&ply, Path::new("demo:cornell"), &other], SMALL + (64 << 20));
    // Another budget cuts otherwise: nothing of the first is used.
    let target = folder.path().join("scene.vls");
    pack_until(&[&ply], &target, Some(SMALL), 2).expect_err("stopped");
    assert_eq!(pack(&[&ply], &target, None).expect("packs"), 1);
}

fn stopped_after_each_step(folder: &Path, sources: &[&Path], memory: u64) {
    let (once, target) = (folder.join("once.vls"), folder.join("scene.vls"));
    let steps = pack(sources, &once, Some(memory)).expect("packs");
    for stop in 1..=steps {
        let error = pack_until(sources, &target, Some(memory), stop).expect_err("stopped");
        assert_eq!(error.class, ErrorClass::Interrupted);
        let unfinished = ["once.vls", "other.ply", "scene.vls.journal", "scene.vls.part", "statue.ply"];
        assert_eq!(files(folder), unfinished);
        if stop % 2 == 0 {
            // What stands behind the last step is not believed.
            let file = std::fs::OpenOptions::new().append(true).open(folder.join("scene.vls.part"));
            std::io::Write::write_all(&mut &file.expect("opens"), b"half a page").expect("writes");
        }
        let left = pack(sources, &target, Some(memory)).expect("packs");
        assert_eq!(left, steps - stop);
        let read = |path: &Path| std::fs::read(path).expect("reads");
        assert!(read(&once) == read(&target), "stopped after {stop} of {steps}");
        std::fs::remove_file(&target).expect("removes");
    }
    std::fs::remove_file(&once).expect("removes");
}

#[test]
fn several_files_and_places_make_one_store() {
    let (folder, ply) = folder();
    let manifest = folder.path().join("group.manifest.toml");
    let place = "[[place]]\nfile = 'statue.ply'\n";
    let text = format!("{place}{place}translate = [0.5, 0, 0]\nscale = 0.5\nrotate = [0, 30, 0]\n");
    std::fs::write(&manifest, text).expect("writes");
    let target = folder.path().join("group.vls");
    pack(&[&manifest], &target, Some(SMALL)).expect("packs");
    let stored = opened(&target);
    assert_eq!((stored.scene.meshes().len(), stored.scene.instances().len()), (1, 2));
    let expected = load(&name(&manifest), &LoadOptions::default()).expect("loads");
    assert_eq!(expected.bounds(), stored.scene.bounds());
    assert_eq!(differing(&picture(&stored), &picture(&expected.into())), 0);
    assert_eq!(stored.stored.expect("stored").sources.len(), 2);
    pack(&[&ply, Path::new("demo:cornell")], &target, None).expect("packs");
    assert!(opened(&target).scene.meshes().len() > 2);
}

#[test]
fn all_files_of_a_sequence_are_sources_at_rest_and_at_a_moment() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |file: &str, text: String| {
        std::fs::write(folder.path().join(file), text).expect("writes");
    };
    let triangle = |height: f32| format!("mtllib plain.mtl\nv 0 0 0\nv 1 0 0\nv 0 {height} 0\nf 1 2 3\n");
    (1..4_u8).for_each(|i| write(&format!("mesh.0{i}.obj"), triangle(f32::from(i))));
    write("plain.mtl", "newmtl plain\n".into());
    let (sequence, target) = (name(&folder.path().join("mesh.##.obj")), folder.path().join("scene.vls"));
    for (time, height) in [(None, 1.0), (Some(0.5), 1.5), (Some(2.0), 3.0)] {
        let mut options = LoadOptions { time, ..LoadOptions::default() };
        options.import.sequence_fps = 1.0;
        let input = pack_input(std::slice::from_ref(&sequence), &options, None).expect("reads");
        let control = PackControl { memory: None, cancel: &AtomicBool::new(false), progress: &|_| {} };
        pack_within(input, &target, &PackConfig::default(), control).expect("packs");
        let stored = opened(&target);
        assert!((stored.scene.bounds().max.y - height).abs() < 1e-3, "{:?}", stored.scene.bounds());
        let sources = stored.stored.expect("stored").sources;
        let found: Vec<_> = sources.iter().filter_map(|source| Path::new(&source.name).file_name()).collect();
        assert_eq!(found, ["mesh.01.obj", "mesh.02.obj", "mesh.03.obj", "plain.mtl"], "at {time:?}");
        assert!(sources.iter().all(|source| !source.has_changed()));
        write("mesh.02.obj", triangle(2.0) + "# the same again\n");
        assert_eq!(sources.iter().position(|source| source.has_changed()), Some(1));
        write("mesh.02.obj", triangle(2.0));
    }
}

/// Beside what stands still, what moves is at its moment; alone, what stands still has none.
#[test]
fn a_manifest_is_had_at_a_moment() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |file: &str, text: &str| {
        let path = folder.path().join(file);
        std::fs::write(&path, text).expect("writes");
        name(&path)
    };
    for (file, height) in [("a1.obj", 1.0), ("a2.obj", 3.0), ("still.obj", 0.5)] {
        write(file, &format!("v 0 0 0\nv 1 0 0\nv 0 {height} 0\nf 1 2 3\n"));
    }
    let both = write("both.toml", "[[place]]\nfile = \"a#.obj\"\n[[place]]\nfile = \"still.obj\"\n");
    let still = write("still.toml", "[[place]]\nfile = \"still.obj\"\n");
    let mut options = LoadOptions { time: Some(0.5), ..LoadOptions::default() };
    options.import.sequence_fps = 1.0;
    let scene = load(&both, &options).expect("reads");
    assert_eq!((scene.bounds().max.y, scene.meshes().len()), (2.0, 2));
    let opened = open(&both, &options).expect("reads");
    assert_eq!(opened.scene.bounds(), scene.bounds());
    let streamed = stream(&both, &options).expect("reads").collect().expect("reads");
    assert_eq!(streamed.meshes.len(), 2);
    let file = name(&folder.path().join("still.obj"));
    for source in [&still, &file] {
        assert!(load(source, &options).expect_err("still").to_string().contains("nothing moves"));
        assert!(stream(source, &options).map(drop).expect_err("still").to_string().contains("nothing moves"));
        let packed = pack_input(std::slice::from_ref(source), &options, None).map(drop);
        assert!(packed.expect_err("still").to_string().contains("nothing moves"));
    }
}

#[test]
fn a_cached_store_of_a_sequence_is_another_one_when_any_of_its_files_is() {
    let (folder, ply) = folder();
    let [first, second] = ["s1.ply", "s2.ply"].map(|file| folder.path().join(file));
    for path in [&first, &second] {
        std::fs::copy(&ply, path).expect("copies");
    }
    let sequence = name(&folder.path().join("s#.ply"));
    let cached = || {
        let control = PackControl { memory: Some(SMALL), cancel: &AtomicBool::new(false), progress: &|_| {} };
        let store = cached_store(&sequence, &LoadOptions::default(), &folder.path().join("stores"), control);
        store.expect("packs").expect("it does not fit")
    };
    let before = cached();
    assert_eq!(cached(), before);
    let file = std::fs::OpenOptions::new().append(true).open(&second);
    std::io::Write::write_all(&mut file.expect("opens"), b"\n").expect("writes");
    assert_ne!(cached(), before);
}

#[test]
fn too_little_memory_is_refused_before_work() {
    let (folder, ply) = folder();
    let target = folder.path().join("scene.vls");
    let error = pack(&[&ply], &target, Some(32 << 20)).expect_err("too little");
    assert_eq!(error.class, ErrorClass::Memory);
    assert!(error.what.contains("needed"), "{error}");
    assert_eq!(files(folder.path()), ["statue.ply"]);
}
