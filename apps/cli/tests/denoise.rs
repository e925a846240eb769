//! `--denoise` with a library that halves the colour, one that fails, none, and the real one where it is installed.

mod common;
#[path = "../../../crates/denoise/tests/fake/mod.rs"]
mod fake;

use common::{Outcome, Workspace};
use fake::Fake;
use std::path::Path;
use vastlight::film::{Picture, read_picture};

const PICTURE: &str = "render demo:cornell -r 24x16 --spp 2 --device cpu";

fn with_library(work: &Workspace, library: &Path, arguments: &str) -> Outcome {
    work.run_with("VASTLIGHT_OIDN", library, &format!("{PICTURE} {arguments}"))
}

fn read(work: &Workspace, name: &str) -> Picture {
    read_picture(&work.path(name)).expect("a picture")
}

fn contains(bytes: &[u8], text: &str) -> bool {
    bytes.windows(text.len()).any(|window| window == text.as_bytes())
}

#[test]
fn without_the_library_it_is_an_error_before_work() {
    let work = Workspace::new();
    let missing = work.path("libmissing.so");
    let outcome = with_library(&work, &missing, "-o a.exr --stats s.json --denoise");
    for text in ["Open Image Denoise", "libmissing.so", "VASTLIGHT_OIDN"] {
        outcome.is_refusal(5, text);
    }
    assert!(work.files().is_empty());
    // Nothing is loaded that nobody asks for.
    assert_eq!(with_library(&work, &missing, "-o a.exr").code, 0);
}

#[test]
fn only_the_colour_changes_and_the_files_say_so() {
    let work = Workspace::new();
    let Some(fake) = Fake::new("") else { return };
    assert_eq!(work.run(&format!("{PICTURE} -o plain.exr --aov albedo,normal,depth")).code, 0);
    let plain = read(&work, "plain.exr");
    for (aovs, names) in [
        ("", vec!["B", "G", "R"]),
        ("--aov depth", vec!["B", "G", "R", "depth.Z"]),
        ("--aov depth,normal", vec!["B", "G", "R", "depth.Z", "normal.X", "normal.Y", "normal.Z"]),
    ] {
        let outcome =
            with_library(&work, &fake.library(), &format!("-o a.exr {aovs} --denoise --stats s.json"));
        assert_eq!(outcome.code, 0, "{}", outcome.stderr);
        let denoised = read(&work, "a.exr");
        assert_eq!(denoised.planes.iter().map(|p| p.name.as_str()).collect::<Vec<_>>(), names);
        for plane in &denoised.planes {
            let factor = if plane.name.len() == 1 { 0.5 } else { 1.0 };
            let expected = plain.plane(&plane.name).expect("the same channel").iter().map(|x| factor * x);
            assert!(plane.values.iter().copied().eq(expected), "{aovs}: {}", plane.name);
        }
        assert_eq!(work.json("s.json")["denoiser"], "Open Image Denoise 2.3.99");
    }
    let log = fake.log();
    let first = |channels| plain.three(channels).expect("channels").map(|plane| plane[0]);
    for (image, channels) in [
        ("color", ["R", "G", "B"]),
        ("albedo", ["albedo.R", "albedo.G", "albedo.B"]),
        ("normal", ["normal.X", "normal.Y", "normal.Z"]),
    ] {
        let line = format!("image {image} 24 x 16 starts {:?}", first(channels));
        assert!(log.contains(&line), "{line}: {log:?}");
    }
    assert_eq!(with_library(&work, &fake.library(), "-o a.png --denoise").code, 0);
    for file in ["a.exr", "a.png"] {
        assert!(contains(&work.bytes(file), "Open Image Denoise 2.3.99"), "{file}");
    }
    assert!(!contains(&work.bytes("plain.exr"), "enoise"));
}

#[test]
fn a_crop_is_denoised_and_too_little_memory_is_refused() {
    let work = Workspace::new();
    let Some(fake) = Fake::new("") else { return };
    let outcome = with_library(&work, &fake.library(), "-o a.exr --denoise --crop 3,2,20,13");
    assert_eq!(outcome.code, 0, "{}", outcome.stderr);
    assert!(fake.log().iter().any(|line| line.starts_with("image output 17 x 11")));
    let large = "render demo:cornell -r 1920x1080 --device cpu -o b.exr --denoise --memory 600MiB";
    let outcome = work.run_with("VASTLIGHT_OIDN", &fake.library(), large);
    outcome.is_refusal(4, "to denoise");
    assert_eq!(work.files(), ["a.exr"]);
}

#[test]
fn a_failure_afterwards_is_an_error_and_the_noisy_picture_is_kept() {
    let work = Workspace::new();
    if let Some(fake) = Fake::new("device") {
        let outcome = with_library(&work, &fake.library(), "-o a.exr --denoise");
        assert_eq!(outcome.code, 5, "{outcome:?}");
        assert!(outcome.stderr.contains("no luck today") && work.files().is_empty(), "{outcome:?}");
    }
    let Some(fake) = Fake::new("execute") else { return };
    let outcome = with_library(&work, &fake.library(), "-o a.exr --denoise -q");
    for text in ["no luck today", "written with its noise"] {
        outcome.is_refusal(5, text);
    }
    assert_eq!(work.run(&format!("{PICTURE} -o plain.exr")).code, 0);
    assert!(work.bytes("a.exr") == work.bytes("plain.exr"));
}

/// The real library: the picture comes nearer to one of many samples, and is the same on one thread and on two.
#[test]
fn the_installed_library_takes_noise_out() {
    let work = Workspace::new();
    let picture = "render demo:cornell -r 64x64 --device cpu -q";
    let outcome = work.run(&format!("{picture} --spp 4 -o denoised.exr --denoise -t 1"));
    if outcome.code == 5 && outcome.stderr.contains("cannot be loaded") {
        println!("skipped: Open Image Denoise is not installed: {}", outcome.stderr);
        return;
    }
    assert_eq!(outcome.code, 0, "{}", outcome.stderr);
    for command in ["--spp 4 -o two.exr --denoise -t 2", "--spp 4 -o noisy.exr", "--spp 256 -o smooth.exr"] {
        assert_eq!(work.run(&format!("{picture} {command}")).code, 0, "{command}");
    }
    assert!(work.bytes("denoised.exr") == work.bytes("two.exr"));
    let error = |name: &str| {
        let line = work.run(&format!("diff {name} smooth.exr")).stdout;
        let line: serde_json::Value = serde_json::from_str(&line).expect("one JSON line");
        line["relmse"].as_f64().expect("a number")
    };
    let (noisy, denoised) = (error("noisy.exr"), error("denoised.exr"));
    assert!(denoised < 0.3 * noisy, "{noisy} before, {denoised} after");
}
