//! Caustics by photons, from outside: the same bytes however they are made, and light where paths find none.

mod common;

use common::Workspace;

/// Few triangles, a small picture, few photons.
const SMALL: &str = "--triangles 2000 -r 24x24 --spp 2 --photons 4000 -q";

/// The bytes of a picture that is rendered so.
#[track_caller]
fn rendered(work: &Workspace, scene: &str, flags: &str) -> Vec<u8> {
    let outcome = work.run(&format!("render {scene} -o picture.exr {flags}"));
    assert_eq!(outcome.code, 0, "{scene} {flags}: {}", outcome.stderr);
    work.bytes("picture.exr")
}

#[test]
fn the_picture_depends_on_neither_threads_nor_memory() {
    let work = Workspace::new();
    let picture = |flags: &str| rendered(&work, "demo:caustic-sphere", &format!("{SMALL} {flags}"));
    let one = picture("--caustics photons -t 1");
    assert!(picture("--caustics photons -t 2") == one);
    assert!(picture("--caustics photons -t 2 --memory 200MiB") == one);
    assert!(picture("--caustics photons -t 2 --memory 8GiB") == one);
    assert!(picture("--caustics off") != one);
    assert!(picture("--caustics photons --photon-radius 0.01") != one);
}

#[test]
fn every_search_finds_the_same_light() {
    let work = Workspace::new();
    let mean = |search: &str| {
        rendered(
            &work,
            "demo:caustic-sphere",
            &format!("{SMALL} --caustics photons --photon-search {search}"),
        );
        mean_red(&work)
    };
    let expected = mean("brute");
    for search in ["lexicographic", "voxel", "planar", "rows"] {
        let found = mean(search);
        assert!((found / expected - 1.0).abs() < 1e-4, "{search}: {found}, brute force {expected}");
    }
}

fn reds(work: &Workspace) -> Vec<f32> {
    let picture = vastlight::film::read_picture(&work.path("picture.exr")).expect("a picture");
    picture.plane("R").expect("a colour").to_vec()
}

fn mean_red(work: &Workspace) -> f64 {
    let reds = reds(work);
    reds.iter().copied().map(f64::from).sum::<f64>() / reds.len() as f64
}

/// The lamp is so small that next to no path that leaves the plane through the ball meets it.
#[test]
fn the_focus_below_the_ball_is_bright() {
    let work = Workspace::new();
    let median = |caustics: &str| {
        let flags = "--triangles 20000 -r 48x48 --spp 4 --photons 20000 --crop 13,23,18,28 -q";
        rendered(&work, "demo:caustic-sphere", &format!("{flags} --caustics {caustics}"));
        let mut reds = reds(&work);
        reds.sort_by(f32::total_cmp);
        reds[reds.len() / 2]
    };
    let (off, photons) = (median("off"), median("photons"));
    assert!(photons > 0.1 && photons > 10.0 * off, "{off} without, {photons} with photons");
}

#[test]
fn a_store_gives_the_picture_of_the_scene_in_memory() {
    let work = Workspace::new();
    let packed = work.run("pack demo:caustic-sphere --triangles 2000 -o scene.vls -q");
    assert_eq!(packed.code, 0, "{}", packed.stderr);
    let flags = "-r 24x24 --spp 2 --photons 4000 -q --caustics photons";
    let in_memory = rendered(&work, "demo:caustic-sphere", &format!("--triangles 2000 {flags}"));
    for threads in [1, 2] {
        assert!(rendered(&work, "scene.vls", &format!("{flags} -t {threads} --memory 150MiB")) == in_memory);
    }
}

#[test]
fn point_lights_send_photons_by_a_grid() {
    let work = Workspace::new();
    let picture = |flags: &str| {
        rendered(&work, "demo:prism", &format!("-r 24x16 --spp 1 --photons 4096 -q --integrator {flags}"))
    };
    let one = picture("photon-caustics -t 1");
    assert!(picture("photon-caustics -t 2") == one);
    assert!(picture("whitted") != one);
}

#[test]
fn wrong_values_are_one_clear_error() {
    let work = Workspace::new();
    for (flags, text) in [
        ("--caustics rays", "photons"),
        ("--caustics photons --integrator ao", "--integrator path"),
        ("--caustics photons --integrator whitted", "--integrator path"),
        ("--caustics photons --photons 0", "--photons"),
        ("--caustics photons --photons many", "--photons"),
        ("--caustics photons --photon-radius 0", "above 0"),
        ("--caustics photons --photon-radius nan", "--photon-radius"),
        ("--caustics photons --photon-search octree", "voxel"),
    ] {
        work.refused(&format!("render demo:caustic-sphere -o picture.png {SMALL} {flags}"), 2, text);
    }
    assert!(work.files().is_empty());
}
