//! Lints and tests. A test that needs something absent prints `skipped: ...`; those are counted and named at the end.

use crate::process::{cargo, lines, step};
use crate::{book, browser, driver};

/// Code that is built on demand only is proved as well.
const FEATURES: &str = "vastlight-cli/object-store";

/// Format, lints, documentation.
pub(crate) fn lint() -> Result<(), String> {
    step("format", &mut cargo(&["fmt", "--all", "--check"], &[]))?;
    step(
        "lints",
        &mut cargo(
            &[
                "clippy",
                "--quiet",
                "--workspace",
                "--all-targets",
                "--features",
                FEATURES,
                "--",
                "-D",
                "warnings",
            ],
            &[],
        ),
    )?;
    step(
        "documentation",
        &mut cargo(
            &["doc", "--quiet", "--workspace", "--no-deps", "--features", FEATURES],
            &[("RUSTDOCFLAGS", "-Dwarnings")],
        ),
    )
}

/// Everything that must pass.
pub(crate) fn run() -> Result<(), String> {
    lint()?;
    book::run_if_possible()?;
    driver::find_or_install();
    browser::report();
    tests("tests", &[])
}

/// The long proofs: the same tests, told to take their time, optimised.
pub(crate) fn soak() -> Result<(), String> {
    driver::find_or_install();
    browser::report();
    tests("long proofs", &[("VASTLIGHT_SOAK", "1")])
}

fn tests(title: &str, environment: &[(&str, &str)]) -> Result<(), String> {
    eprintln!("== {title}");
    let mut tally = Tally::default();
    let arguments = ["test", "--workspace", "--features", FEATURES, "--no-fail-fast", "--", "--show-output"];
    let mut command = cargo(&arguments, environment);
    let succeeded = lines(&mut command, |line| tally.read(line))?;
    for reason in &tally.skipped {
        println!("skipped: {reason}");
    }
    println!("{} passed, {} failed, {} skipped", tally.passed, tally.failed, tally.skipped.len());
    if !succeeded || tally.failed > 0 {
        return Err(format!("{title}: failed"));
    }
    if tally.passed == 0 { Err(format!("{title}: no test ran")) } else { Ok(()) }
}

/// What the test programs said, all together.
#[derive(Default)]
struct Tally {
    passed: usize,
    failed: usize,
    skipped: Vec<String>,
    in_failures: bool,
}

impl Tally {
    fn read(&mut self, line: &str) {
        if let Some(counts) = line.strip_prefix("test result: ") {
            self.passed += count_before(counts, " passed");
            self.failed += count_before(counts, " failed");
            self.in_failures = false;
        } else if let Some(reason) = line.strip_prefix("skipped: ") {
            self.skipped.push(reason.into());
        } else if line == "failures:" {
            self.in_failures = true;
        }
        let failed = line.starts_with("test ") && line.ends_with("FAILED");
        if self.in_failures || failed {
            println!("{line}");
        }
    }
}

/// The number that stands before `word` in `text`; 0 if there is none.
fn count_before(text: &str, word: &str) -> usize {
    text.split(word).next().and_then(|t| t.rsplit(' ').next()).and_then(|n| n.parse().ok()).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tally_counts_passes_failures_and_skips() {
        let mut tally = Tally::default();
        for line in [
            "test a ... ok",
            "skipped: models: no folder",
            "test result: ok. 12 passed; 0 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.01s",
            "test result: FAILED. 3 passed; 2 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.01s",
        ] {
            tally.read(line);
        }
        assert_eq!((tally.passed, tally.failed, tally.skipped.len()), (15, 2, 1));
    }
}
