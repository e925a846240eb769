//! The kept corpus of the fuzz targets, tried without a fuzzer.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use vastlight_harness::{ALL, seeds};

/// Seeds that readers refuse, and are there for that.
const REFUSED: &[&str] = &[
    // Texels as they are: glTF takes Basis textures alone.
    "image/rgba.ktx2",
];

#[test]
fn seeds_keep_their_word_and_are_taken() {
    let mut refused = Vec::new();
    for (target, harness) in ALL {
        let files = seeds(target);
        assert!(!files.is_empty(), "{target} has no seeds");
        for file in files {
            println!("{}", file.display());
            if !harness(&std::fs::read(&file).expect("readable")) {
                refused.push(format!("{target}/{}", file.file_name().expect("a name").display()));
            }
        }
    }
    assert_eq!(refused, REFUSED);
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

fn fuzz() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz")
}

/// Names of the files of a folder, without extensions.
fn stems(folder: &str) -> BTreeSet<String> {
    let entries = std::fs::read_dir(fuzz().join(folder)).expect("a folder");
    let stem = |path: PathBuf| path.file_stem().expect("a name").to_string_lossy().into_owned();
    entries.map(|entry| stem(entry.expect("an entry").path())).collect()
}

#[test]
fn targets_are_harnesses() {
    let known: BTreeSet<String> = ALL.iter().map(|(name, _)| (*name).to_owned()).collect();
    assert_eq!(stems("fuzz_targets"), known);
    let manifest = std::fs::read_to_string(fuzz().join("Cargo.toml")).expect("readable");
    for name in &known {
        let path = format!("fuzz_targets/{name}.rs");
        let text = std::fs::read_to_string(fuzz().join(&path)).expect("readable");
        assert!(text.contains(&format!("target!(\"{name}\")")), "{path} runs another harness");
        let entry = format!("[[bin]]\nname = \"{name}\"\npath = \"{path}\"\n");
        assert!(manifest.contains(&entry), "fuzz/Cargo.toml has no {name}");
    }
    for folder in ["dictionaries", "seeds"] {
        assert!(stems(folder).is_subset(&known), "fuzz/{folder}: {:?}", stems(folder));
    }
}
