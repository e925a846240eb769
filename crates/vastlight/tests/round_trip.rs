//! A demo scene written as GLB and read again gives the same picture, bit by bit.

mod common;

use vastlight::film::Picture;
use vastlight::scene::generate::names;
use vastlight::{LoadOptions, export, load};

/// Demos that have the same path from file to picture as others here, and millions of triangles.
const LARGE: [&str; 3] = ["city", "plant", "terrain"];

fn small(name: &str) -> vastlight::scene::Scene {
    let mut options = LoadOptions::default();
    options.generate.triangles = Some(20_000);
    let source = format!("demo:{name}");
    load(&source, &options).or_else(|_| load(&source, &LoadOptions::default())).expect("a demo")
}

fn picture(scene: &vastlight::scene::Scene) -> Picture {
    common::picture(&scene.clone().into(), &common::request(scene)).expect("renders")
}

fn pixels(picture: &Picture) -> impl Iterator<Item = f32> {
    picture.planes.iter().flat_map(|plane| &plane.values).copied()
}

#[test]
fn a_demo_written_as_glb_is_the_same_picture() {
    let directory = tempfile::tempdir().expect("a directory");
    for name in names().into_iter().filter(|name| !LARGE.contains(name)) {
        let scene = small(name);
        let path = directory.path().join(format!("{name}.glb"));
        if scene.implicit_mesh().is_some() {
            assert!(
                export::write(&scene, &path).is_err() && !path.exists(),
                "{name} has no triangles to write"
            );
            continue;
        }
        export::write(&scene, &path).expect("writes");
        let back = load(&path.display().to_string(), &LoadOptions::default()).expect("reads");
        let original = picture(&scene);
        let differing = pixels(&picture(&back)).zip(pixels(&original)).filter(|(a, b)| a != b).count();
        assert_eq!(differing, 0, "{name}: values that differ, of {}", pixels(&original).count());
        assert!(pixels(&original).any(|x| x > 0.0), "{name} is black");
    }
}
