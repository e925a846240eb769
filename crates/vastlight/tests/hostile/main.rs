//! Damaged stores give an error or a picture: no panic, no hang, no read outside, no memory beyond reason.
//!
//! Stores are damaged by chance, also behind checksums that are right, then opened and rendered, in a process of its own whose
//! memory is limited: what it asks for beyond that ends it. Hundreds of cases in a test run, many thousands with `VASTLIGHT_SOAK`
//! in the environment.
#![cfg(target_os = "linux")]

#[path = "../common/mod.rs"]
mod common;
mod damage;

use common::random::Random;
use common::{SCENES, is_soak, opened, options, packed, picture};
use damage::Anatomy;
use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use std::sync::mpsc::channel;
use std::time::Duration;
use vastlight::store::PackConfig;
use vastlight::store::format::Section;
use vastlight::transport::RenderSettings;
use vastlight::{CameraChoice, Error, ErrorClass, LoadOptions, RenderRequest};

/// Says which scene, the first case, and how many, to the process that tries them.
const CASES: &str = "VASTLIGHT_HOSTILE_CASES";
/// Address space of that process, KiB: threads, code, and a hundred times the store.
const LIMIT_KIB: u64 = 1 << 20;
/// A case takes milliseconds.
const HANG: Duration = Duration::from_secs(60);

/// Bytes of texture of the scene that has any.
const TEXTURE_BYTES: u64 = 1 << 16;

fn anatomy(scene: &str) -> Anatomy {
    let config = PackConfig { page_bytes: 1 << 12, tile_bytes: 256, ..PackConfig::default() };
    Anatomy::of(packed(scene, &options(scene, TEXTURE_BYTES), &config).0)
}

/// Opens a store and renders a small picture of it.
fn try_out(bytes: Vec<u8>, options: &LoadOptions, random: &mut Random) -> Result<(), Error> {
    let open = opened(bytes, options)?;
    let camera = CameraChoice::default().resolve(&open.scene)?;
    let mut request = RenderRequest::new(RenderSettings::new(camera, 16, 9), 1);
    request.paging.cache_fraction = Some(random.below(3) as f32 * 0.5);
    picture(&open, &request).map(|_| ())
}

/// The process that tries cases; does nothing unless it is told to.
#[test]
fn cases_of_a_child() {
    let Ok(cases) = std::env::var(CASES) else { return };
    let mut words = cases.split(' ');
    let mut number = || words.next().and_then(|word| word.parse::<u64>().ok()).expect("three numbers");
    let (scene, first, count) = (SCENES[number() as usize], number(), number());
    let (anatomy, options) = (anatomy(scene), options(scene, TEXTURE_BYTES));
    let (mut refused, mut rendered) = (0, 0);
    for case in first..first + count {
        let mut random = Random::new(case);
        let (damage, bytes) = anatomy.damaged(&mut random);
        println!("case {case}: {damage:?}");
        match try_out(bytes, &options, &mut random) {
            Ok(()) => rendered += 1,
            Err(error) => {
                refused += 1;
                assert!(matches!(error.class, ErrorClass::Scene | ErrorClass::Usage), "{error:?}");
            }
        }
    }
    println!("outcome {refused} {rendered}");
}

/// Tries cases in a process; how many were refused, and how many rendered.
fn outcome(scene: usize, first: u64, count: u64) -> [u64; 2] {
    let program = std::env::current_exe().expect("this program");
    let script = format!("ulimit -v {LIMIT_KIB}; exec \"$0\" \"$@\"");
    let mut child = Command::new("sh")
        .args(["-c", &script])
        .arg(program)
        .args(["--exact", "cases_of_a_child", "--nocapture", "--test-threads", "1"])
        .env(CASES, format!("{scene} {first} {count}"))
        .env("MALLOC_ARENA_MAX", "2")
        .env("RAYON_NUM_THREADS", "2")
        .stdout(Stdio::piped())
        .spawn()
        .expect("starts");
    let (sender, lines) = channel();
    let stdout = child.stdout.take().expect("piped");
    let reader = std::thread::spawn(move || {
        // Nobody listens any more once a case hung.
        BufReader::new(stdout).lines().map_while(Result::ok).all(|line| sender.send(line).is_ok())
    });
    let (mut last, mut found) = (String::new(), None);
    while let Some(line) = lines.recv_timeout(HANG).map_or_else(|e| hung(e, &mut child, &last), Some) {
        if let Some(numbers) = line.strip_prefix("outcome ") {
            let numbers: Vec<u64> = numbers.split(' ').filter_map(|n| n.parse().ok()).collect();
            found = <[u64; 2]>::try_from(numbers).ok();
        } else if line.contains("case ") {
            last = line;
        }
    }
    let status = child.wait().expect("ends");
    reader.join().expect("reads");
    assert!(status.success(), "{}: {status} at {last}", SCENES[scene]);
    found.expect("an outcome")
}

