//! The binding against a library that is known to the last call, and against the real one where it is installed.

#![allow(clippy::print_stdout, reason = "what is skipped is named")]

mod fake;

use fake::Fake;
use std::path::Path;
use vastlight_denoise::{DenoiseError, Denoiser, NoisyPicture};

const SIZE: [u32; 2] = [31, 17];
const PIXELS: usize = 31 * 17;

/// Planes of which each has one number more than the one before.
fn ramp(first: f32) -> [Vec<f32>; 3] {
    std::array::from_fn(|axis| vec![first + axis as f32; PIXELS])
}

fn slices(planes: &[Vec<f32>; 3]) -> [&[f32]; 3] {
    std::array::from_fn(|axis| &planes[axis][..])
}

fn picture<'p>(
    color: &'p [Vec<f32>; 3],
    albedo: &'p [Vec<f32>; 3],
    normal: &'p [Vec<f32>; 3],
) -> NoisyPicture<'p> {
    let [width, height] = SIZE;
    NoisyPicture { width, height, color: slices(color), albedo: slices(albedo), normal: slices(normal) }
}

#[test]
fn the_library_is_told_all_and_its_output_is_the_result() {
    let Some(fake) = Fake::new("") else { return };
    let mut color = ramp(1.0);
    color[1][PIXELS - 1] = 7.0;
    let (albedo, normal) = (ramp(10.0), ramp(20.0));
    let denoiser = Denoiser::open_at(Some(&fake.library()), 3).expect("loads");
    assert_eq!(denoiser.name(), "Open Image Denoise 2.3.99");
    let found = denoiser.denoise(&picture(&color, &albedo, &normal)).expect("runs");
    drop(denoiser);
    let expected = color.map(|plane| plane.iter().map(|x| 0.5 * x).collect::<Vec<_>>());
    assert_eq!(found, expected);
    let told = [
        "new device 1",
        "device numThreads 3",
        "new filter RT",
        "image color 31 x 17 starts [1.0, 2.0, 3.0]",
        "image albedo 31 x 17 starts [10.0, 11.0, 12.0]",
        "image normal 31 x 17 starts [20.0, 21.0, 22.0]",
        "image output 31 x 17 starts [0.0, 0.0, 0.0]",
        "filter hdr true",
        "filter cleanAux false",
        "filter maxMemoryMB 256",
        "commit filter",
        "execute filter",
        "release filter",
        "release device",
    ];
    assert_eq!(fake.log(), told);
}

#[test]
fn errors_of_the_library_are_values() {
    let (color, guide) = (ramp(1.0), ramp(0.0));
    let failed = DenoiseError::Failed("no luck today".into());
    if let Some(fake) = Fake::new("device") {
        assert_eq!(Denoiser::open_at(Some(&fake.library()), 1).expect_err("fails"), failed);
    }
    let Some(fake) = Fake::new("execute") else { return };
    let denoiser = Denoiser::open_at(Some(&fake.library()), 1).expect("loads");
    let picture = picture(&color, &guide, &guide);
    assert_eq!(denoiser.denoise(&picture).expect_err("fails"), failed);
    let wrong = NoisyPicture { width: 30, ..picture };
    assert_eq!(denoiser.denoise(&wrong).expect_err("planes too long"), DenoiseError::Shape(30 * 17));
    assert!(fake.log().contains(&"release filter".to_owned()));
}

#[test]
fn what_is_no_library_is_an_error_with_its_place() {
    let missing = Path::new("/no/such/folder/libOpenImageDenoise.so.2");
    let error = Denoiser::open_at(Some(missing), 1).expect_err("nothing there");
    assert!(
        matches!(&error, DenoiseError::Missing { looked_for, .. } if looked_for == &[missing]),
        "{error}"
    );
    assert!(error.to_string().contains("/no/such/folder") && error.hint().contains("VASTLIGHT_OIDN"));
    let folder = tempfile::tempdir().expect("temporary folder");
    let text = folder.path().join("text.so");
    std::fs::write(&text, "no library").expect("written");
    assert!(matches!(Denoiser::open_at(Some(&text), 1), Err(DenoiseError::Missing { .. })));
}

#[cfg(target_os = "linux")]
#[test]
fn another_library_is_an_error_with_what_it_lacks() {
    let error = Denoiser::open_at(Some(Path::new("libc.so.6")), 1).expect_err("another library");
    assert!(matches!(error, DenoiseError::Foreign { function: "oidnNewDevice", .. }), "{error}");
}

/// The real library, if it is installed: noise about a constant is gone, and threads do not matter.
#[test]
fn noise_goes_and_threads_do_not_matter() {
    let open = |threads| match Denoiser::open(threads) {
        Err(error @ DenoiseError::Missing { .. }) => {
            println!("skipped: Open Image Denoise: {error}");
            None
        }
        opened => Some(opened.expect("works")),
    };
    let noise = |i: usize| (i as u32).wrapping_mul(0x9e37_79b9).rotate_left(9) as f32 / u32::MAX as f32;
    let color: [Vec<f32>; 3] = std::array::from_fn(|_| (0..PIXELS).map(noise).collect());
    let guide = ramp(0.0);
    let mut results = Vec::new();
    for threads in [1, 2] {
        let Some(denoiser) = open(threads) else { return };
        results.push(denoiser.denoise(&picture(&color, &guide, &guide)).expect("runs"));
    }
    assert_eq!(results[0], results[1]);
    let deviation =
        |plane: &[f32]| (plane.iter().map(|x| (x - 0.5).powi(2)).sum::<f32>() / plane.len() as f32).sqrt();
    let (before, after) = (deviation(&color[0]), deviation(&results[0][0]));
    assert!(after < 0.3 * before, "{before} before, {after} after");
}
