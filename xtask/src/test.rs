//! Lints and tests. A test that needs something absent prints `skipped: ...`; those are counted and named at the end.

use crate::process::{cargo, lines, step, together};
use crate::{axe, book, browser, driver, fuzz, python};
use std::process::Stdio;

/// Code that is built on demand only is proved as well.
pub(crate) const FEATURES: &str = "vastlight-cli/object-store";

/// Format, lints, documentation, dependencies.
pub(crate) fn lint() -> Result<(), String> {
    let mut tally = Tally::default();
    lints().and_then(|()| dependencies(&mut tally))?;
    tally.skipped.iter().for_each(|reason| println!("skipped: {reason}"));
    Ok(())
}

fn lints() -> Result<(), String> {
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

/// Licences, versions and sources of what is built upon (`deny.toml`), where cargo-deny is installed.
fn dependencies(tally: &mut Tally) -> Result<(), String> {
    let mut probe = cargo(&["deny", "--version"], &[]);
    if !probe.stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok_and(|status| status.success()) {
        tally.skip("dependencies: cargo-deny is missing (cargo install cargo-deny)");
        return Ok(());
    }
    let arguments = ["deny", "--log-level", "error", "check", "licenses", "bans", "sources"];
    step("dependencies", &mut cargo(&arguments, &[]))
}

/// Everything that must pass.
pub(crate) fn run() -> Result<(), String> {
    lints()?;
    driver::find_or_install();
    browser::report();
    axe::find_or_fetch();
    tests("tests", &[], |tally| together([dependencies(tally), book::test(tally), python::test(tally)]))
}

/// The Python package alone.
pub(crate) fn python() -> Result<(), String> {
    let mut tally = Tally::default();
    let outcome = python::test(&mut tally);
    tally.conclude("python", true).and(outcome)
}

/// The long proofs: the same tests, told to take their time, optimised.
pub(crate) fn soak() -> Result<(), String> {
    driver::find_or_install();
    browser::report();
    axe::find_or_fetch();
    tests("long proofs", &[("VASTLIGHT_SOAK", "1")], fuzz::briefly)
}

/// Runs the workspace's tests, and more.
fn tests(
    title: &str,
    environment: &[(&str, &str)],
    more: impl FnOnce(&mut Tally) -> Result<(), String>,
) -> Result<(), String> {
    eprintln!("== {title}");
    let mut tally = Tally::default();
    let arguments = ["test", "--workspace", "--features", FEATURES, "--no-fail-fast", "--", "--show-output"];
    let mut command = cargo(&arguments, environment);
    let succeeded = lines(&mut command, |line| tally.read(line))?;
    let more = more(&mut tally);
    if let Err(message) = &more {
        println!("{message}");
    }
    tally.conclude(title, succeeded && more.is_ok())
}

/// What the test programs said, all together.
#[derive(Debug, Default)]
pub(crate) struct Tally {
    passed: usize,
    failed: usize,
    skipped: Vec<String>,
    in_failures: bool,
}

impl Tally {
    /// Notes what was not tested, and why.
    pub(crate) fn skip(&mut self, reason: &str) {
        self.skipped.push(reason.into());
    }

    /// Says what came of it.
    pub(crate) fn conclude(&self, title: &str, succeeded: bool) -> Result<(), String> {
        for reason in &self.skipped {
            println!("skipped: {reason}");
        }
        println!("{} passed, {} failed, {} skipped", self.passed, self.failed, self.skipped.len());
        if !succeeded || self.failed > 0 {
            return Err(format!("{title}: failed"));
        }
        if self.passed == 0 { Err(format!("{title}: no test ran")) } else { Ok(()) }
    }

    /// Reads a line of pytest: `SKIPPED [1] file:line: reason`, `12 passed, 1 skipped in 3.4s`.
    pub(crate) fn read_pytest(&mut self, line: &str) {
        if let Some(skipped) = line.strip_prefix("SKIPPED [") {
            let reason = skipped.split(": ").skip(1).collect::<Vec<_>>().join(": ");
            self.skip(&reason);
        } else if line.contains(" passed") || line.contains(" failed") || line.contains(" error") {
            self.passed += count_before(line, " passed");
            self.failed += count_before(line, " failed") + count_before(line, " error");
        }
        println!("{line}");
    }

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
    let before = text.split_once(word).and_then(|(before, _)| before.rsplit(' ').next());
    before.and_then(|number| number.parse().ok()).unwrap_or(0)
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
        tally.read_pytest("SKIPPED [1] python/tests/test_extras.py:12: trimesh: not installed");
        tally.read_pytest("40 passed, 1 skipped in 3.14s");
        tally.read_pytest("1 failed, 39 passed, 2 errors in 3.14s");
        assert_eq!((tally.passed, tally.failed), (94, 5));
        assert_eq!(tally.skipped[1], "trimesh: not installed");
    }
}
