//! The collection of models beside glTF: OBJ, images, environment maps, and what is malformed.

#![expect(clippy::print_stdout, reason = "a test says what it skips")]

mod common;

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use vastlight_import::{ErrorKind, Limits, LoadOptions, decode_image, load, load_environment};
use vastlight_scene::{Diagnostics, Image, Scene, Texels};

/// All files below a folder of the collection in order, or a clear line why the test is skipped.
fn files(folder: &str) -> Vec<PathBuf> {
    let Some(root) = common::models(folder) else { return Vec::new() };
    let mut found = Vec::new();
    collect(&root, &mut found);
    found.sort();
    found
}

fn collect(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder").map(|e| e.expect("an entry").path()) {
        if entry.is_dir() {
            collect(&entry, found);
        } else {
            found.push(entry);
        }
    }
}

fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|e| e == extension)
}

fn image(path: &Path) -> Result<Image, vastlight_import::ImportError> {
    decode_image(&fs::read(path).expect("readable"), &path.display().to_string(), &Limits::default())
}

#[test]
fn every_obj_becomes_a_scene() {
    for folder in ["furniture", "mesh", "scene", "bitterli"] {
        for path in files(folder).iter().filter(|p| has_extension(p, "obj")) {
            let desc = load(path, &LoadOptions::default()).expect("well formed");
            let names: Vec<&str> = desc.meshes.iter().map(|m| m.name.as_str()).collect();
            let repaired = desc.diagnostics.items().len();
            let scene = Scene::new(desc.clone()).expect("valid");
            assert!(scene.unique_triangles() > 1, "{} {names:?}", path.display());
            assert!(scene.bounds().size().length() > 0.0);
            assert!(repaired <= 1, "{}: {:?}", path.display(), desc.diagnostics.items());
        }
    }
}

#[test]
fn glass_of_the_furniture_is_glass() {
    for path in files("furniture").iter().filter(|p| has_extension(p, "obj")) {
        let desc = load(path, &LoadOptions::default()).expect("well formed");
        for material in desc.materials {
            let named_glass = material.name.to_lowercase().contains("glas");
            assert!(!named_glass || material.transmission.factor == 1.0, "{}", material.name);
        }
    }
}

#[test]
fn environment_maps() {
    for path in files("hdri").iter().filter(|p| !p.ends_with("LICENSE")) {
        let mut found = Diagnostics::default();
        let image = load_environment(path, &Limits::default(), &mut found).expect("well formed");
        let Texels::F32(values) = &image.texels else { panic!("floats") };
        assert_eq!((image.width, image.channels), (2 * image.height, 3));
        let mean = values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64;
        assert!(mean > 1e-3 && mean < 1e3, "{}: {mean}", path.display());
        assert!(found.items().len() <= 1, "{:?}", found.items());
    }
}

/// PngSuite names its files: those with `x` are corrupt; interlaced and plain ones, all compression levels, all chunk
/// layouts show the same picture.
#[test]
fn png_suite() {
    let suite: Vec<PathBuf> = files("png").into_iter().filter(|p| has_extension(p, "png")).collect();
    let name = |path: &Path| path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    for path in &suite {
        assert_eq!(image(path).is_err(), name(path).starts_with('x'), "{}", path.display());
    }
    let texels = |path: &Path| image(path).expect("well formed").texels;
    let same = |a: &str, b: &str| {
        for path in suite.iter().filter(|p| name(p).starts_with(a)) {
            let twin = path.with_file_name(name(path).replacen(a, b, 1));
            assert_eq!(texels(path), texels(&twin), "{} {}", path.display(), twin.display());
        }
    };
    same("basi", "basn");
    (1..=9).for_each(|i| same(&format!("s0{i}i"), &format!("s0{i}n")));
    (32..=40).for_each(|i| same(&format!("s{i}i"), &format!("s{i}n")));
    ["oi2", "oi4", "oi9"].into_iter().for_each(|a| same(a, "oi1"));
    ["z03", "z06", "z09"].into_iter().for_each(|a| same(a, "z00"));
    let sixteen = suite.iter().filter(|p| name(p).ends_with("16.png"));
    for path in sixteen {
        assert!(matches!(texels(path), Texels::U16(_)), "{}", path.display());
    }
}

#[test]
fn malformed_files_are_refused_in_time() {
    let start = Instant::now();
    for path in files("malformed/assimp-invalid") {
        match load(&path, &LoadOptions::default()) {
            Ok(desc) => assert!(!desc.diagnostics.items().is_empty(), "{} needs a word", path.display()),
            Err(e) => assert!(e.kind != ErrorKind::Io && e.place.contains("assimp"), "{e}"),
        }
    }
    for path in files("malformed/openexr") {
        let error = image(&path).expect_err("broken");
        assert!(matches!(
            error.kind,
            ErrorKind::Malformed | ErrorKind::Unsupported | ErrorKind::UnknownFormat
        ));
    }
    assert!(start.elapsed() < Duration::from_secs(5), "{:?}", start.elapsed());
}
