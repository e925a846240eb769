//! The kept corpus of the fuzz targets, tried without a fuzzer.

use std::path::{Path, PathBuf};
use vastlight_harness::ALL;

fn seeds(target: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/seeds").join(target);
    let entries = std::fs::read_dir(&folder).expect("every target has seeds");
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.expect("an entry").path()).collect();
    files.sort();
    files
}

#[test]
fn seeds_keep_their_word() {
    for (target, harness) in ALL {
        let files = seeds(target);
        assert!(!files.is_empty(), "{target} has no seeds");
        for file in files {
            println!("{}", file.display());
            harness(&std::fs::read(&file).expect("readable"));
        }
    }
}

/// Cut off anywhere, and with a byte changed: what a fuzzer does, a little of it.
#[test]
fn damaged_seeds_keep_their_word() {
    for (target, harness) in ALL {
        for file in seeds(target) {
            let bytes = std::fs::read(&file).expect("readable");
            for part in 1..4 {
                println!("{} at {part}/4", file.display());
                let place = bytes.len() * part / 4;
                harness(&bytes[..place]);
                let mut changed = bytes.clone();
                if let Some(byte) = changed.get_mut(place) {
                    *byte ^= 1 << (2 * part - 1);
                }
                harness(&changed);
            }
        }
    }
}

#[test]
fn targets_are_harnesses() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/fuzz_targets");
    let entries = std::fs::read_dir(folder).expect("the targets");
    let mut found: Vec<String> = entries
        .map(|entry| {
            entry.expect("an entry").path().file_stem().expect("a name").to_string_lossy().into_owned()
        })
        .collect();
    found.sort();
    let mut known: Vec<&str> = ALL.iter().map(|(name, _)| *name).collect();
    known.sort_unstable();
    assert_eq!(found, known);
}
