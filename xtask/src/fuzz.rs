//! Fuzzing: each target for a while, one after the other. See docs/fuzzing.md.

use crate::process::{root, step, together};
use crate::test::Tally;
use std::path::Path;
use std::process::{Command, Stdio};

/// Seconds a target where nothing is said.
const SECONDS: u32 = 60;

/// What ends an input that takes too much: seconds, MiB of the process, MiB at once.
const LIMITS: [&str; 5] =
    ["-timeout=10", "-rss_limit_mb=2048", "-malloc_limit_mb=512", "-print_final_stats=1", "-detect_leaks=0"];

/// `fuzz [TARGET] [SECONDS]`: one target or all of them.
pub(crate) fn run() -> Result<(), String> {
    if let Some(missing) = missing() {
        return Err(missing.into());
    }
    let mut words: Vec<String> = std::env::args().skip(2).collect();
    let seconds = words.last().and_then(|word| word.parse().ok());
    if seconds.is_some() {
        words.pop();
    }
    let known = targets()?;
    if let Some(unknown) = words.iter().find(|word| !known.contains(word)) {
        return Err(format!("no target is named {unknown}, there are {}", known.join(", ")));
    }
    let chosen = if words.is_empty() { known } else { words };
    together(chosen.iter().map(|target| fuzz(target, seconds.unwrap_or(SECONDS))))
}

/// Every target for a short while, where that is possible.
pub(crate) fn briefly(tally: &mut Tally) -> Result<(), String> {
    if let Some(missing) = missing() {
        tally.skip(&format!("fuzzing: {missing}"));
        return Ok(());
    }
    together(targets()?.iter().map(|target| fuzz(target, SECONDS)))
}

/// What fuzzing needs and is not there.
fn missing() -> Option<&'static str> {
    let works = |arguments: &[&str]| {
        let mut command = Command::new("rustup");
        command.args(["run", "nightly"]).args(arguments);
        command.stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok_and(|status| status.success())
    };
    if !works(&["rustc", "--version"]) {
        return Some("the nightly compiler is missing: rustup toolchain install nightly");
    }
    (!works(&["cargo", "fuzz", "--version"])).then_some("cargo-fuzz is missing: cargo install cargo-fuzz")
}

fn targets() -> Result<Vec<String>, String> {
    let folder = root().join("fuzz/fuzz_targets");
    let entries = std::fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let name = |path: &Path| path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let mut names: Vec<String> = entries.flatten().filter_map(|entry| name(&entry.path())).collect();
    names.sort();
    Ok(names)
}

/// Runs a target from what was found before and from the seeds.
fn fuzz(target: &str, seconds: u32) -> Result<(), String> {
    let folder = root().join("fuzz");
    let corpus = folder.join("corpus").join(target);
    std::fs::create_dir_all(&corpus).map_err(|e| format!("{}: {e}", corpus.display()))?;
    let mut command = Command::new("rustup");
    command.current_dir(root()).args(["run", "nightly", "cargo", "fuzz", "run", target]);
    command.arg(corpus).arg(folder.join("seeds").join(target)).arg("--").args(LIMITS);
    command.arg(format!("-max_total_time={seconds}"));
    let dictionary = folder.join("dictionaries").join(format!("{target}.dict"));
    if dictionary.exists() {
        command.arg(format!("-dict={}", dictionary.display()));
    }
    // One thread, so that a run can be repeated.
    command.env("RAYON_NUM_THREADS", "1");
    step(&format!("fuzz {target}, {seconds} s"), &mut command)
}