/// None at the end of the lines; ends the process where none came for too long.
fn hung(
    error: std::sync::mpsc::RecvTimeoutError,
    child: &mut std::process::Child,
    last: &str,
) -> Option<String> {
    if error == std::sync::mpsc::RecvTimeoutError::Timeout {
        child.kill().expect("ends");
        panic!("hangs at {last}");
    }
    None
}

#[test]
fn damaged_stores_are_errors_or_pictures() {
    let count = if is_soak() { 4000 } else { 60 };
    for (number, scene) in SCENES.iter().enumerate() {
        let start = std::time::Instant::now();
        let [refused, rendered] = outcome(number, 0, count);
        assert_eq!(refused + rendered, count);
        assert!(refused > count / 3 && rendered > count / 20, "{scene}: {refused} {rendered}");
        println!("{scene}: {refused} refused, {rendered} rendered, {:?}", start.elapsed());
    }
}

/// What moves, and the meshes that it moves, with wrong numbers.
#[test]
fn damaged_movements_are_errors_or_pictures() {
    let folder = tempfile::tempdir().expect("a folder");
    let source = common::animated::write(folder.path()).display().to_string();
    let stored = Anatomy::of(packed(&source, &LoadOptions::default(), &PackConfig::default()).0);
    let try_at = |bytes: Vec<u8>, time: f32, random: &mut Random| {
        try_out(bytes, &LoadOptions { time: Some(time), ..LoadOptions::default() }, random)
    };
    try_at(Anatomy::of(stored.sealed()).sealed(), 0.5, &mut Random::new(1)).expect("sound");
    let count = if is_soak() { 4000 } else { 100 };
    let (mut refused, mut rendered) = (0, 0);
    for case in 0..count {
        let random = &mut Random::new(case);
        let section =
            [Section::Movement, Section::Movement, Section::Motion, Section::Scene, Section::Meshes];
        let bytes = stored.damaged_in(*random.of(&section), random);
        match try_at(bytes, 0.25 * (case % 9) as f32, random) {
            Ok(()) => rendered += 1,
            Err(error) => {
                refused += 1;
                assert!(matches!(error.class, ErrorClass::Scene | ErrorClass::Usage), "{error:?}");
            }
        }
    }
    assert!(refused > count / 5 && rendered > count / 20, "{refused} {rendered}");
}

/// A page in which all eight children of each node are the next node: as many ways as eight to the power of the nodes.
#[test]
fn ways_that_meet_again_end() {
    let stored = Anatomy::of(packed(SCENES[2], &options(SCENES[2], TEXTURE_BYTES), &PackConfig::default()).0);
    let bytes = stored.with_meeting_ways();
    let (done, outcome) = channel();
    std::thread::spawn(move || {
        done.send(try_out(bytes, &LoadOptions::default(), &mut Random::new(1)).is_ok())
    });
    assert_eq!(outcome.recv_timeout(HANG), Ok(true));
}

/// What is not damaged is rendered, so that the limits above are not what refuses.
#[test]
fn sealed_again_a_store_is_sound() {
    for scene in SCENES {
        let config = PackConfig { page_bytes: 1 << 12, tile_bytes: 256, ..PackConfig::default() };
        let bytes = packed(scene, &options(scene, TEXTURE_BYTES), &config).0;
        assert!(Anatomy::of(bytes.clone()).sealed() == bytes);
        try_out(bytes, &options(scene, TEXTURE_BYTES), &mut Random::new(1)).expect("renders");
    }
}
